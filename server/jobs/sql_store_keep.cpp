// What is kept and for how long: pins, retention, blobs and their last use, and how much a tenant brings a day.

#include "server/jobs/sql_store.h"

namespace kiln::sql {
namespace {

constexpr std::int64_t kDayMs = 24 * 3600 * 1000;

tl::unexpected<Fault> unknown_job() { return fault("not_found", "there is no such job"); }

/// Deletes or counts the jobs of a tenant that ended before `before`.
Result<int> forget_jobs(Connection& db, const std::string& tenant, std::int64_t before, bool only_count) {
  const std::string which = " FROM job WHERE tenant=? AND finished_at<? AND pinned=0 AND parent IS NULL";
  if (!only_count) return db.run("DELETE" + which, tenant, before);
  KILN_TRY(rows, db.query("SELECT count(*)" + which, tenant, before));
  return static_cast<int>(rows.front().integer(0));
}

}  // namespace

Result<void> SqlStore::remove(const std::string& id) {
  return write([&](Connection& db, std::int64_t) -> Result<void> {
    KILN_TRY(removed, db.run("DELETE FROM job WHERE id=? AND finished_at IS NOT NULL AND pinned=0", id));
    if (removed > 0) return {};
    KILN_TRY(rows, db.query("SELECT finished_at FROM job WHERE id=?", id));
    if (rows.empty()) return {};
    if (rows.front().is_null(0)) return fault("not_terminal", "the job is still queued or running: cancel it first");
    return fault("pinned", "the job is pinned: unpin it first");
  });
}

Result<Job> SqlStore::pin(const std::string& id, bool pinned) {
  return write([&](Connection& db, std::int64_t now) -> Result<Job> {
    const int wanted = pinned ? 1 : 0;
    KILN_TRY(rows, db.query("UPDATE job SET pinned=? WHERE id=? AND pinned<>? RETURNING state", wanted, id, wanted));
    if (!rows.empty()) {
      const JobState state = parse_job_state(rows.front().text(0)).value_or(JobState::failed);
      KILN_DO(append_event(db, {id, EventKind::log, state, pinned ? "pinned" : "no longer pinned"}, now));
    }
    KILN_TRY(job, find_job(db, id));
    if (!job) return unknown_job();
    return *job;
  });
}

Result<int> SqlStore::forget_old_jobs(const Retention& retention, bool only_count) {
  return write([&](Connection& db, std::int64_t now) -> Result<int> {
    int forgotten = 0;
    KILN_TRY(rows, db.query("SELECT DISTINCT tenant FROM job WHERE finished_at IS NOT NULL"));
    for (const Row& row : rows) {
      const std::string tenant = row.text(0);
      const auto own = retention.tenants.find(tenant);
      const Millis kept = own == retention.tenants.end() ? retention.others : own->second;
      if (kept.count() <= 0) continue;
      KILN_TRY(gone, forget_jobs(db, tenant, now - kept.count(), only_count));
      forgotten += gone;
    }
    return forgotten;
  });
}

Result<void> note_blob(Connection& db, const BlobNote& blob, std::int64_t now) {
  KILN_DO(db.run("INSERT INTO blob VALUES(?,?,?) ON CONFLICT(sha256) DO UPDATE SET last_ref_at=excluded.last_ref_at",
                 blob.sha256, blob.bytes, now));
  if (!blob.tenant) return {};
  KILN_DO(
      db.run("INSERT INTO blob_tenant(sha256, tenant) VALUES(?,?) ON CONFLICT DO NOTHING", blob.sha256, *blob.tenant));
  return {};
}

Result<void> SqlStore::touch_blob(const std::string& sha256, std::uint64_t bytes,
                                  const std::optional<std::string>& tenant) {
  return write([&](Connection& db, std::int64_t now) { return note_blob(db, {sha256, bytes, tenant}, now); });
}

Result<bool> SqlStore::knows_blob(const std::string& sha256, const std::optional<std::string>& tenant) {
  return read([&](Connection& db) -> Result<bool> {
    KILN_TRY(rows, tenant ? db.query("SELECT 1 FROM blob_tenant WHERE sha256=? AND tenant=?", sha256, *tenant)
                          : db.query("SELECT 1 FROM blob WHERE sha256=?", sha256));
    return !rows.empty();
  });
}

Result<void> SqlStore::pin_blob(const std::string& sha256, const std::string& tenant, bool pinned) {
  return write([&](Connection& db, std::int64_t now) -> Result<void> {
    KILN_DO(db.run("UPDATE blob SET last_ref_at=? WHERE sha256=?", now, sha256));  // whoever forgets it looks again
    KILN_TRY(known,
             db.run("UPDATE blob_tenant SET pinned=? WHERE sha256=? AND tenant=?", pinned ? 1 : 0, sha256, tenant));
    if (known == 0) return fault("not_found", "there is no such asset");
    return {};
  });
}

Result<std::vector<std::string>> SqlStore::forget_unused_blobs(Millis grace, bool only_count) {
  return write([&](Connection& db, std::int64_t now) -> Result<std::vector<std::string>> {
    const std::string which =
        " FROM blob WHERE last_ref_at<? "
        "AND NOT EXISTS(SELECT 1 FROM job_input i WHERE i.sha256=blob.sha256) "
        "AND NOT EXISTS(SELECT 1 FROM artifact a WHERE a.sha256=blob.sha256) "
        "AND NOT EXISTS(SELECT 1 FROM job j WHERE j.journal=blob.sha256) "
        "AND NOT EXISTS(SELECT 1 FROM blob_tenant t WHERE t.sha256=blob.sha256 AND t.pinned=1)";
    const std::int64_t before = now - grace.count();
    KILN_TRY(rows, only_count ? db.query("SELECT sha256" + which, before)
                              : db.query("DELETE" + which + " RETURNING sha256", before));
    std::vector<std::string> forgotten;
    for (const Row& row : rows) forgotten.push_back(row.text(0));
    return forgotten;
  });
}

Result<std::int64_t> SqlStore::charge_upload(const std::string& tenant, std::uint64_t bytes, std::uint64_t limit) {
  return write([&](Connection& db, std::int64_t now) -> Result<std::int64_t> {
    const std::int64_t day = now / kDayMs;
    KILN_DO(db.run("DELETE FROM upload_day WHERE tenant=? AND day<?", tenant, day));
    KILN_TRY(rows, db.query("INSERT INTO upload_day VALUES(?,?,?) ON CONFLICT(tenant, day) DO UPDATE SET "
                            "bytes=upload_day.bytes+excluded.bytes RETURNING bytes",
                            tenant, day, bytes));
    if (limit == 0 || static_cast<std::uint64_t>(rows.front().integer(0)) <= limit) return day;
    return fault("daily_quota", "this tenant may upload " + std::to_string(limit) + " bytes a day");
  });
}

Result<void> SqlStore::refund_upload(const std::string& tenant, std::uint64_t bytes, std::int64_t day) {
  return write([&](Connection& db, std::int64_t) -> Result<void> {
    KILN_DO(db.run("UPDATE upload_day SET bytes=CASE WHEN bytes<? THEN 0 ELSE bytes-? END WHERE tenant=? AND day=?",
                   bytes, bytes, tenant, day));
    return {};
  });
}

}  // namespace kiln::sql
