#include "server/jobs/postgres_pool.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "core/base/expects.h"

namespace kiln::sql {
namespace {

constexpr Millis kFirstPause{100}, kLongestPause{5000};
constexpr std::chrono::seconds kWaitForFree{10};

Millis longer(Millis pause) { return std::clamp(pause * 2, kFirstPause, kLongestPause); }

}  // namespace

PostgresPool::Held::~Held() {
  if (connection_) pool_->give_back(std::move(connection_));
}

Result<PostgresPool::Held> PostgresPool::take(bool fresh) {
  std::unique_lock lock(mutex_);
  if (!returned_.wait_for(lock, kWaitForFree, [&] { return free_ > 0; })) {
    return fault("store_unavailable", "all connections to the job store are busy");
  }
  if (fresh) kept_.clear();
  if (!kept_.empty()) {
    auto connection = std::move(kept_.back());
    kept_.pop_back();
    --free_;
    return Held(*this, std::move(connection));
  }
  if (Clock::now() < next_try_) return fault("store_unavailable", "the job store does not answer");
  --free_;
  lock.unlock();
  auto made = connect();
  lock.lock();
  if (made) {
    pause_ = Millis(0);
    next_try_ = {};
    return Held(*this, std::move(*made));
  }
  ++free_;
  pause_ = longer(pause_);
  next_try_ = Clock::now() + pause_;
  returned_.notify_one();
  return tl::make_unexpected(made.error());
}

Result<std::unique_ptr<PostgresConnection>> PostgresPool::connect() { return PostgresConnection::open(options_); }

void PostgresPool::give_back(std::unique_ptr<PostgresConnection> connection) {
  const std::lock_guard lock(mutex_);
  if (connection->idle()) kept_.push_back(std::move(connection));
  ++free_;
  returned_.notify_one();
}

PostgresListener::PostgresListener(PostgresOptions options, std::function<void()> wake)
    : options_(std::move(options)), wake_(std::move(wake)), stop_(::eventfd(0, EFD_CLOEXEC)) {
  EXPECTS(stop_ >= 0);
  thread_ = std::thread([this] { work(); });
}

PostgresListener::~PostgresListener() {
  const std::uint64_t one = 1;
  EXPECTS(::write(stop_, &one, sizeof one) == sizeof one);
  thread_.join();
  ::close(stop_);
}

void PostgresListener::work() {
  for (Millis pause{0}; wait(-1, pause); pause = longer(pause)) {
    const auto connection = PostgresConnection::open(options_);
    if (!connection || !(*connection)->execute("LISTEN kiln")) continue;
    pause = Millis(0);
    wake_();
    listen(**connection);
  }
}

void PostgresListener::listen(PostgresConnection& connection) {
  constexpr Millis kLook{30'000};  // a connection that died without a word shows when it is asked
  while (wait(connection.descriptor(), kLook)) {
    const auto noticed = connection.take_notices();
    if (!noticed || !connection.idle()) return;
    if (*noticed) {
      wake_();
    } else if (!connection.execute("SELECT 1")) {
      return;
    }
  }
}

bool PostgresListener::wait(int descriptor, Millis at_most) const {
  std::array<pollfd, 2> what{pollfd{stop_, POLLIN, 0}, pollfd{descriptor, POLLIN, 0}};
  ::poll(what.data(), what.size(), static_cast<int>(at_most.count()));
  return (what[0].revents & POLLIN) == 0;
}

}  // namespace kiln::sql
