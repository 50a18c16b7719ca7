// The conformance suite on PostgreSQL, and what only this engine promises: many programs, faults of the server.

#include "server/jobs/postgres_store.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>

#include "tests/fixtures/postgres_server.h"
#include "tests/fixtures/statement_cutter.h"
#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// One server for the whole program, made when first asked for.
PostgresServer& server() {
  static const std::unique_ptr<PostgresServer> one = std::make_unique<PostgresServer>();
  return *one;
}

std::unique_ptr<JobStore> open_postgres_on(const std::filesystem::path&, TestClock& clock) {
  return open_postgres_store({server().address(), [&clock] { return clock.now_ms; }}).value();
}

void drop_tables() { ASSERT_TRUE(server().run("DROP SCHEMA IF EXISTS kiln CASCADE")); }

Engine postgres() { return {"postgres", open_postgres_on, drop_tables}; }

}  // namespace

INSTANTIATE_TEST_SUITE_P(PostgreSQL, StoreConformance, ::testing::Values(postgres()), engine_name);
INSTANTIATE_TEST_SUITE_P(PostgreSQL, StoreDeliveries, ::testing::Values(postgres()), engine_name);
INSTANTIATE_TEST_SUITE_P(PostgreSQL, StoreClaims, ::testing::Values(postgres()), engine_name);

namespace {

const std::string kScene(64, 'a');

NewJob new_job(int number) {
  NewJob job;
  job.inputs.scene = {"scene.glb", kScene};
  job.recipe = "{}";
  job.content_key = "key" + std::to_string(number);
  job.request_hash = "hash";
  return job;
}

class PostgresStoreTest : public ::testing::Test {
 protected:
  PostgresStoreTest() {
    drop_tables();
    store_ = open();
    EXPECT_TRUE(store_->touch_blob(kScene, 1));
  }
  static std::unique_ptr<JobStore> open() { return open_postgres_store({server().address(), {}}).value(); }
  /// Until it works again, or 20 s.
  bool recovers() {
    const auto deadline = Clock::now() + 20s;
    while (Clock::now() < deadline) {
      if (store_->check_writable()) return true;
      std::this_thread::sleep_for(50ms);
    }
    return false;
  }
  std::unique_ptr<JobStore> store_;
};

TEST_F(PostgresStoreTest, TheClockIsTheDatabases) {
  const Job job = store_->create(new_job(0)).value().job;
  const auto here = std::chrono::duration_cast<Millis>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_LT(std::abs(job.created_ms - here), 10'000);
  const Claim claim = store_->claim(Millis(200), {}).value().value();
  EXPECT_EQ(store_->reap().value(), 0);
  std::this_thread::sleep_for(250ms);
  EXPECT_EQ(store_->reap().value(), 1);
  EXPECT_EQ(store_->heartbeat(claim.ref, Millis(200), {}).value(), Beat::lost);
}

TEST_F(PostgresStoreTest, ManyProgramsNeverClaimTheSameJob) {
  constexpr int kJobs = 60;
  for (int i = 0; i < kJobs; ++i) EXPECT_TRUE(store_->create(new_job(i)));
  std::mutex mutex;
  std::multiset<std::string> claimed;
  std::vector<std::thread> programs;
  for (int i = 0; i < 3; ++i) {
    programs.emplace_back([&] {
      const auto own = open();
      // One that finds all due rows held by others sees none: it looks again, as a supervisor does.
      for (int idle = 0; idle < 20;) {
        const auto claim = own->claim(60s, {}).value();
        if (!claim) {
          ++idle;
          std::this_thread::sleep_for(5ms);
          continue;
        }
        const std::lock_guard lock(mutex);
        claimed.insert(claim->ref.job_id);
      }
    });
  }
  for (std::thread& program : programs) program.join();
  EXPECT_EQ(claimed.size(), static_cast<std::size_t>(kJobs));
  EXPECT_EQ(std::set(claimed.begin(), claimed.end()).size(), static_cast<std::size_t>(kJobs));
}

TEST_F(PostgresStoreTest, TheSameKeyFromManyProgramsAtOnceMakesOneJob) {
  NewJob asked = new_job(0);
  asked.idempotency_key = "once";
  std::mutex mutex;
  std::set<std::string> ids;
  std::vector<std::thread> programs;
  for (int i = 0; i < 6; ++i) {
    programs.emplace_back([&] {
      const std::string id = open()->create(asked).value().job.id;
      const std::lock_guard lock(mutex);
      ids.insert(id);
    });
  }
  for (std::thread& program : programs) program.join();
  EXPECT_EQ(ids.size(), 1U);
  EXPECT_EQ(store_->counts()->queued, 1U);
}

TEST_F(PostgresStoreTest, AWriteOfOneProgramWakesAnother) {
  std::atomic<int> woken{0};
  const auto other = open();
  other->on_change([&] { ++woken; });
  const auto until = [&](int least) {
    for (int i = 0; i < 500 && woken < least; ++i) std::this_thread::sleep_for(10ms);
    return woken >= least;
  };
  ASSERT_TRUE(until(1)) << "once when it starts to listen";
  const int before = woken;
  EXPECT_TRUE(store_->create(new_job(1)));
  EXPECT_TRUE(until(before + 1));
}

TEST_F(PostgresStoreTest, ARestartOfTheServerLosesNothingAndNeedsNobody) {
  const std::string id = store_->create(new_job(1)).value().job.id;
  const Claim claim = store_->claim(60s, {}).value().value();
  server().stop();
  const auto failed = store_->get(id);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, "store_unavailable");
  server().start();
  EXPECT_TRUE(recovers());
  EXPECT_EQ(store_->commit(claim.ref, std::vector{Artifact{"scene.glb", "x", std::string(64, 'e'), 1}}, false).value(),
            Wrote::done);
  EXPECT_EQ(store_->get(id)->state, JobState::succeeded);
}

TEST_F(PostgresStoreTest, AKilledServerKeepsWhatItAcknowledged) {
  std::vector<std::string> ids;
  for (int i = 0; i < 10; ++i) ids.push_back(store_->create(new_job(i)).value().job.id);
  server().kill_hard();
  server().start();
  EXPECT_TRUE(recovers());
  for (const std::string& id : ids) EXPECT_TRUE(store_->get(id)) << id;
}

TEST_F(PostgresStoreTest, AConnectionThatWasCutWhileItLayIdleIsReplacedAtOnce) {
  EXPECT_TRUE(store_->create(new_job(1)));
  ASSERT_TRUE(server().run("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name='kilnd'"));
  EXPECT_TRUE(store_->create(new_job(2)));
}

TEST_F(PostgresStoreTest, CutsInTheMiddleOfManyWritesLoseNoAcknowledgedJob) {
  std::atomic<bool> over{false};
  std::thread cutter([&] {
    for (int cut = 0; !over; ++cut) {
      server().run("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name='kilnd'");
      std::this_thread::sleep_for(Millis(20 + cut * 7 % 40));  // now here, now there in a write of some 10 ms
    }
  });
  std::vector<std::string> acknowledged;
  int refused = 0;
  const auto deadline = Clock::now() + 30s;
  while (acknowledged.size() < 60 && Clock::now() < deadline) {
    const auto created = store_->create(new_job(static_cast<int>(acknowledged.size()) + refused));
    if (created) {
      acknowledged.push_back(created->job.id);
    } else {
      ++refused;
      EXPECT_EQ(created.error().code, "store_unavailable");
      std::this_thread::sleep_for(5ms);
    }
  }
  over = true;
  cutter.join();
  EXPECT_TRUE(recovers());
  for (const std::string& id : acknowledged) EXPECT_TRUE(store_->get(id)) << id;
  EXPECT_EQ(acknowledged.size(), 60U);
  std::printf("{\"acknowledged\":%zu,\"refused\":%d}\n", acknowledged.size(), refused);
}

/// Asks for a job as a client does, until it is acknowledged.
std::string create_patiently(JobStore& store, NewJob job) {
  job.idempotency_key = job.content_key;
  for (int attempt = 0; attempt < 10; ++attempt) {
    const auto created = store.create(job);
    if (created) return created->job.id;
    std::this_thread::sleep_for(100ms);  // who could not connect is not asked again sooner
  }
  return {};
}

/// Works as a server does until the job has ended; a claim whose answer was lost comes back when its lease is over.
/// Returns how many commits were acknowledged.
int work_patiently(JobStore& store, const std::string& id, TestClock& clock) {
  int acknowledged = 0;
  for (int attempt = 0; attempt < 10; ++attempt) {
    clock.now_ms += 120'000;
    const auto job = store.get(id);
    if (job && is_terminal(job->state)) break;
    static_cast<void>(store.reap());
    const auto claim = store.claim(60s, {});
    if (!claim || !*claim) continue;
    static_cast<void>(store.heartbeat((*claim)->ref, 60s, JobProgress{"bake", 1, 2, .5, {}}));
    const auto wrote =
        store.commit((*claim)->ref, std::vector{Artifact{"scene.glb", "x", std::string(64, 'e'), 1}}, false);
    acknowledged += wrote && *wrote == Wrote::done ? 1 : 0;
  }
  return acknowledged;
}

TEST_F(PostgresStoreTest, ACutInEveryStatementOfAJobsLifeLosesAndDoublesNothing) {
  StatementCutter proxy(server().folder(), PostgresServer::kPort);
  TestClock clock;
  const auto cut =
      open_postgres_store({PostgresServer::address(proxy.folder()), [&clock] { return clock.now_ms; }}).value();
  int jobs = 0;
  for (const Cut how : {Cut::before, Cut::after}) {
    for (int statement = 0; proxy.has_cut() || statement == 0; ++statement) {
      SCOPED_TRACE((how == Cut::before ? "before statement " : "after statement ") + std::to_string(statement));
      proxy.cut(how, statement);
      const std::string id = create_patiently(*cut, new_job(jobs++));
      ASSERT_TRUE(store_->get(id));
      const int acknowledged = work_patiently(*cut, id, clock);
      const Job job = store_->get(id).value();
      ASSERT_EQ(job.state, JobState::succeeded);
      EXPECT_EQ(job.artifacts.size(), 1U);
      EXPECT_LE(acknowledged, 1);
      EXPECT_LE(job.attempt, 2);
      const auto events = store_->events_after(0, id, 100).value();
      EXPECT_EQ(std::ranges::count(events, EventKind::done, &JobEvent::kind), 1);
      EXPECT_EQ(store_->counts()->succeeded, static_cast<std::uint64_t>(jobs));
      ASSERT_LT(statement, 100);
    }
  }
  std::printf("{\"cuts\":%d}\n", jobs - 2);
}

TEST_F(PostgresStoreTest, AServerThatStallsForTenSecondsIsWaitedFor) {
  server().freeze();
  std::thread later([] {
    std::this_thread::sleep_for(10s);
    server().thaw();
  });
  EXPECT_TRUE(store_->create(new_job(1)));
  later.join();
}

TEST_F(PostgresStoreTest, AServerThatMayForgetIsRefused) {
  ASSERT_TRUE(server().run("ALTER ROLE bake SET synchronous_commit=off"));
  const auto opened = open_postgres_store({server().address(), {}});
  server().run("ALTER ROLE bake RESET synchronous_commit");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, "store_unsafe");
}

TEST_F(PostgresStoreTest, ASchemaOfVersionOneIsBroughtToTheNextWithAllItHolds) {
  const std::string id = store_->create(new_job(1)).value().job.id;
  ASSERT_TRUE(server().run("DROP TABLE kiln.upload_day"));
  for (const char* column : {"pinned", "memory_mb", "parent", "part_order", "maker", "journal"})
    ASSERT_TRUE(server().run(std::string("ALTER TABLE kiln.job DROP COLUMN ") + column));
  ASSERT_TRUE(server().run("ALTER TABLE kiln.blob_tenant DROP COLUMN pinned"));
  ASSERT_TRUE(server().run("UPDATE kiln.meta SET version=1"));
  const auto store = open_postgres_store({server().address(), {}}).value();
  EXPECT_TRUE(store->pin(id, true)->pinned);
  EXPECT_TRUE(store->charge_upload("studio", 1, 1));
}

TEST_F(PostgresStoreTest, ASchemaOfANewerProgramIsRefused) {
  ASSERT_TRUE(server().run("UPDATE kiln.meta SET version=999"));
  EXPECT_EQ(open_postgres_store({server().address(), {}}).error().code, "schema_too_new");
}

TEST_F(PostgresStoreTest, TheDatabaseItselfRefusesWhatMayNeverHappen) {
  const std::string id = store_->create(new_job(1)).value().job.id;
  EXPECT_FALSE(server().run("UPDATE kiln.job SET state='running'")) << "running without an owner";
  EXPECT_TRUE(store_->cancel(id));
  EXPECT_FALSE(server().run("UPDATE kiln.job SET state='queued', finished_at=NULL"));
  EXPECT_FALSE(server().run("UPDATE kiln.job_event SET message='nothing happened'"));
}

TEST(PostgresAddress, APasswordInItIsSeen) {
  EXPECT_TRUE(has_password("postgresql://kiln:secret@db/kiln"));
  EXPECT_TRUE(has_password("host=db password=secret"));
  EXPECT_FALSE(has_password("postgresql://kiln@db/kiln"));
  EXPECT_EQ(open_postgres_store({"host=/nonexistent", {}}).error().code, "store_unavailable");
}

}  // namespace
}  // namespace kiln::testing

int main(int argc, char** argv) {
  if (kiln::testing::postgres_programs().empty()) {
    std::puts("skipped: the package postgresql-15 is not installed");
    return 77;
  }
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
