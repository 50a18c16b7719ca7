// Ranges that a running job gives away.

#include "server/jobs/sql_store.h"

namespace kiln::sql {

Result<Wrote> SqlStore::add_parts(const ClaimRef& parent, const NewParts& parts) {
  return write([&](Connection& db, std::int64_t now) -> Result<Wrote> {
    // Held to the end of the transaction, so that the job cannot end between.
    KILN_TRY(rows, db.query(std::string("SELECT tenant FROM job WHERE id=? AND state='running' AND lease_owner=? AND "
                                        "fence=? AND cancel_requested_at IS NULL") +
                                engine_->keep_rows(false),
                            parent.job_id, parent.token, parent.fence));
    if (rows.empty()) return Wrote::lost;
    KILN_DO(note_blob(db, {parts.journal.sha256, parts.journal.bytes, rows.front().text(0)}, now));
    for (const std::string& order : parts.orders) {
      std::string id;
      {
        const std::lock_guard lock(ids_mutex_);
        id = ids_.next(now);
      }
      KILN_DO(
          db.run("INSERT INTO job(id, state, tenant, label, recipe, content_key, force, created_at, run_after, "
                 "request_hash, memory_mb, parent, part_order, maker, journal) SELECT ?, 'queued', tenant, '', recipe, "
                 "?, 1, CAST(? AS BIGINT), CAST(? AS BIGINT), '', memory_mb, id, ?, ?, ? FROM job WHERE id=?",
                 id, "part " + id, now, now, order, parts.maker, parts.journal.sha256, parent.job_id));
      KILN_DO(db.run("INSERT INTO job_input SELECT ?, role, name, sha256 FROM job_input WHERE job_id=?", id,
                     parent.job_id));
      KILN_DO(append_event(db, {id, EventKind::state, JobState::queued, ""}, now));
    }
    const std::string line = std::to_string(parts.orders.size()) + " ranges are given away";
    KILN_DO(append_event(db, {parent.job_id, EventKind::log, JobState::running, line}, now));
    return Wrote::done;
  });
}

Result<std::vector<PartState>> SqlStore::parts(const std::string& parent) {
  return read([&](Connection& db) -> Result<std::vector<PartState>> {
    KILN_TRY(rows, db.query("SELECT job.id, part_order, maker, state, artifact.sha256 FROM job LEFT JOIN artifact ON "
                            "artifact.job_id=job.id AND artifact.name='range' WHERE parent=? ORDER BY job.id",
                            parent));
    std::vector<PartState> states;
    for (const Row& row : rows) {
      states.push_back({row.text(0), row.text(1), row.text(2), parse_job_state(row.text(3)).value_or(JobState::failed),
                        row.text(4)});
    }
    return states;
  });
}

Result<void> SqlStore::forget_parts(const ClaimRef& parent) {
  return write([&](Connection& db, std::int64_t) -> Result<void> {
    KILN_DO(
        db.run("DELETE FROM job WHERE parent=? AND EXISTS(SELECT 1 FROM job own WHERE own.id=? AND "
               "own.lease_owner=? AND own.fence=?)",
               parent.job_id, parent.job_id, parent.token, parent.fence));
    return {};
  });
}

Result<std::optional<Claim>> SqlStore::claim_part(const std::string& id, Millis lease) {
  return write([&](Connection& db, std::int64_t now) -> Result<std::optional<Claim>> {
    const std::string mine = "SELECT id FROM job WHERE id=? AND parent IS NOT NULL AND state='queued'";
    KILN_TRY(rows, db.query(mine + engine_->keep_rows(true), id));
    if (rows.empty()) return std::nullopt;
    KILN_TRY(claim, take(db, id, lease, now));
    return claim;
  });
}

}  // namespace kiln::sql
