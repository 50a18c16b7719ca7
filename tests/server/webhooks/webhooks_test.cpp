// Receivers hear of every job that ends: signed, again until they answer, through restarts, and on public addresses
// alone.
#include "server/webhooks/webhooks.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <thread>

#include "server/jobs/sqlite_store.h"
#include "server/webhooks/post.h"
#include "server/webhooks/signature.h"
#include "tests/fixtures/webhook_receiver.h"

/// Before that of the system, for curl too: a name server that does not answer for eight seconds.
extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** found) {
  if (name != nullptr && std::string_view(name) == "silent.test") {
    std::this_thread::sleep_for(std::chrono::seconds(8));
    return EAI_AGAIN;
  }
  static const auto system = reinterpret_cast<decltype(&::getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return system(name, service, hints, found);
}

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* kSecret = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

class WebhooksTest : public ::testing::Test {
 protected:
  WebhooksTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_webhooks.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    open();
    EXPECT_TRUE(store_->deliveries().mark());  // what comes from now on is news
  }
  ~WebhooksTest() override {
    webhooks_.reset();
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
  void open() { store_ = open_sqlite_store({folder_ / "kiln.db", {}}).value(); }

  /// Times of a test's: a tenth of a second where a real server waits for seconds.
  WebhookOptions options(const std::vector<std::string>& urls) const {
    WebhookOptions options;
    for (const std::string& url : urls) options.receivers.push_back({url, read_webhook_secret(kSecret).value(), {}});
    options.private_too = true;
    options.timeout = Millis(1000);
    options.first_pause = Millis(100);
    options.look_every = Millis(10);
    return options;
  }
  void start(const WebhookOptions& options) {
    webhooks_ = std::make_unique<Webhooks>(*store_, options);
    webhooks_->start();
  }
  Job create(const std::string& tenant = "") {
    const std::string sha(64, 'a');
    EXPECT_TRUE(store_->touch_blob(sha, 100, tenant));
    NewJob job;
    job.tenant = tenant;
    job.label = "night";
    job.inputs.scene = {"scene.glb", sha};
    job.recipe = "{}";
    job.content_key = "key" + std::to_string(++keys_);
    job.request_hash = "hash";
    return store_->create(job).value().job;
  }
  std::string canceled_job(const std::string& tenant = "") {
    std::string id = create(tenant).id;
    EXPECT_TRUE(store_->cancel(id));
    return id;
  }
  std::string failed_job() {
    std::string id = create().id;
    const Claim claim = store_->claim(Millis(60'000), {}).value().value();
    EXPECT_EQ(store_->fail(claim.ref, {{"unknown_format", "It is no glTF.", "a.glb"}, 422}).value(), Wrote::done);
    return id;
  }

  std::filesystem::path folder_;
  std::unique_ptr<JobStore> store_;
  std::unique_ptr<Webhooks> webhooks_;
  int keys_ = 0;
};

std::string job_of(const ReceivedMessage& message) { return nlohmann::json::parse(message.body)["data"]["id"]; }

TEST(WebhookSignature, IsThatOfTheSpecificationsExample) {
  const auto key = read_webhook_secret(kSecret).value();
  EXPECT_EQ(webhook_signature(key, {"msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, R"({"test": 2432232314})"}),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(WebhookSignature, WantsASecretOfItsForm) {
  for (const char* text :
       {"", "whsec_", "whsec_MfKQ", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_MfKQ9r8GKYqrTwjUPD8ILP!!o2LaLaSw"})
    EXPECT_FALSE(read_webhook_secret(text)) << text;
}

TEST(WebhookPause, GrowsThreefoldUpToAnHourAndIsSpread) {
  const WebhookOptions options;
  EXPECT_EQ(webhook_pause(options, 1, 0.5), 5s);
  EXPECT_EQ(webhook_pause(options, 3, 0.5), 45s);
  EXPECT_EQ(webhook_pause(options, 1, 0.0), 3750ms);
  EXPECT_LT(webhook_pause(options, 1, 0.999), 6250ms);
  EXPECT_EQ(webhook_pause(options, 1000, 0.5), 1h);
}

TEST_F(WebhooksTest, AReceiverVerifiesWhatItHearsOfAJobThatFailed) {
  WebhookReceiver receiver;
  start(options({receiver.url()}));
  const std::string id = failed_job();
  ASSERT_TRUE(receiver.wait_for(1));
  const ReceivedMessage message = receiver.messages().front();
  const auto key = read_webhook_secret(kSecret).value();
  EXPECT_EQ(message.signature, webhook_signature(key, {message.id, std::stoll(message.timestamp), message.body}));
  const auto now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch());
  EXPECT_NEAR(std::stod(message.timestamp), static_cast<double>(now.count()), 30);
  const auto json = nlohmann::json::parse(message.body);
  EXPECT_EQ(json["type"], "job.failed");
  EXPECT_EQ(json["data"]["id"], id);
  EXPECT_EQ(json["data"]["label"], "night");
  EXPECT_EQ(json["data"]["error"]["code"], "unknown_format");
}

TEST_F(WebhooksTest, WhatFailsComesAgainWithTheSameIdAndBody) {
  WebhookReceiver receiver;
  receiver.fail(503, 2);
  start(options({receiver.url()}));
  canceled_job();
  ASSERT_TRUE(receiver.wait_for(3));
  std::this_thread::sleep_for(300ms);  // longer than the next pause: nothing comes after a success
  const auto messages = receiver.messages();
  ASSERT_EQ(messages.size(), 3U);
  for (const ReceivedMessage& message : messages) {
    EXPECT_EQ(message.id, messages[0].id);
    EXPECT_EQ(message.body, messages[0].body);
  }
  const WebhookCounts counts = webhooks_->counts();
  EXPECT_EQ(std::tuple(counts.delivered, counts.retried, counts.failed), std::tuple(1U, 2U, 0U));
  EXPECT_EQ(store_->counts()->deliveries, 0U);
}

TEST_F(WebhooksTest, ARestartGoesOnWithWhatWasNotDelivered) {
  WebhookReceiver receiver;
  receiver.fail(500, 1000);
  const std::string waiting = canceled_job();
  start(options({receiver.url()}));
  ASSERT_TRUE(receiver.wait_for(1));
  EXPECT_EQ(store_->counts()->deliveries, 1U);
  webhooks_.reset();
  store_.reset();
  open();
  const std::string ended_meanwhile = canceled_job();
  receiver.fail(0, 0);
  const std::size_t before = receiver.messages().size();
  start(options({receiver.url()}));
  ASSERT_TRUE(receiver.wait_for(before + 2));
  std::set<std::string> told;
  const auto messages = receiver.messages();
  for (std::size_t i = before; i < messages.size(); ++i) told.insert(job_of(messages[i]));
  EXPECT_EQ(told, (std::set<std::string>{waiting, ended_meanwhile}));
}

TEST_F(WebhooksTest, OneThatHangsHoldsUpNobodyAndNoStop) {
  WebhookReceiver stuck, sound;
  stuck.hang();
  WebhookOptions patient = options({stuck.url(), sound.url()});
  patient.timeout = Millis(60'000);
  start(patient);
  for (int i = 0; i < 5; ++i) canceled_job();
  EXPECT_TRUE(sound.wait_for(5));
  const auto begin = Clock::now();
  webhooks_.reset();
  EXPECT_LT(Clock::now() - begin, 5s);  // curl looks once a second whether to go on
}

TEST_F(WebhooksTest, AnAnswerThatTakesTooLongIsNone) {
  WebhookReceiver stuck;
  stuck.hang();
  WebhookPost post{stuck.url(), {}, "{}", true};
  post.timeout = Millis(300);
  const auto begin = Clock::now();
  EXPECT_EQ(post_webhook(post), 0);
  EXPECT_LT(Clock::now() - begin, 5s);
}

TEST(WebhookPost, DoesNotWaitForANameServerThatIsSilent) {
  WebhookPost post{"https://silent.test/", {}, "{}"};
  post.timeout = Millis(300);
  const auto begin = Clock::now();
  EXPECT_EQ(post_webhook(post), 0);
  EXPECT_LT(Clock::now() - begin, 5s) << "it is silent for eight";
}

TEST_F(WebhooksTest, RedirectsAreNotFollowed) {
  WebhookReceiver receiver;
  receiver.fail(307, 1000);
  EXPECT_EQ(post_webhook({receiver.url(), {}, "{}", true}), 307);
  ASSERT_EQ(receiver.messages().size(), 1U);
  EXPECT_NE(receiver.messages().front().id, "redirected");
}

TEST_F(WebhooksTest, GoneIsTheEndOfAMessageAndADayIsTooLong) {
  WebhookReceiver gone, dead;
  gone.fail(410, 1000);
  dead.fail(500, 1000);
  WebhookOptions short_lived = options({gone.url(), dead.url()});
  short_lived.longest = Millis(1000);
  start(short_lived);
  canceled_job();
  ASSERT_TRUE(dead.wait_for(2));
  std::this_thread::sleep_for(2s);
  const std::size_t tries = dead.messages().size();
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(dead.messages().size(), tries);
  EXPECT_EQ(gone.messages().size(), 1U);
  EXPECT_EQ(webhooks_->counts().failed, 2U);
  EXPECT_EQ(webhooks_->counts().delivered, 0U);
}

TEST_F(WebhooksTest, ATenantsReceiverHearsOfItsJobsAlone) {
  WebhookReceiver ours, all;
  WebhookOptions tenants = options({ours.url(), all.url()});
  tenants.receivers.front().tenant = "studio";
  start(tenants);
  canceled_job("other");
  const std::string id = canceled_job("studio");
  ASSERT_TRUE(all.wait_for(2));
  ASSERT_TRUE(ours.wait_for(1));
  EXPECT_EQ(ours.messages().size(), 1U);
  EXPECT_EQ(job_of(ours.messages().front()), id);
}

TEST_F(WebhooksTest, TwoServersOfAFleetTellOnce) {
  WebhookReceiver receiver;
  Webhooks other(*store_, options({receiver.url()}));
  other.start();
  start(options({receiver.url()}));
  for (int i = 0; i < 20; ++i) canceled_job();
  ASSERT_TRUE(receiver.wait_for(20));
  std::this_thread::sleep_for(200ms);
  std::set<std::string> told;
  for (const ReceivedMessage& message : receiver.messages()) told.insert(job_of(message));
  EXPECT_EQ(told.size(), 20U);
  EXPECT_EQ(receiver.messages().size(), 20U);
}

/// Whether anybody connects to a port of ours while `work` is done.
class Doorman {
 public:
  Doorman() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~Doorman() { ::close(listener_); }
  int port() const { return port_; }
  bool somebody_came() {
    const int guest = ::accept(listener_, nullptr, nullptr);
    if (guest >= 0) ::close(guest);
    return guest >= 0;
  }

 private:
  int listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  int port_ = 0;
};

TEST(WebhookPost, ConnectsToNoAddressThatIsNotPublicWhateverItsName) {
  Doorman door;
  for (const std::string host : {"127.0.0.1", "localhost", "127.1", "0x7f000001", "[::ffff:127.0.0.1]"}) {
    WebhookPost post{"https://" + host + ":" + std::to_string(door.port()) + "/", {}, "{}", false};
    post.timeout = Millis(500);
    EXPECT_EQ(post_webhook(post), 0);
    EXPECT_FALSE(door.somebody_came()) << host;
    post.private_too = true;
    EXPECT_EQ(post_webhook(post), 0) << "nobody speaks TLS there";
    EXPECT_TRUE(door.somebody_came()) << host << ": the way was open, if it had been allowed";
  }
}

TEST(WebhookPost, SpeaksTlsAlone) {
  const WebhookReceiver receiver;
  EXPECT_EQ(post_webhook({receiver.url(), {}, "{}", false}), 0);
  EXPECT_TRUE(receiver.messages().empty());
  EXPECT_EQ(post_webhook({receiver.url(), {}, "{}", true}), 204);
}

class WebhookFile : public ::testing::Test {
 protected:
  Result<std::vector<kiln::WebhookReceiver>> read(const std::string& text, bool private_too = false) {
    const auto file = std::filesystem::temp_directory_path() / ("kiln_hooks." + std::to_string(::getpid()));
    std::ofstream(file) << text;
    auto read = read_webhook_receivers(file, private_too);
    std::filesystem::remove(file);
    return read;
  }
  const std::string secret_ = kSecret;
};

TEST_F(WebhookFile, NamesReceiversSecretsAndTenants) {
  const auto read_file =
      read("# ours\n\nhttps://a.example/x?y " + secret_ + "\nhttps://b.example " + secret_ + " tenant=studio\r\n");
  ASSERT_TRUE(read_file) << read_file.error().message;
  ASSERT_EQ(read_file->size(), 2U);
  EXPECT_FALSE((*read_file)[0].tenant);
  EXPECT_EQ((*read_file)[1].url, "https://b.example");
  EXPECT_EQ((*read_file)[1].tenant, "studio");
  EXPECT_EQ((*read_file)[1].key.size(), 24U);
}

TEST_F(WebhookFile, IsRefusedByLine) {
  for (const std::string& line : std::vector<std::string>{
           "https://a.example", "http://a.example " + secret_, "ftp://a.example " + secret_, "https:// " + secret_,
           "https://user@a.example " + secret_, "https://a.example whsec_x", "https://a.example " + secret_ + " for=x",
           "https://a.example " + secret_ + " tenant=", "https://a.example " + secret_ + " tenant=a more",
           "https://a.example " + secret_ + "\nhttps://a.example " + secret_, ""}) {
    const auto refused = read(line + "\n");
    ASSERT_FALSE(refused) << line;
    EXPECT_EQ(refused.error().code, "bad_webhook_file");
    EXPECT_EQ(refused.error().message.find(secret_), std::string::npos) << "no secret in an error";
  }
  EXPECT_TRUE(read("http://127.0.0.1:1/x " + secret_, true));
}

}  // namespace
}  // namespace kiln::testing
