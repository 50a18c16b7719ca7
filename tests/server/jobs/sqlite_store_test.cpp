// What only the embedded engine promises: its settings, its checks, its refusals.

#include "server/jobs/sqlite_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <fstream>

#include "tests/server/jobs/store_conformance.h"

namespace kiln {

namespace testing {
INSTANTIATE_TEST_SUITE_P(SQLite, StoreConformance, ::testing::Values(Engine{"sqlite", open_sqlite_on}), engine_name);
INSTANTIATE_TEST_SUITE_P(SQLite, StoreDeliveries, ::testing::Values(Engine{"sqlite", open_sqlite_on}), engine_name);
INSTANTIATE_TEST_SUITE_P(SQLite, StoreClaims, ::testing::Values(Engine{"sqlite", open_sqlite_on}), engine_name);
}  // namespace testing

namespace {

class SqliteStoreTest : public ::testing::Test {
 protected:
  SqliteStoreTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_sqlite.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~SqliteStoreTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file() const { return folder_ / "kiln.db"; }
  /// Runs a statement on a connection of its own; SQLite's result code.
  int run(const std::string& statement) const {
    sqlite3* db = nullptr;
    sqlite3_open(file().c_str(), &db);
    const int code = sqlite3_exec(db, statement.c_str(), nullptr, nullptr, nullptr);
    sqlite3_close(db);
    return code;
  }
  std::filesystem::path folder_;
};

Job queued_job(JobStore& store, const std::string& recipe) {
  EXPECT_TRUE(store.touch_blob(std::string(64, 'a'), 1));
  NewJob job;
  job.inputs.scene = {"scene.glb", std::string(64, 'a')};
  job.content_key = "key";
  job.recipe = recipe;
  return store.create(job).value().job;
}

Job finished_job(JobStore& store) { return store.cancel(queued_job(store, "{}").id).value(); }

TEST_F(SqliteStoreTest, TheLogIsWrittenAhead) {
  const auto store = open_sqlite_store({file(), {}}).value();
  EXPECT_TRUE(store->check_writable());
  EXPECT_TRUE(std::filesystem::exists(folder_ / "kiln.db-wal"));
}

TEST_F(SqliteStoreTest, ADatabaseOfANewerProgramIsRefused) {
  open_sqlite_store({file(), {}}).value();
  ASSERT_EQ(run("PRAGMA user_version=999"), SQLITE_OK);
  EXPECT_EQ(open_sqlite_store({file(), {}}).error().code, "schema_too_new");
}

/// Takes away what version 4 brought.
const std::string kToVersionThree =
    "DROP INDEX job_by_parent; DROP INDEX job_by_journal; ALTER TABLE job DROP COLUMN memory_mb; ALTER TABLE job DROP "
    "COLUMN parent; ALTER TABLE job DROP COLUMN part_order; ALTER TABLE job DROP COLUMN maker; ALTER TABLE job DROP "
    "COLUMN journal; PRAGMA user_version=3;";

TEST_F(SqliteStoreTest, ADatabaseOfVersionThreeIsBroughtToTheNextWithAllItHolds) {
  std::string id;
  {
    const auto store = open_sqlite_store({file(), {}}).value();
    id = finished_job(*store).id;
    queued_job(*store, R"({"limits":{"memory_mb":512}})");
  }
  ASSERT_EQ(run(kToVersionThree), SQLITE_OK);
  const auto store = open_sqlite_store({file(), {}}).value();
  EXPECT_EQ(store->claim(Millis(60'000), {}).value()->job.memory_mb, 512U) << "that it declared before anybody asked";
  EXPECT_EQ(store->get(id)->state, JobState::canceled);
  EXPECT_FALSE(store->get(id)->part);
  EXPECT_TRUE(store->parts(id).value().empty());
}

TEST_F(SqliteStoreTest, ADatabaseOfVersionOneIsBroughtToTheNextWithAllItHolds) {
  std::string id;
  {
    const auto store = open_sqlite_store({file(), {}}).value();
    id = finished_job(*store).id;
  }
  // Back to how version 1 was.
  ASSERT_EQ(run(kToVersionThree +
                "DROP TABLE upload_day; ALTER TABLE job DROP COLUMN pinned;"
                "DROP TABLE blob_tenant; DROP TABLE identity; DROP INDEX job_by_tenant; DROP INDEX job_running;"
                "ALTER TABLE job DROP COLUMN tenant; CREATE INDEX job_running ON job(id) WHERE state='running';"
                "PRAGMA user_version=1"),
            SQLITE_OK);
  const auto store = open_sqlite_store({file(), {}}).value();
  EXPECT_EQ(store->get(id)->state, JobState::canceled);
  EXPECT_EQ(store->get(id)->tenant, "");
  EXPECT_TRUE(store->knows_blob(std::string(64, 'a'), "").value());
}

TEST_F(SqliteStoreTest, ADatabaseOfVersionTwoIsBroughtToTheNextWithAllItHolds) {
  std::string id;
  {
    const auto store = open_sqlite_store({file(), {}}).value();
    id = finished_job(*store).id;
  }
  ASSERT_EQ(run(kToVersionThree +
                "DROP TABLE upload_day; ALTER TABLE job DROP COLUMN pinned; ALTER TABLE blob_tenant DROP COLUMN pinned;"
                "PRAGMA user_version=2"),
            SQLITE_OK);
  const auto store = open_sqlite_store({file(), {}}).value();
  EXPECT_FALSE(store->get(id)->pinned);
  EXPECT_TRUE(store->pin(id, true)->pinned);
  EXPECT_TRUE(store->pin_blob(std::string(64, 'a'), "", true));
}

TEST_F(SqliteStoreTest, AFileThatIsNoDatabaseIsRefused) {
  std::ofstream(file()) << std::string(8192, 'x');
  EXPECT_FALSE(open_sqlite_store({file(), {}}));
}

TEST_F(SqliteStoreTest, TheDatabaseItselfRefusesToChangeATerminalState) {
  const auto store = open_sqlite_store({file(), {}}).value();
  finished_job(*store);
  EXPECT_EQ(run("UPDATE job SET state='queued', finished_at=NULL"), SQLITE_CONSTRAINT);
}

TEST_F(SqliteStoreTest, TheDatabaseItselfRefusesARunningJobWithoutAnOwner) {
  const auto store = open_sqlite_store({file(), {}}).value();
  finished_job(*store);
  EXPECT_EQ(run("INSERT INTO job(id, state, label, recipe, content_key, force, created_at, run_after, request_hash) "
                "VALUES('01ARZ3NDEKTSV4RRFFQ69G5FAV', 'running', '', '', '', 0, 0, 0, '')"),
            SQLITE_CONSTRAINT);
}

TEST_F(SqliteStoreTest, TheDatabaseItselfRefusesToRewriteEvents) {
  const auto store = open_sqlite_store({file(), {}}).value();
  finished_job(*store);
  EXPECT_EQ(run("UPDATE job_event SET message='nothing happened'"), SQLITE_CONSTRAINT);
}

}  // namespace
}  // namespace kiln
