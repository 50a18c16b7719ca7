// What a worker's supervisor does to its claim. Every statement names id, token and fence: no match, no effect.

#include "server/jobs/sqlite_store_impl.h"

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

Result<std::optional<Claim>> SqliteStore::claim(Millis lease) {
  // Look first: an idle worker costs no write.
  KILN_TRY(due, read([&]() -> Result<bool> {
             KILN_TRY(rows,
                      reader_.query("SELECT 1 FROM job WHERE state='queued' AND run_after<=? LIMIT 1", now_ms_()));
             return rows.next();
           }));
  if (!due) return std::nullopt;
  return write([&](std::int64_t now) -> Result<std::optional<Claim>> {
    KILN_TRY(rows, writer_.query("SELECT id FROM job WHERE state='queued' AND run_after<=? ORDER BY id LIMIT 1", now));
    KILN_TRY(found, rows.next());
    if (!found) return std::nullopt;
    Claim claim;
    claim.ref = {rows.text(0), random_token(), 0};
    KILN_DO(writer_.run("UPDATE counter SET value=value+1 WHERE name='fence'"));
    KILN_TRY(fence, writer_.query("SELECT value FROM counter WHERE name='fence'"));
    KILN_DO(fence.next());
    claim.ref.fence = fence.integer(0);
    KILN_DO(
        writer_.run("UPDATE job SET state='running', attempt=attempt+1, lease_owner=?, lease_until=?, fence=?, "
                    "started_at=? WHERE id=?",
                    claim.ref.token, now + lease.count(), claim.ref.fence, now, claim.ref.job_id));
    KILN_DO(append_event(writer_, {claim.ref.job_id, EventKind::state, JobState::running, ""}, now));
    KILN_TRY(job, find_job(writer_, claim.ref.job_id));
    claim.job = *job;
    return claim;
  });
}

Result<Beat> SqliteStore::heartbeat(const ClaimRef& ref, Millis lease, const std::optional<JobProgress>& progress) {
  return write([&](std::int64_t now) -> Result<Beat> {
    KILN_TRY(mine,
             writer_.run(update("lease_until=?", "").c_str(), now + lease.count(), ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Beat::lost;
    if (progress) {
      KILN_DO(writer_.run("UPDATE job SET stage=?, done=?, total=?, fraction=? WHERE id=?", progress->stage,
                          progress->done, progress->total, progress->fraction, ref.job_id));
      if (progress->eta_s) KILN_DO(writer_.run("UPDATE job SET eta_s=? WHERE id=?", *progress->eta_s, ref.job_id));
    }
    KILN_TRY(rows, writer_.query("SELECT cancel_requested_at FROM job WHERE id=?", ref.job_id));
    KILN_DO(rows.next());
    return rows.is_null(0) ? Beat::ok : Beat::cancel_requested;
  });
}

Result<void> SqliteStore::append_success(const std::string& job_id, std::span<const Artifact> artifacts,
                                         std::int64_t now) {
  KILN_DO(append_event(writer_, {job_id, EventKind::state, JobState::succeeded, ""}, now));
  for (const Artifact& artifact : artifacts) {
    KILN_DO(append_event(writer_, {job_id, EventKind::artifact, JobState::succeeded, artifact.name}, now));
  }
  KILN_DO(append_event(writer_, {job_id, EventKind::done, JobState::succeeded, ""}, now));
  return {};
}

Result<Wrote> SqliteStore::commit(const ClaimRef& ref, std::span<const Artifact> artifacts, bool cached) {
  return write([&](std::int64_t now) -> Result<Wrote> {
    const std::string statement = update(std::string("state='succeeded', finished_at=?, cached=?, ") + kClearRun);
    KILN_TRY(mine, writer_.run(statement.c_str(), now, cached, ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    for (const Artifact& artifact : artifacts) {
      KILN_DO(writer_.run("INSERT INTO blob VALUES(?,?,?) ON CONFLICT DO UPDATE SET last_ref_at=excluded.last_ref_at",
                          artifact.sha256, artifact.bytes, now));
    }
    KILN_DO(insert_artifacts(writer_, ref.job_id, artifacts, ref.fence));
    KILN_DO(append_success(ref.job_id, artifacts, now));
    return Wrote::done;
  });
}

Result<Wrote> SqliteStore::fail(const ClaimRef& ref, const JobError& error) {
  return write([&](std::int64_t now) -> Result<Wrote> {
    const std::string statement = update(
        std::string("state='failed', finished_at=?, error_code=?, error_message=?, error_where=?, error_status=?, ") +
        kClearRun);
    KILN_TRY(mine, writer_.run(statement.c_str(), now, error.fault.code, error.fault.message, error.fault.where,
                               error.status, ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_event(writer_, {ref.job_id, EventKind::state, JobState::failed, error.fault.code}, now));
    KILN_DO(append_event(writer_, {ref.job_id, EventKind::done, JobState::failed, error.fault.code}, now));
    return Wrote::done;
  });
}

Result<Wrote> SqliteStore::requeue(const ClaimRef& ref, const Retry& retry, const char* counters) {
  return write([&](std::int64_t now) -> Result<Wrote> {
    const std::string statement =
        update(std::string("state='queued', started_at=NULL, run_after=?, ") + counters + ", " + kClearRun);
    KILN_TRY(mine, writer_.run(statement.c_str(), now + retry.delay.count(), ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_event(writer_, {ref.job_id, EventKind::state, JobState::queued, retry.reason}, now));
    return Wrote::done;
  });
}

Result<Wrote> SqliteStore::retry(const ClaimRef& ref, const Retry& retry) {
  return requeue(ref, retry, retry.crash ? "crashes=crashes+1" : "retries=retries+1");
}

Result<Wrote> SqliteStore::release(const ClaimRef& ref) {
  return requeue(ref, {"the server stops; the job goes on after its next start"}, "attempt=attempt-1");
}

Result<Wrote> SqliteStore::finish_cancel(const ClaimRef& ref) {
  return write([&](std::int64_t now) -> Result<Wrote> {
    const std::string statement =
        update(std::string("state='canceled', finished_at=?, ") + kClearRun, " AND cancel_requested_at IS NOT NULL");
    KILN_TRY(mine, writer_.run(statement.c_str(), now, ref.job_id, ref.token, ref.fence));
    if (mine == 0) return Wrote::lost;
    KILN_DO(append_event(writer_, {ref.job_id, EventKind::state, JobState::canceled, ""}, now));
    KILN_DO(append_event(writer_, {ref.job_id, EventKind::done, JobState::canceled, ""}, now));
    return Wrote::done;
  });
}

Result<void> SqliteStore::reap_one(const std::string& id, std::int64_t now) {
  const std::string cancel = std::string("UPDATE job SET state='canceled', finished_at=?, ") + kClearRun +
                             " WHERE id=? AND cancel_requested_at IS NOT NULL";
  KILN_TRY(canceled, writer_.run(cancel.c_str(), now, id));
  if (canceled > 0) {
    KILN_DO(append_event(writer_, {id, EventKind::state, JobState::canceled, ""}, now));
    KILN_DO(append_event(writer_, {id, EventKind::done, JobState::canceled, ""}, now));
    return {};
  }
  const std::string requeue =
      std::string("UPDATE job SET state='queued', started_at=NULL, run_after=?, ") + kClearRun + " WHERE id=?";
  KILN_DO(writer_.run(requeue.c_str(), now, id));
  KILN_DO(append_event(writer_, {id, EventKind::state, JobState::queued, "its worker was lost"}, now));
  return {};
}

Result<int> SqliteStore::reap(bool everything) {
  return write([&](std::int64_t now) -> Result<int> {
    std::vector<std::string> lost;
    KILN_TRY(rows, writer_.query("SELECT id FROM job WHERE state='running' AND (? OR lease_until<?)", everything, now));
    while (true) {
      KILN_TRY(more, rows.next());
      if (!more) break;
      lost.push_back(rows.text(0));
    }
    for (const std::string& id : lost) KILN_DO(reap_one(id, now));
    return static_cast<int>(lost.size());
  });
}

}  // namespace kiln::sql
