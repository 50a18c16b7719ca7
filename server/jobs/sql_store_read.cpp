// What people ask: one job, pages of jobs, events.

#include <algorithm>
#include <charconv>

#include "server/jobs/sql_store.h"

namespace kiln::sql {
namespace {

constexpr int kMaxPage = 200;

/// The last entry of a page: "<created_ms>.<id>". Opaque to callers.
struct Cursor {
  std::int64_t created_ms = 0;
  std::string id;
};

Result<Cursor> parse_cursor(const std::string& text) {
  Cursor cursor;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cursor.created_ms);
  const auto dot = static_cast<std::size_t>(end - text.data());
  if (error != std::errc() || dot >= text.size() || text[dot] != '.' || text.size() - dot - 1 != 26) {
    return fault("bad_cursor", "this cursor was not made by this server");
  }
  cursor.id = text.substr(dot + 1);
  return cursor;
}

Result<Rows> query_page(Connection& db, const JobQuery& query, int limit) {
  std::string statement = std::string("SELECT ") + kJobColumns + " FROM job WHERE parent IS NULL";
  std::vector<Value> values;
  const auto add = [&](const char* condition, const auto& value) {
    statement += condition;
    values.push_back(value_of(value));
  };
  if (query.tenant) add(" AND tenant=?", *query.tenant);
  if (query.state) add(" AND state=?", to_string(*query.state));
  if (query.label) add(" AND label=?", *query.label);
  if (!query.cursor.empty()) {
    KILN_TRY(cursor, parse_cursor(query.cursor));
    add(" AND (created_at, id)<(?,", cursor.created_ms);
    add(" ?)", cursor.id);
  }
  add(" ORDER BY created_at DESC, id DESC LIMIT ?", limit);
  return db.ask(statement, values);
}

JobEvent read_event(const Row& row) {
  JobEvent event;
  event.id = static_cast<std::uint64_t>(row.integer(0));
  event.job_id = row.text(1);
  event.at_ms = row.integer(2);
  event.kind = parse_event_kind(row.text(3)).value_or(EventKind::log);  // a CHECK keeps other words out
  event.state = parse_job_state(row.text(4)).value_or(JobState::queued);
  event.message = row.text(5);
  if (event.kind == EventKind::artifact && !row.is_null(6)) {
    event.artifact = Artifact{row.text(6), row.text(7), row.text(8), static_cast<std::uint64_t>(row.integer(9))};
  }
  return event;
}

}  // namespace

Result<std::vector<Artifact>> find_result_in(Connection& db, const std::string& content_key) {
  KILN_TRY(rows, db.query("SELECT id FROM job WHERE content_key=? AND state='succeeded' AND finished_at IS NOT NULL "
                          "ORDER BY finished_at DESC LIMIT 1",
                          content_key));
  if (rows.empty()) return std::vector<Artifact>{};
  return find_artifacts(db, rows.front().text(0));
}

Result<Job> SqlStore::get(const std::string& id) {
  return read([&](Connection& db) -> Result<Job> {
    KILN_TRY(job, find_job(db, id));
    if (!job) return fault("not_found", "there is no such job");
    return *job;
  });
}

Result<JobPage> SqlStore::list(const JobQuery& query) {
  return read([&](Connection& db) -> Result<JobPage> {
    const int limit = std::clamp(query.limit, 1, kMaxPage);
    KILN_TRY(rows, query_page(db, query, limit + 1));  // one more tells whether there is a next page
    JobPage page;
    for (const Row& row : rows) page.jobs.push_back(read_job(row));
    if (page.jobs.size() > static_cast<std::size_t>(limit)) {
      page.jobs.pop_back();
      page.next_cursor = std::to_string(page.jobs.back().created_ms) + "." + page.jobs.back().id;
    }
    for (Job& job : page.jobs) KILN_DO(read_lists(db, job));
    return page;
  });
}

Result<std::vector<Artifact>> SqlStore::find_result(const std::string& content_key) {
  return read([&](Connection& db) { return find_result_in(db, content_key); });
}

Result<StoreCounts> SqlStore::counts() {
  return read([&](Connection& db) -> Result<StoreCounts> {
    StoreCounts counts;
    KILN_TRY(rows, db.query("SELECT state, count(*), min(created_at) FROM job WHERE parent IS NULL GROUP BY state"));
    for (const Row& row : rows) {
      const auto number = static_cast<std::uint64_t>(row.integer(1));
      switch (parse_job_state(row.text(0)).value_or(JobState::queued)) {
        case JobState::queued:
          counts.queued = number;
          counts.oldest_queued_ms = row.integer(2);
          break;
        case JobState::running:
          counts.running = number;
          break;
        case JobState::succeeded:
          counts.succeeded = number;
          break;
        case JobState::failed:
          counts.failed = number;
          break;
        case JobState::canceled:
          counts.canceled = number;
          break;
      }
    }
    KILN_TRY(pinned, db.query("SELECT count(*) FROM job WHERE pinned=1"));
    counts.pinned = static_cast<std::uint64_t>(pinned.front().integer(0));
    KILN_TRY(deliveries, db.query("SELECT count(*) FROM delivery"));
    counts.deliveries = static_cast<std::uint64_t>(deliveries.front().integer(0));
    return counts;
  });
}

Result<std::optional<Millis>> SqlStore::next_due() {
  return read([&](Connection& db) -> Result<std::optional<Millis>> {
    KILN_TRY(rows, db.query("SELECT min(run_after) FROM job WHERE state='queued'"));
    if (rows.front().is_null(0)) return std::nullopt;
    KILN_TRY(now, db.now_ms());
    return Millis(std::max<std::int64_t>(0, rows.front().integer(0) - now));
  });
}

Result<std::vector<JobEvent>> SqlStore::events_after(std::uint64_t after, const std::string& job_id, int limit) {
  return read([&](Connection& db) -> Result<std::vector<JobEvent>> {
    std::string statement =
        "SELECT e.id, e.job_id, e.at, e.kind, e.state, e.message, a.name, a.media_type, a.sha256, a.bytes "
        "FROM job_event e LEFT JOIN artifact a ON a.job_id=e.job_id AND a.name=e.message AND e.kind='artifact' "
        "WHERE e.id>?";
    std::vector<Value> values{value_of(after)};
    if (job_id.empty()) {
      statement += " AND NOT EXISTS(SELECT 1 FROM job part WHERE part.id=e.job_id AND part.parent IS NOT NULL)";
    } else {
      statement += " AND e.job_id=?";
      values.push_back(value_of(job_id));
    }
    values.push_back(value_of(limit));
    KILN_TRY(rows, db.ask(statement + " ORDER BY e.id LIMIT ?", values));
    std::vector<JobEvent> events;
    for (const Row& row : rows) events.push_back(read_event(row));
    return events;
  });
}

Result<std::uint64_t> SqlStore::last_event_id() {
  return read([&](Connection& db) -> Result<std::uint64_t> {
    KILN_TRY(rows, db.query("SELECT coalesce(max(id), 0) FROM job_event"));
    return static_cast<std::uint64_t>(rows.front().integer(0));
  });
}

Result<void> SqlStore::log(const std::string& job_id, const std::string& line) {
  return write([&](Connection& db, std::int64_t now) -> Result<void> {
    KILN_TRY(job, find_job(db, job_id, engine_->keep_rows(false)));
    if (!job) return {};  // removed meanwhile: nobody reads its log
    KILN_DO(append_event(db, {job_id, EventKind::log, job->state, line}, now));
    return {};
  });
}

Result<std::string> SqlStore::identity() {
  return read([&](Connection& db) -> Result<std::string> {
    KILN_TRY(rows, db.query("SELECT id FROM identity"));
    return rows.empty() ? std::string() : rows.front().text(0);
  });
}

Result<void> SqlStore::check_writable() {
  return write([&](Connection& db, std::int64_t now) -> Result<void> {
    KILN_DO(db.run("UPDATE counter SET value=? WHERE name='ready'", now));
    return {};
  });
}

}  // namespace kiln::sql
