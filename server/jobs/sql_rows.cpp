#include "server/jobs/sql_rows.h"

#include <utility>

namespace kiln::sql {
namespace {

constexpr const char* kScene = "scene";
constexpr const char* kResource = "resource";
constexpr const char* kEnvironment = "environment";

std::optional<JobProgress> read_progress(const Row& row, std::size_t first) {
  if (row.is_null(first)) return std::nullopt;
  JobProgress progress;
  progress.stage = row.text(first);
  progress.done = static_cast<std::uint64_t>(row.integer(first + 1));
  progress.total = static_cast<std::uint64_t>(row.integer(first + 2));
  progress.fraction = row.real(first + 3);
  if (!row.is_null(first + 4)) progress.eta_s = row.real(first + 4);
  return progress;
}

std::optional<JobError> read_error(const Row& row, std::size_t first) {
  if (row.is_null(first)) return std::nullopt;
  return JobError{{row.text(first), row.text(first + 1), row.text(first + 2)},
                  static_cast<int>(row.integer(first + 3))};
}

Result<void> read_inputs(Connection& db, Job& job) {
  KILN_TRY(rows, db.query("SELECT role, name, sha256 FROM job_input WHERE job_id=? ORDER BY role, name", job.id));
  for (const Row& row : rows) {
    const std::string role = row.text(0);
    NamedBlob file{row.text(1), row.text(2)};
    if (role == kScene) {
      job.inputs.scene = std::move(file);
    } else if (role == kResource) {
      job.inputs.resources.push_back(std::move(file));
    } else if (role == kEnvironment) {
      job.inputs.environment = std::move(file);
    }
  }
  return {};
}

Result<void> insert_input(Connection& db, const Job& job, const char* role, const NamedBlob& file) {
  KILN_DO(db.run("INSERT INTO job_input VALUES(?,?,?,?)", job.id, role, file.name, file.sha256));
  return {};
}

}  // namespace

const char* const kJobColumns =
    "id, state, tenant, label, recipe, content_key, force, cached, cancel_requested_at, attempt, crashes, retries, "
    "created_at, "
    "started_at, finished_at, version, stage, done, total, fraction, eta_s, error_code, error_message, error_where, "
    "error_status, pinned, parent, part_order, journal, memory_mb";

Job read_job(const Row& row) {
  Job job;
  job.id = row.text(0);
  job.state = parse_job_state(row.text(1)).value_or(JobState::failed);  // a CHECK keeps other words out
  job.tenant = row.text(2);
  job.label = row.text(3);
  job.recipe = row.text(4);
  job.content_key = row.text(5);
  job.force = row.integer(6) != 0;
  job.cached = row.integer(7) != 0;
  job.cancel_requested = !row.is_null(8);
  job.attempt = static_cast<int>(row.integer(9));
  job.crashes = static_cast<int>(row.integer(10));
  job.retries = static_cast<int>(row.integer(11));
  job.created_ms = row.integer(12);
  job.started_ms = row.integer(13);
  job.finished_ms = row.integer(14);
  job.version = static_cast<std::uint64_t>(row.integer(15));
  if (job.state == JobState::running) job.progress = read_progress(row, 16);
  job.error = read_error(row, 21);
  job.pinned = row.integer(25) != 0;
  if (!row.is_null(26)) job.part = JobPart{row.text(26), row.text(27), row.text(28)};
  job.memory_mb = static_cast<std::uint64_t>(row.integer(29));
  return job;
}

Result<void> read_lists(Connection& db, Job& job) {
  KILN_DO(read_inputs(db, job));
  if (job.state != JobState::succeeded) return {};
  KILN_TRY(artifacts, find_artifacts(db, job.id));
  job.artifacts = std::move(artifacts);
  return {};
}

Result<std::optional<Job>> find_job(Connection& db, const std::string& id, const char* keep_rows) {
  KILN_TRY(rows, db.query(std::string("SELECT ") + kJobColumns + " FROM job WHERE id=?" + keep_rows, id));
  if (rows.empty()) return std::nullopt;
  Job job = read_job(rows.front());
  KILN_DO(read_lists(db, job));
  return job;
}

Result<void> insert_inputs(Connection& db, const Job& job) {
  KILN_DO(insert_input(db, job, kScene, job.inputs.scene));
  for (const NamedBlob& file : job.inputs.resources) KILN_DO(insert_input(db, job, kResource, file));
  if (job.inputs.environment) KILN_DO(insert_input(db, job, kEnvironment, *job.inputs.environment));
  return {};
}

Result<void> insert_artifacts(Connection& db, const std::string& job_id, std::span<const Artifact> artifacts,
                              std::int64_t fence) {
  int position = 0;
  for (const Artifact& artifact : artifacts) {
    KILN_DO(db.run("INSERT INTO artifact VALUES(?,?,?,?,?,?,?)", job_id, position++, artifact.name, artifact.media_type,
                   artifact.sha256, artifact.bytes, fence));
  }
  return {};
}

Result<std::vector<Artifact>> find_artifacts(Connection& db, const std::string& job_id) {
  KILN_TRY(rows,
           db.query("SELECT name, media_type, sha256, bytes FROM artifact WHERE job_id=? ORDER BY position", job_id));
  std::vector<Artifact> artifacts;
  for (const Row& row : rows) {
    artifacts.push_back({row.text(0), row.text(1), row.text(2), static_cast<std::uint64_t>(row.integer(3))});
  }
  return artifacts;
}

Result<std::uint64_t> append_event(Connection& db, const NewEvent& event, std::int64_t now_ms) {
  KILN_TRY(rows, db.query("INSERT INTO job_event(job_id, at, kind, state, message) VALUES(?,?,?,?,?) RETURNING id",
                          event.job_id, now_ms, to_string(event.kind), to_string(event.state), event.message));
  const std::int64_t id = rows.front().integer(0);
  KILN_DO(db.run("UPDATE job SET version=? WHERE id=?", id, event.job_id));
  return static_cast<std::uint64_t>(id);
}

Result<void> append_end(Connection& db, const Ending& end, std::int64_t now_ms) {
  KILN_DO(append_event(db, {end.job_id, EventKind::state, end.state, end.message}, now_ms));
  for (const Artifact& artifact : end.artifacts) {
    KILN_DO(append_event(db, {end.job_id, EventKind::artifact, end.state, artifact.name}, now_ms));
  }
  KILN_DO(append_event(db, {end.job_id, EventKind::done, end.state, end.message}, now_ms));
  KILN_DO(db.run("DELETE FROM job WHERE parent=?", end.job_id));
  return {};
}

}  // namespace kiln::sql
