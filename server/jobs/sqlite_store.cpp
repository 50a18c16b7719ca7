#include "server/jobs/sqlite_store.h"

#include <chrono>
#include <shared_mutex>

#include "server/jobs/sql_store.h"
#include "server/jobs/sqlite_schema.h"

namespace kiln {
namespace {

using sql::SqliteConnection;

std::int64_t system_now_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Millis>(now).count();
}

template <class Lock>
struct HeldGate final : BlobGate {
  explicit HeldGate(std::shared_mutex& gate) : lock(gate) {}
  Lock lock;
};

/// Invariants: every write runs in one IMMEDIATE transaction on writer_ under write_mutex_; reader_ only reads.
class SqliteEngine final : public sql::Engine {
 public:
  SqliteEngine(std::unique_ptr<SqliteConnection> writer, std::unique_ptr<SqliteConnection> reader)
      : writer_(std::move(writer)), reader_(std::move(reader)) {}

  Result<void> write(const Work& work) override {
    const std::lock_guard lock(write_mutex_);
    KILN_TRY(transaction, sql::Transaction::begin(*writer_));
    KILN_DO(work(*writer_));
    return transaction.commit();
  }
  Result<void> read(const Work& work) override {
    const std::lock_guard lock(read_mutex_);
    return work(*reader_);
  }
  const char* keep_rows(bool) const override { return ""; }  // there is one writer
  Result<std::unique_ptr<BlobGate>> blob_gate(bool alone) override {
    if (alone) return std::make_unique<HeldGate<std::unique_lock<std::shared_mutex>>>(gate_);
    return std::make_unique<HeldGate<std::shared_lock<std::shared_mutex>>>(gate_);
  }
  bool shared() const override { return false; }
  void on_change(std::function<void()>) override {}  // nobody else writes

 private:
  std::mutex write_mutex_, read_mutex_;
  std::shared_mutex gate_;
  std::unique_ptr<SqliteConnection> writer_, reader_;
};

}  // namespace

Result<std::unique_ptr<JobStore>> open_sqlite_store(const SqliteOptions& options) {
  const auto now = options.now_ms ? options.now_ms : system_now_ms;
  KILN_TRY(writer, sql::open_writer(options.file, now));
  KILN_TRY(reader, sql::open_reader(options.file, now));
  return std::make_unique<sql::SqlStore>(std::make_unique<SqliteEngine>(std::move(writer), std::move(reader)));
}

Result<void> backup_sqlite_store(const std::filesystem::path& file, const std::filesystem::path& target) {
  if (!std::filesystem::exists(file)) return fault("not_found", "there is no job store in the data folder");
  KILN_TRY(reader, SqliteConnection::open(file, SqliteConnection::Mode::read_only, system_now_ms));
  KILN_DO(reader->execute("PRAGMA busy_timeout=5000"));
  KILN_DO(reader->query("VACUUM INTO ?", target.string()));
  return {};
}

}  // namespace kiln
