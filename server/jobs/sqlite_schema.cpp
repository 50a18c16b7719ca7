#include "server/jobs/sqlite_schema.h"

#include <sys/vfs.h>

#include <array>
#include <span>

namespace kiln::sql {
namespace {

constexpr const char* kTables = R"sql(
CREATE TABLE job(
  id TEXT PRIMARY KEY CHECK(length(id) = 26),
  state TEXT NOT NULL CHECK(state IN ('queued', 'running', 'succeeded', 'failed', 'canceled')),
  label TEXT NOT NULL,
  recipe TEXT NOT NULL,
  content_key TEXT NOT NULL,
  force INTEGER NOT NULL CHECK(force IN (0, 1)),
  cached INTEGER NOT NULL DEFAULT 0 CHECK(cached IN (0, 1)),
  attempt INTEGER NOT NULL DEFAULT 0 CHECK(attempt >= 0),
  crashes INTEGER NOT NULL DEFAULT 0,
  retries INTEGER NOT NULL DEFAULT 0,
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  finished_at INTEGER,
  run_after INTEGER NOT NULL,
  cancel_requested_at INTEGER,
  lease_owner TEXT,
  lease_until INTEGER,
  fence INTEGER NOT NULL DEFAULT 0,
  version INTEGER NOT NULL DEFAULT 0,
  stage TEXT, done INTEGER, total INTEGER, fraction REAL, eta_s REAL,
  error_code TEXT, error_message TEXT, error_where TEXT, error_status INTEGER,
  idempotency_key TEXT UNIQUE,
  request_hash TEXT NOT NULL,
  CHECK((finished_at IS NOT NULL) = (state IN ('succeeded', 'failed', 'canceled'))),
  CHECK((lease_owner IS NOT NULL) = (state = 'running')),
  CHECK((lease_until IS NOT NULL) = (state = 'running')),
  CHECK((error_code IS NOT NULL) = (state = 'failed'))
) STRICT;
CREATE INDEX job_by_age ON job(created_at, id);
CREATE INDEX job_by_state ON job(state, created_at, id);
CREATE INDEX job_by_label ON job(label, created_at, id);
CREATE INDEX job_queued ON job(id) WHERE state = 'queued';
CREATE INDEX job_running ON job(id) WHERE state = 'running';
CREATE INDEX job_by_content ON job(content_key, finished_at) WHERE finished_at IS NOT NULL;

CREATE TABLE blob(
  sha256 TEXT PRIMARY KEY CHECK(length(sha256) = 64),
  bytes INTEGER NOT NULL CHECK(bytes >= 0),
  last_ref_at INTEGER NOT NULL
) STRICT;

CREATE TABLE job_input(
  job_id TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  role TEXT NOT NULL CHECK(role IN ('scene', 'resource', 'environment')),
  name TEXT NOT NULL,
  sha256 TEXT NOT NULL REFERENCES blob(sha256),
  PRIMARY KEY(job_id, role, name)
) STRICT;
CREATE INDEX job_input_by_blob ON job_input(sha256);

CREATE TABLE artifact(
  job_id TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  media_type TEXT NOT NULL,
  sha256 TEXT NOT NULL REFERENCES blob(sha256),
  bytes INTEGER NOT NULL CHECK(bytes >= 0),
  fence INTEGER NOT NULL,
  PRIMARY KEY(job_id, name)
) STRICT;
CREATE INDEX artifact_by_blob ON artifact(sha256);

CREATE TABLE job_event(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  job_id TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  at INTEGER NOT NULL,
  kind TEXT NOT NULL CHECK(kind IN ('state', 'log', 'artifact', 'done')),
  state TEXT NOT NULL,
  message TEXT NOT NULL
) STRICT;
CREATE INDEX job_event_by_job ON job_event(job_id, id);

-- One row each: the last fence given out, and a place to try whether writing works.
CREATE TABLE counter(name TEXT PRIMARY KEY, value INTEGER NOT NULL) STRICT;
INSERT INTO counter VALUES('fence', 0), ('ready', 0);

CREATE TRIGGER job_terminal_is_final BEFORE UPDATE OF state ON job
  WHEN OLD.finished_at IS NOT NULL BEGIN SELECT RAISE(ABORT, 'terminal states never change'); END;
CREATE TRIGGER job_event_is_append_only BEFORE UPDATE ON job_event
  BEGIN SELECT RAISE(ABORT, 'events are append-only'); END;
)sql";

// From version 1 to 2: tenants (what was there belongs to the one without a name), and who this store is.
constexpr const char* kVersion2 = R"sql(
ALTER TABLE job ADD COLUMN tenant TEXT NOT NULL DEFAULT '';
CREATE INDEX job_by_tenant ON job(tenant, created_at, id);
DROP INDEX job_running;
CREATE INDEX job_running ON job(tenant) WHERE state = 'running';
-- Who brought the blob or baked it: others cannot tell that it is there.
CREATE TABLE blob_tenant(
  sha256 TEXT NOT NULL REFERENCES blob(sha256) ON DELETE CASCADE,
  tenant TEXT NOT NULL,
  PRIMARY KEY(sha256, tenant)
) STRICT;
INSERT INTO blob_tenant SELECT sha256, '' FROM blob;
CREATE TABLE identity(id TEXT NOT NULL) STRICT;
INSERT INTO identity SELECT lower(hex(randomblob(16)));
)sql";

// From version 2 to 3: pins, and how much a tenant uploads a day.
constexpr const char* kVersion3 = R"sql(
ALTER TABLE job ADD COLUMN pinned INTEGER NOT NULL DEFAULT 0 CHECK(pinned IN (0, 1));
ALTER TABLE blob_tenant ADD COLUMN pinned INTEGER NOT NULL DEFAULT 0 CHECK(pinned IN (0, 1));
CREATE TABLE upload_day(
  tenant TEXT NOT NULL,
  day INTEGER NOT NULL, -- since 1970
  bytes INTEGER NOT NULL CHECK(bytes >= 0),
  PRIMARY KEY(tenant, day)
) STRICT;
)sql";

// From version 3 to 4: parts of jobs, and how much memory a job may use.
constexpr const char* kVersion4 = R"sql(
ALTER TABLE job ADD COLUMN memory_mb INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job ADD COLUMN parent TEXT REFERENCES job(id) ON DELETE CASCADE;
ALTER TABLE job ADD COLUMN part_order TEXT;
ALTER TABLE job ADD COLUMN maker TEXT;
ALTER TABLE job ADD COLUMN journal TEXT REFERENCES blob(sha256);
CREATE INDEX job_by_parent ON job(parent, id) WHERE parent IS NOT NULL;
CREATE INDEX job_by_journal ON job(journal) WHERE journal IS NOT NULL;
UPDATE job SET memory_mb=coalesce(json_extract(recipe, '$.limits.memory_mb'), 0) WHERE state IN ('queued', 'running');
)sql";

// A table that older programs need not know, so it comes without a new version.
constexpr const char* kDeliveries = R"sql(
CREATE TABLE IF NOT EXISTS delivery(
  message TEXT NOT NULL,
  receiver TEXT NOT NULL,
  body TEXT NOT NULL,
  attempt INTEGER NOT NULL DEFAULT 0,
  created_at INTEGER NOT NULL,
  due_at INTEGER NOT NULL,
  PRIMARY KEY(message, receiver)
) STRICT;
CREATE INDEX IF NOT EXISTS delivery_by_due ON delivery(receiver, due_at, message);
)sql";

struct Setting {
  const char* set;
  const char* read;
  const char* expected;
};

// reliability.md 5.3. FULL: NORMAL may lose the last commits at power loss.
constexpr std::array kWriterSettings{
    Setting{"PRAGMA journal_mode=WAL", "PRAGMA journal_mode", "wal"},
    Setting{"PRAGMA synchronous=FULL", "PRAGMA synchronous", "2"},
    Setting{"PRAGMA foreign_keys=ON", "PRAGMA foreign_keys", "1"},
    Setting{"PRAGMA busy_timeout=5000", "PRAGMA busy_timeout", "5000"},
    Setting{"PRAGMA trusted_schema=OFF", "PRAGMA trusted_schema", "0"},
    Setting{"PRAGMA mmap_size=0", "PRAGMA mmap_size", "0"},
};

constexpr std::array kReaderSettings{
    Setting{"PRAGMA query_only=1", "PRAGMA query_only", "1"},
    Setting{"PRAGMA wal_autocheckpoint=0", "PRAGMA wal_autocheckpoint", "0"},
    Setting{"PRAGMA busy_timeout=5000", "PRAGMA busy_timeout", "5000"},
    Setting{"PRAGMA trusted_schema=OFF", "PRAGMA trusted_schema", "0"},
    Setting{"PRAGMA mmap_size=0", "PRAGMA mmap_size", "0"},
};

/// As text, which is what SQLite's pragmas are compared with.
Result<std::string> single_value(SqliteConnection& db, const std::string& statement) {
  KILN_TRY(rows, db.query(statement));
  if (rows.empty()) return std::string();
  const Row& row = rows.front();
  const std::string text = row.text(0);
  return text.empty() && !row.is_null(0) ? std::to_string(row.integer(0)) : text;
}

Result<void> apply_settings(SqliteConnection& db, std::span<const Setting> settings) {
  for (const Setting& setting : settings) {
    KILN_DO(db.execute(setting.set));
    KILN_TRY(value, single_value(db, setting.read));
    // mmap_size answers nothing where memory mapping is compiled out: that is off as well.
    if (value != setting.expected && !(value.empty() && std::string_view(setting.expected) == "0")) {
      return fault("store_failed", std::string("SQLite did not take the setting '") + setting.set + "'");
    }
  }
  return {};
}

/// WAL needs shared memory and locks that network file systems do not keep.
Result<void> refuse_network_files(const std::filesystem::path& file) {
  constexpr long kNfsMagic = 0x6969, kSmbMagic = 0x517B, kSmb2Magic = 0xFE534D42;
  struct statfs where {};
  if (::statfs(file.parent_path().c_str(), &where) != 0)
    return fault("io_failed", "the data folder cannot be examined");
  const long type = where.f_type;
  if (type == kNfsMagic || type == kSmbMagic || type == kSmb2Magic) {
    return fault("network_file_system", "the job store must lie on a local disk, not on a network file system");
  }
  return {};
}

Result<void> make_tables(SqliteConnection& db) {
  KILN_TRY(transaction, Transaction::begin(db));
  KILN_TRY(version, single_value(db, "PRAGMA user_version"));
  const std::string newest = std::to_string(kSchemaVersion);
  constexpr std::array kSteps{kTables, kVersion2, kVersion3, kVersion4};  // from 0 to 1, from 1 to 2, and on
  static_assert(kSteps.size() == kSchemaVersion);
  if (version != newest) {
    const auto known = version.size() == 1 ? static_cast<std::size_t>(version.front() - '0') : kSteps.size();
    if (known >= kSteps.size()) {
      return fault("schema_too_new", "the job store was written by another version of this program (schema " + version +
                                         ", this one knows " + newest + ")");
    }
    for (std::size_t step = known; step < kSteps.size(); ++step) KILN_DO(db.execute(kSteps.at(step)));
    KILN_DO(db.execute("PRAGMA user_version=" + newest));
  }
  KILN_DO(db.execute(kDeliveries));
  return transaction.commit();
}

}  // namespace

Result<std::unique_ptr<SqliteConnection>> open_writer(const std::filesystem::path& file, const Clock& now_ms) {
  KILN_DO(refuse_network_files(file));
  KILN_TRY(db, SqliteConnection::open(file, SqliteConnection::Mode::read_write, now_ms));
  KILN_DO(apply_settings(*db, kWriterSettings));
  KILN_TRY(state, single_value(*db, "PRAGMA quick_check(1)"));
  if (state != "ok") return fault("store_damaged", "the job store is damaged (quick_check failed)");
  KILN_DO(make_tables(*db));
  return db;
}

Result<std::unique_ptr<SqliteConnection>> open_reader(const std::filesystem::path& file, const Clock& now_ms) {
  KILN_TRY(db, SqliteConnection::open(file, SqliteConnection::Mode::read_only, now_ms));
  KILN_DO(apply_settings(*db, kReaderSettings));
  return db;
}

}  // namespace kiln::sql
