// What a worker's supervisor does to its claim. Every statement names id, token and fence: no match, no effect.

#include <algorithm>
#include <limits>
#include <map>

#include "server/jobs/sql_store.h"

namespace kiln::sql {
namespace {

constexpr const char* kClearRun =
    "lease_owner=NULL, lease_until=NULL, stage=NULL, done=NULL, total=NULL, fraction=NULL, eta_s=NULL";
constexpr const char* kMine = " WHERE id=? AND state='running' AND lease_owner=? AND fence=?";
constexpr const char* kNotCanceled = " AND cancel_requested_at IS NULL";

std::string update(const std::string& assignments, const char* condition = kNotCanceled) {
  return "UPDATE job SET " + assignments + kMine + condition;
}

}  // namespace

namespace {

/// Jobs that are due and may be this taker's.
constexpr const char* kDue =
    " FROM job WHERE state='queued' AND run_after<=? AND (parent IS NULL OR maker=?) AND memory_mb<=?";
constexpr const char* kFairly =
    " ORDER BY (SELECT count(*) FROM job other WHERE other.state='running' AND other.tenant=job.tenant), "
    "parent IS NOT NULL, id LIMIT 1";
constexpr std::uint64_t kAnyMemory = std::numeric_limits<std::int64_t>::max();

/// The next job by fairness, if there is room for it; a smaller one while that has not waited for long.
Result<std::optional<std::string>> choose(Connection& db, const Taker& taker, const char* keep_rows, std::int64_t now) {
  const std::string next = std::string("SELECT id, memory_mb, run_after, CASE WHEN parent IS NULL THEN 0 ELSE 1 END") +
                           kDue + kFairly + keep_rows;
  KILN_TRY(rows, db.query(next, now, taker.maker, kAnyMemory));
  if (rows.empty()) return std::nullopt;
  const std::uint64_t room = std::min(taker.free_mb, kAnyMemory);
  if (taker.idle || static_cast<std::uint64_t>(rows.front().integer(1)) <= room) return rows.front().text(0);
  const bool part = rows.front().integer(3) != 0;  // its job goes on without help
  if (!part && now - rows.front().integer(2) > taker.patience.count()) return std::nullopt;
  KILN_TRY(smaller, db.query(next, now, taker.maker, room));
  if (smaller.empty()) return std::nullopt;
  return smaller.front().text(0);
}

}  // namespace

Result<Claim> SqlStore::take(Connection& db, const std::string& id, Millis lease, std::int64_t now) {
  KILN_TRY(fence, db.query("UPDATE counter SET value=value+1 WHERE name='fence' RETURNING value"));
  Claim claim;
  claim.ref = {id, random_token(), fence.front().integer(0)};
  KILN_DO(
      db.run("UPDATE job SET state='running', attempt=attempt+1, lease_owner=?, lease_until=?, fence=?, "
             "started_at=? WHERE id=?",
             claim.ref.token, now + lease.count(), claim.ref.fence, now, id));
  KILN_TRY(job, find_job(db, id));
  const std::string which = "attempt " + std::to_string(job->attempt);
  KILN_TRY(version, append_event(db, {id, EventKind::state, JobState::running, which}, now));
  claim.job = *job;
  claim.job.version = version;
  return claim;
}

Result<std::optional<Claim>> SqlStore::claim(Millis lease, const Taker& taker) {
  // Look first: an idle worker costs no write.
  KILN_TRY(due, read([&](Connection& db) -> Result<bool> {
             KILN_TRY(now, db.now_ms());
             const std::uint64_t room = taker.idle ? kAnyMemory : std::min(taker.free_mb, kAnyMemory);
             KILN_TRY(rows, db.query(std::string("SELECT 1") + kDue + " LIMIT 1", now, taker.maker, room));
             return !rows.empty();
           }));
  if (!due) return std::nullopt;
  return write([&](Connection& db, std::int64_t now) -> Result<std::optional<Claim>> {
    KILN_TRY(id, choose(db, taker, engine_->keep_rows(true), now));
    if (!id) return std::nullopt;
    return take(db, *id, lease, now);
  });
}

Result<Beat> SqlStore::heartbeat(const ClaimRef& ref, Millis lease, const std::optional<JobProgress>& progress) {
  return write([&](Connection& db, std::int64_t now) -> Result<Beat> {
    KILN_TRY(mine, db.run(update("lease_until=?", ""), now + lease.count(), ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Beat::lost;
    if (progress) {
      KILN_DO(db.run("UPDATE job SET stage=?, done=?, total=?, fraction=? WHERE id=?", progress->stage, progress->done,
                     progress->total, progress->fraction, ref.job_id));
      if (progress->eta_s) KILN_DO(db.run("UPDATE job SET eta_s=? WHERE id=?", *progress->eta_s, ref.job_id));
    }
    KILN_TRY(rows, db.query("SELECT cancel_requested_at FROM job WHERE id=?", ref.job_id));
    return rows.front().is_null(0) ? Beat::ok : Beat::cancel_requested;
  });
}

Result<Wrote> SqlStore::commit(const ClaimRef& ref, std::span<const Artifact> artifacts, bool cached) {
  return write([&](Connection& db, std::int64_t now) -> Result<Wrote> {
    const std::string statement = update(std::string("state='succeeded', finished_at=?, cached=?, ") + kClearRun);
    KILN_TRY(mine, db.run(statement, now, cached, ref.job_id, ref.token, ref.fence));
    if (mine == 0) {
      // This very claim committed already, and the answer got lost on its way.
      KILN_TRY(before,
               db.query("SELECT 1 FROM job WHERE id=? AND state='succeeded' AND fence=?", ref.job_id, ref.fence));
      return before.empty() ? Wrote::lost : Wrote::done;
    }
    std::map<std::string, std::uint64_t> sorted;  // in one order, so that two commits never wait for each other
    for (const Artifact& artifact : artifacts) sorted[artifact.sha256] = artifact.bytes;
    KILN_TRY(owner, db.query("SELECT tenant FROM job WHERE id=?", ref.job_id));
    const std::string tenant = owner.front().text(0);
    for (const auto& [sha256, bytes] : sorted) KILN_DO(note_blob(db, {sha256, bytes, tenant}, now));
    KILN_DO(insert_artifacts(db, ref.job_id, artifacts, ref.fence));
    KILN_DO(append_end(db, {ref.job_id, JobState::succeeded, "", artifacts}, now));
    return Wrote::done;
  });
}

Result<Wrote> SqlStore::fail(const ClaimRef& ref, const JobError& error) {
  return write([&](Connection& db, std::int64_t now) -> Result<Wrote> {
    const std::string statement = update(
        std::string("state='failed', finished_at=?, error_code=?, error_message=?, error_where=?, error_status=?, ") +
        kClearRun);
    KILN_TRY(mine, db.run(statement, now, error.fault.code, error.fault.message, error.fault.where, error.status,
                          ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_end(db, {ref.job_id, JobState::failed, error.fault.code}, now));
    return Wrote::done;
  });
}

Result<Wrote> SqlStore::requeue(const ClaimRef& ref, const Retry& retry, const char* counters) {
  return write([&](Connection& db, std::int64_t now) -> Result<Wrote> {
    const std::string statement =
        update(std::string("state='queued', started_at=NULL, run_after=?, ") + counters + ", " + kClearRun);
    KILN_TRY(mine, db.run(statement, now + retry.delay.count(), ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_event(db, {ref.job_id, EventKind::state, JobState::queued, retry.reason}, now));
    return Wrote::done;
  });
}

Result<Wrote> SqlStore::retry(const ClaimRef& ref, const Retry& retry) {
  return requeue(ref, retry, retry.crash ? "crashes=crashes+1" : "retries=retries+1");
}

Result<Wrote> SqlStore::release(const ClaimRef& ref) {
  return requeue(ref, {"the server stops; the job goes on after its next start"}, "attempt=attempt-1");
}

Result<Wrote> SqlStore::finish_cancel(const ClaimRef& ref) {
  return write([&](Connection& db, std::int64_t now) -> Result<Wrote> {
    const std::string statement =
        update(std::string("state='canceled', finished_at=?, ") + kClearRun, " AND cancel_requested_at IS NOT NULL");
    KILN_TRY(mine, db.run(statement, now, ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_end(db, {ref.job_id, JobState::canceled}, now));
    return Wrote::done;
  });
}

namespace {

Result<void> reap_one(Connection& db, const std::string& id, const char* why, std::int64_t now) {
  const std::string cancel = std::string("UPDATE job SET state='canceled', finished_at=?, ") + kClearRun +
                             " WHERE id=? AND cancel_requested_at IS NOT NULL";
  KILN_TRY(canceled, db.run(cancel, now, id));
  if (canceled > 0) return append_end(db, {id, JobState::canceled}, now);
  const std::string requeue =
      std::string("UPDATE job SET state='queued', started_at=NULL, run_after=?, ") + kClearRun + " WHERE id=?";
  KILN_TRY(there, db.run(requeue, now, id));
  if (there == 0) return {};  // a part that ended with its job
  KILN_DO(append_event(db, {id, EventKind::state, JobState::queued, why}, now));
  return {};
}

}  // namespace

Result<int> SqlStore::reap(bool everything) {
  return write([&](Connection& db, std::int64_t now) -> Result<int> {
    // Rows that somebody writes to at this moment have a living owner, or the next round.
    const std::string lost = "SELECT id FROM job WHERE state='running' AND (?=1 OR lease_until<?)";
    KILN_TRY(rows, db.query(lost + engine_->keep_rows(true), everything ? 1 : 0, now));
    const char* why =
        everything ? "its server ended before it was done" : "its lease ended without a word of its server";
    for (const Row& row : rows) KILN_DO(reap_one(db, row.text(0), why, now));
    return static_cast<int>(rows.all.size());
  });
}

}  // namespace kiln::sql
