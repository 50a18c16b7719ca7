#include "server/jobs/postgres_schema.h"

namespace kiln::sql {
namespace {

constexpr int kVersion = 3;

// The same columns, checks and triggers as in sqlite_schema.cpp. What differs:
// - Events get their ids while the writer holds a lock to the end of its transaction: ids grow in the order in which
//   transactions end, and a reader that asks for "the ids after the last one I saw" misses none.
// - lease_until has no index, so that a heartbeat stays inside its page (HOT), with room left for it.
constexpr const char* kTables = R"sql(
-- Sorted by bytes, as SQLite sorts, whatever the language of the database.
CREATE DOMAIN word AS TEXT COLLATE "C";
CREATE TABLE meta(version INTEGER NOT NULL);
INSERT INTO meta VALUES(1);
CREATE TABLE identity(id word NOT NULL);
INSERT INTO identity SELECT replace(gen_random_uuid()::text, '-', '');

CREATE TABLE job(
  id word PRIMARY KEY CHECK(length(id) = 26),
  state word NOT NULL CHECK(state IN ('queued', 'running', 'succeeded', 'failed', 'canceled')),
  tenant word NOT NULL,
  label word NOT NULL,
  recipe word NOT NULL,
  content_key word NOT NULL,
  force BIGINT NOT NULL CHECK(force IN (0, 1)),
  cached BIGINT NOT NULL DEFAULT 0 CHECK(cached IN (0, 1)),
  attempt BIGINT NOT NULL DEFAULT 0 CHECK(attempt >= 0),
  crashes BIGINT NOT NULL DEFAULT 0,
  retries BIGINT NOT NULL DEFAULT 0,
  created_at BIGINT NOT NULL,
  started_at BIGINT,
  finished_at BIGINT,
  run_after BIGINT NOT NULL,
  cancel_requested_at BIGINT,
  lease_owner word,
  lease_until BIGINT,
  fence BIGINT NOT NULL DEFAULT 0,
  version BIGINT NOT NULL DEFAULT 0,
  stage word, done BIGINT, total BIGINT, fraction DOUBLE PRECISION, eta_s DOUBLE PRECISION,
  error_code word, error_message word, error_where word, error_status BIGINT,
  idempotency_key word UNIQUE,
  request_hash word NOT NULL,
  CHECK((finished_at IS NOT NULL) = (state IN ('succeeded', 'failed', 'canceled'))),
  CHECK((lease_owner IS NOT NULL) = (state = 'running')),
  CHECK((lease_until IS NOT NULL) = (state = 'running')),
  CHECK((error_code IS NOT NULL) = (state = 'failed'))
) WITH (fillfactor = 70, autovacuum_vacuum_scale_factor = 0.01);
CREATE INDEX job_by_age ON job(created_at, id);
CREATE INDEX job_by_state ON job(state, created_at, id);
CREATE INDEX job_by_label ON job(label, created_at, id);
CREATE INDEX job_by_tenant ON job(tenant, created_at, id);
CREATE INDEX job_queued ON job(id) WHERE state = 'queued';
CREATE INDEX job_running ON job(tenant) WHERE state = 'running';
CREATE INDEX job_by_content ON job(content_key, finished_at) WHERE finished_at IS NOT NULL;

CREATE TABLE blob(
  sha256 word PRIMARY KEY CHECK(length(sha256) = 64),
  bytes BIGINT NOT NULL CHECK(bytes >= 0),
  last_ref_at BIGINT NOT NULL
);

-- Who brought the blob or baked it: others cannot tell that it is there.
CREATE TABLE blob_tenant(
  sha256 word NOT NULL REFERENCES blob(sha256) ON DELETE CASCADE,
  tenant word NOT NULL,
  PRIMARY KEY(sha256, tenant)
);

CREATE TABLE job_input(
  job_id word NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  role word NOT NULL CHECK(role IN ('scene', 'resource', 'environment')),
  name word NOT NULL,
  sha256 word NOT NULL REFERENCES blob(sha256),
  PRIMARY KEY(job_id, role, name)
);
CREATE INDEX job_input_by_blob ON job_input(sha256);

CREATE TABLE artifact(
  job_id word NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  position BIGINT NOT NULL,
  name word NOT NULL,
  media_type word NOT NULL,
  sha256 word NOT NULL REFERENCES blob(sha256),
  bytes BIGINT NOT NULL CHECK(bytes >= 0),
  fence BIGINT NOT NULL,
  PRIMARY KEY(job_id, name)
);
CREATE INDEX artifact_by_blob ON artifact(sha256);

CREATE SEQUENCE job_event_ids;
CREATE TABLE job_event(
  id BIGINT PRIMARY KEY,
  job_id word NOT NULL REFERENCES job(id) ON DELETE CASCADE,
  at BIGINT NOT NULL,
  kind word NOT NULL CHECK(kind IN ('state', 'log', 'artifact', 'done')),
  state word NOT NULL,
  message word NOT NULL
);
CREATE INDEX job_event_by_job ON job_event(job_id, id);

CREATE TABLE counter(name word PRIMARY KEY, value BIGINT NOT NULL);
INSERT INTO counter VALUES('fence', 0), ('ready', 0);

CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN RAISE EXCEPTION 'this never changes'; END $$;
CREATE TRIGGER job_terminal_is_final BEFORE UPDATE OF state ON job FOR EACH ROW
  WHEN (OLD.finished_at IS NOT NULL) EXECUTE FUNCTION refuse_change();
CREATE TRIGGER job_event_is_append_only BEFORE UPDATE ON job_event FOR EACH ROW EXECUTE FUNCTION refuse_change();

CREATE FUNCTION number_event() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  PERFORM pg_advisory_xact_lock(1802071150, 1);
  NEW.id := nextval('kiln.job_event_ids');
  PERFORM pg_notify('kiln', '');
  RETURN NEW;
END $$;
CREATE TRIGGER job_event_is_numbered BEFORE INSERT ON job_event FOR EACH ROW EXECUTE FUNCTION number_event();
)sql";

// From version 1 to 2: pins, and how much a tenant uploads a day.
constexpr const char* kVersion2 = R"sql(
ALTER TABLE kiln.job ADD COLUMN pinned BIGINT NOT NULL DEFAULT 0 CHECK(pinned IN (0, 1));
ALTER TABLE kiln.blob_tenant ADD COLUMN pinned BIGINT NOT NULL DEFAULT 0 CHECK(pinned IN (0, 1));
CREATE TABLE kiln.upload_day(
  tenant kiln.word NOT NULL,
  day BIGINT NOT NULL, -- since 1970
  bytes BIGINT NOT NULL CHECK(bytes >= 0),
  PRIMARY KEY(tenant, day)
);
UPDATE kiln.meta SET version=2;
)sql";

// From version 2 to 3: parts of jobs, and how much memory a job may use.
constexpr const char* kVersion3 = R"sql(
ALTER TABLE kiln.job ADD COLUMN memory_mb BIGINT NOT NULL DEFAULT 0;
ALTER TABLE kiln.job ADD COLUMN parent kiln.word REFERENCES kiln.job(id) ON DELETE CASCADE;
ALTER TABLE kiln.job ADD COLUMN part_order kiln.word;
ALTER TABLE kiln.job ADD COLUMN maker kiln.word;
ALTER TABLE kiln.job ADD COLUMN journal kiln.word REFERENCES kiln.blob(sha256);
CREATE INDEX job_by_parent ON kiln.job(parent, id) WHERE parent IS NOT NULL;
CREATE INDEX job_by_journal ON kiln.job(journal) WHERE journal IS NOT NULL;
UPDATE kiln.job SET memory_mb=coalesce((recipe::json->'limits'->>'memory_mb')::bigint, 0)
  WHERE state IN ('queued', 'running');
UPDATE kiln.meta SET version=3;
)sql";

// A table that older programs need not know, so it comes without a new version.
constexpr const char* kDeliveries = R"sql(
CREATE TABLE kiln.delivery(
  message kiln.word NOT NULL,
  receiver kiln.word NOT NULL,
  body kiln.word NOT NULL,
  attempt BIGINT NOT NULL DEFAULT 0,
  created_at BIGINT NOT NULL,
  due_at BIGINT NOT NULL,
  PRIMARY KEY(message, receiver)
);
CREATE INDEX delivery_by_due ON kiln.delivery(receiver, due_at, message);
)sql";

Result<void> make_or_check(PostgresConnection& db) {
  KILN_DO(db.query("SELECT pg_advisory_xact_lock(1802071150, 0)"));  // "kiln" as a number; released with the end
  KILN_TRY(found, db.query("SELECT to_regclass('kiln.meta')::text"));
  if (found.front().is_null(0)) {
    KILN_DO(db.execute("CREATE SCHEMA IF NOT EXISTS kiln"));
    KILN_DO(db.execute(kTables));
  }
  KILN_TRY(version, db.query("SELECT version FROM kiln.meta"));
  const auto known = version.front().integer(0);
  if (known < 1 || known > kVersion) {
    return fault("schema_too_new", "the job store was written by another version of this program (schema " +
                                       std::to_string(known) + ", this one knows " + std::to_string(kVersion) + ")");
  }
  if (known < 2) KILN_DO(db.execute(kVersion2));
  if (known < 3) KILN_DO(db.execute(kVersion3));
  KILN_TRY(deliveries, db.query("SELECT to_regclass('kiln.delivery')::text"));
  if (!deliveries.front().is_null(0)) return {};
  return db.execute(kDeliveries);
}

}  // namespace

Result<void> make_postgres_tables(PostgresConnection& db) {
  KILN_DO(db.execute("BEGIN"));
  if (auto made = make_or_check(db); !made) {
    static_cast<void>(db.execute("ROLLBACK"));
    return made;
  }
  return db.execute("COMMIT");
}

}  // namespace kiln::sql
