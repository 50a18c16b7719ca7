// Jobs come and go: create, cancel, remove.

#include "server/jobs/sqlite_store_impl.h"

namespace kiln::sql {
namespace {

constexpr std::int64_t kPoisonMs = 24LL * 3600 * 1000;
constexpr const char* kPoisonCode = "worker_crashed";

tl::unexpected<Fault> unknown_job() { return fault("not_found", "there is no such job"); }

}  // namespace

Result<std::optional<Created>> SqliteStore::find_idempotent(const NewJob& request) {
  if (request.idempotency_key.empty()) return std::nullopt;
  KILN_TRY(rows, writer_.query("SELECT id, request_hash FROM job WHERE idempotency_key=?", request.idempotency_key));
  KILN_TRY(found, rows.next());
  if (!found) return std::nullopt;
  if (rows.text(1) != request.request_hash) {
    return fault("idempotency_mismatch", "this Idempotency-Key was used before with another request");
  }
  KILN_TRY(job, find_job(writer_, rows.text(0)));
  return Created{*job, true};
}

Result<void> SqliteStore::refer_to_inputs(const JobInputs& inputs, std::int64_t now) {
  std::vector<NamedBlob> files = inputs.resources;
  files.push_back(inputs.scene);
  if (inputs.environment) files.push_back(*inputs.environment);
  for (const NamedBlob& file : files) {
    KILN_TRY(known, writer_.run("UPDATE blob SET last_ref_at=? WHERE sha256=?", now, file.sha256));
    if (known == 0) return fault("asset_not_found", "no asset has this SHA-256: upload it first", file.sha256);
  }
  return {};
}

Result<void> SqliteStore::refuse_poison(const NewJob& request, std::int64_t now) {
  if (request.force) return {};
  KILN_TRY(rows, writer_.query("SELECT id FROM job WHERE content_key=? AND state='failed' AND error_code=? AND "
                               "finished_at>? ORDER BY finished_at DESC LIMIT 1",
                               request.content_key, kPoisonCode, now - kPoisonMs));
  KILN_TRY(found, rows.next());
  if (!found) return {};
  return fault("poisoned", "the same scene and recipe crashed its worker twice within a day (job " + rows.text(0) +
                               "); 'force' bakes it all the same");
}

Result<void> SqliteStore::refuse_full_queue(int max_queued) {
  if (max_queued <= 0) return {};
  KILN_TRY(rows, writer_.query("SELECT count(*) FROM job WHERE state='queued'"));
  KILN_DO(rows.next());
  if (rows.integer(0) < max_queued) return {};
  return fault("queue_full", "the queue is full: " + std::to_string(max_queued) + " jobs wait already");
}

Result<void> SqliteStore::insert_job(const Job& job, const NewJob& request, std::int64_t now) {
  KILN_DO(writer_.run(
      "INSERT INTO job(id, state, label, recipe, content_key, force, created_at, run_after, "
      "request_hash) VALUES(?,'queued',?,?,?,?,?,?,?)",
      job.id, job.label, job.recipe, job.content_key, job.force, job.created_ms, now, request.request_hash));
  if (!request.idempotency_key.empty()) {
    KILN_DO(writer_.run("UPDATE job SET idempotency_key=? WHERE id=?", request.idempotency_key, job.id));
  }
  KILN_DO(insert_inputs(writer_, job));
  KILN_DO(append_event(writer_, {job.id, EventKind::state, JobState::queued, ""}, now));
  return {};
}

Result<Created> SqliteStore::create(const NewJob& request) {
  return write([&](std::int64_t now) -> Result<Created> {
    KILN_TRY(earlier, find_idempotent(request));
    if (earlier) return *earlier;
    KILN_DO(refer_to_inputs(request.inputs, now));
    std::vector<Artifact> known;
    if (!request.force) {
      KILN_TRY(found, find_result_in(writer_, request.content_key));
      known = std::move(found);
    }
    if (known.empty()) {
      KILN_DO(refuse_poison(request, now));
      KILN_DO(refuse_full_queue(request.max_queued));
    }
    Job job;
    job.id = ids_.next(now);
    job.created_ms = ids_.last_ms();  // so that (created_at, id) sorts as ids do, even when the clock went back
    job.label = request.label;
    job.inputs = request.inputs;
    job.recipe = request.recipe;
    job.content_key = request.content_key;
    job.force = request.force;
    KILN_DO(insert_job(job, request, now));
    if (!known.empty()) {
      KILN_DO(insert_artifacts(writer_, job.id, known, 0));
      KILN_DO(writer_.run("UPDATE job SET state='succeeded', cached=1, finished_at=? WHERE id=?", now, job.id));
      KILN_DO(append_success(job.id, known, now));
    }
    KILN_TRY(stored, find_job(writer_, job.id));
    return Created{*stored, false};
  });
}

Result<Job> SqliteStore::cancel(const std::string& id) {
  return write([&](std::int64_t now) -> Result<Job> {
    KILN_TRY(ended, writer_.run("UPDATE job SET state='canceled', finished_at=?, cancel_requested_at=? WHERE id=? AND "
                                "state='queued'",
                                now, now, id));
    if (ended > 0) {
      KILN_DO(append_event(writer_, {id, EventKind::state, JobState::canceled, ""}, now));
      KILN_DO(append_event(writer_, {id, EventKind::done, JobState::canceled, ""}, now));
    } else {
      KILN_TRY(flagged, writer_.run("UPDATE job SET cancel_requested_at=? WHERE id=? AND state='running' AND "
                                    "cancel_requested_at IS NULL",
                                    now, id));
      if (flagged > 0) {
        KILN_DO(append_event(writer_, {id, EventKind::log, JobState::running, "cancellation requested"}, now));
      }
    }
    KILN_TRY(job, find_job(writer_, id));
    if (!job) return unknown_job();
    return *job;
  });
}

Result<void> SqliteStore::remove(const std::string& id) {
  return write([&](std::int64_t) -> Result<void> {
    KILN_TRY(removed, writer_.run("DELETE FROM job WHERE id=? AND finished_at IS NOT NULL", id));
    if (removed > 0) return {};
    KILN_TRY(rows, writer_.query("SELECT 1 FROM job WHERE id=?", id));
    KILN_TRY(waiting, rows.next());
    if (waiting) return fault("not_terminal", "the job is still queued or running: cancel it first");
    return {};
  });
}

}  // namespace kiln::sql
