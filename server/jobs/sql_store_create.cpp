// Jobs come and go: create, cancel, remove.

#include <algorithm>

#include "server/jobs/sql_store.h"

namespace kiln::sql {
namespace {

constexpr std::int64_t kPoisonMs = 24LL * 3600 * 1000;
constexpr const char* kPoisonCode = "worker_crashed";

tl::unexpected<Fault> unknown_job() { return fault("not_found", "there is no such job"); }

/// A key is its tenant's own. Neither part holds a line break.
std::string stored_key(const NewJob& request) {
  return request.tenant.empty() ? request.idempotency_key : request.tenant + "\n" + request.idempotency_key;
}

Result<std::optional<Created>> find_idempotent(Connection& db, const NewJob& request) {
  if (request.idempotency_key.empty()) return std::nullopt;
  KILN_TRY(rows, db.query("SELECT id, request_hash FROM job WHERE idempotency_key=?", stored_key(request)));
  if (rows.empty()) return std::nullopt;
  if (rows.front().text(1) != request.request_hash) {
    return fault("idempotency_mismatch", "this Idempotency-Key was used before with another request");
  }
  KILN_TRY(job, find_job(db, rows.front().text(0)));
  return Created{*job, true};
}

Result<void> refer_to_inputs(Connection& db, const NewJob& request, std::int64_t now) {
  const JobInputs& inputs = request.inputs;
  std::vector<NamedBlob> files = inputs.resources;
  files.push_back(inputs.scene);
  if (inputs.environment) files.push_back(*inputs.environment);
  std::ranges::sort(files, {}, &NamedBlob::sha256);  // in one order, so that two of them never wait for each other
  for (const NamedBlob& file : files) {
    KILN_TRY(known, db.run("UPDATE blob SET last_ref_at=? WHERE sha256=? AND EXISTS(SELECT 1 FROM blob_tenant t WHERE "
                           "t.sha256=blob.sha256 AND t.tenant=?)",
                           now, file.sha256, request.tenant));
    if (known == 0) return fault("asset_not_found", "no asset has this SHA-256: upload it first", file.sha256);
  }
  return {};
}

Result<void> refuse_poison(Connection& db, const NewJob& request, std::int64_t now) {
  if (request.force) return {};
  KILN_TRY(rows, db.query("SELECT id FROM job WHERE content_key=? AND state='failed' AND error_code=? AND "
                          "finished_at>? ORDER BY finished_at DESC LIMIT 1",
                          request.content_key, kPoisonCode, now - kPoisonMs));
  if (rows.empty()) return {};
  return fault("poisoned", "the same scene and recipe crashed its worker twice within a day (job " +
                               rows.front().text(0) + "); 'force' bakes it all the same");
}

Result<void> refuse_full_queue(Connection& db, int max_queued) {
  if (max_queued <= 0) return {};
  KILN_TRY(rows, db.query("SELECT count(*) FROM job WHERE state='queued' AND parent IS NULL"));
  if (rows.front().integer(0) < max_queued) return {};
  return fault("queue_full", "the queue is full: " + std::to_string(max_queued) + " jobs wait already");
}

Result<void> refuse_over_quota(Connection& db, const NewJob& request) {
  if (request.max_open <= 0) return {};
  KILN_TRY(rows,
           db.query("SELECT count(*) FROM job WHERE tenant=? AND state IN ('queued', 'running') AND parent IS NULL",
                    request.tenant));
  if (rows.front().integer(0) < request.max_open) return {};
  return fault("quota", "this token may have " + std::to_string(request.max_open) + " unfinished jobs at a time");
}

Result<void> insert_job(Connection& db, const Job& job, const NewJob& request, std::int64_t now) {
  KILN_DO(db.run(
      "INSERT INTO job(id, state, tenant, label, recipe, content_key, force, created_at, run_after, request_hash, "
      "memory_mb) VALUES(?,'queued',?,?,?,?,?,?,?,?,?)",
      job.id, job.tenant, job.label, job.recipe, job.content_key, job.force, job.created_ms, now, request.request_hash,
      request.memory_mb));
  if (!request.idempotency_key.empty()) {
    KILN_DO(db.run("UPDATE job SET idempotency_key=? WHERE id=?", stored_key(request), job.id));
  }
  KILN_DO(insert_inputs(db, job));
  KILN_DO(append_event(db, {job.id, EventKind::state, JobState::queued, ""}, now));
  return {};
}

}  // namespace

Result<Created> SqlStore::create(const NewJob& request) {
  return write([&](Connection& db, std::int64_t now) -> Result<Created> {
    KILN_TRY(earlier, find_idempotent(db, request));
    if (earlier) return *earlier;
    KILN_DO(refer_to_inputs(db, request, now));
    std::vector<Artifact> known;
    if (!request.force) {
      KILN_TRY(found, find_result_in(db, request.content_key));
      known = std::move(found);
    }
    if (known.empty()) {
      KILN_DO(refuse_poison(db, request, now));
      KILN_DO(refuse_full_queue(db, request.max_queued));
      KILN_DO(refuse_over_quota(db, request));
    }
    Job job;
    {
      const std::lock_guard lock(ids_mutex_);
      job.id = ids_.next(now);
      job.created_ms = ids_.last_ms();  // so that (created_at, id) sorts as ids do, even when the clock went back
    }
    job.tenant = request.tenant;
    job.label = request.label;
    job.inputs = request.inputs;
    job.recipe = request.recipe;
    job.content_key = request.content_key;
    job.force = request.force;
    KILN_DO(insert_job(db, job, request, now));
    if (!known.empty()) {
      KILN_DO(insert_artifacts(db, job.id, known, 0));
      KILN_DO(db.run("UPDATE job SET state='succeeded', cached=1, finished_at=? WHERE id=?", now, job.id));
      KILN_DO(append_end(db, {job.id, JobState::succeeded, "", known}, now));
    }
    KILN_TRY(stored, find_job(db, job.id));
    return Created{*stored, false};
  });
}

Result<Job> SqlStore::cancel(const std::string& id) {
  return write([&](Connection& db, std::int64_t now) -> Result<Job> {
    KILN_TRY(kept, find_job(db, id, engine_->keep_rows(false)));  // its state stays as the statements below find it
    if (!kept) return unknown_job();
    KILN_TRY(ended, db.run("UPDATE job SET state='canceled', finished_at=?, cancel_requested_at=? WHERE id=? AND "
                           "state='queued'",
                           now, now, id));
    if (ended > 0) {
      KILN_DO(append_end(db, {id, JobState::canceled}, now));
    } else {
      KILN_TRY(flagged, db.run("UPDATE job SET cancel_requested_at=? WHERE id=? AND state='running' AND "
                               "cancel_requested_at IS NULL",
                               now, id));
      if (flagged > 0) {
        KILN_DO(append_event(db, {id, EventKind::log, JobState::running, "cancellation requested"}, now));
      }
    }
    KILN_TRY(job, find_job(db, id));
    return *job;
  });
}

}  // namespace kiln::sql
