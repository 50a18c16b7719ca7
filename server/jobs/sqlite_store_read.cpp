// What people ask: one job, pages of jobs, events; and the table of blobs.

#include <algorithm>
#include <charconv>

#include "server/jobs/sqlite_store_impl.h"

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

Result<Rows> query_page(Database& db, const JobQuery& query, int limit) {
  std::string statement = std::string("SELECT ") + kJobColumns + " FROM job WHERE 1";
  if (query.state) statement += " AND state=?1";
  if (query.label) statement += " AND label=?2";
  if (!query.cursor.empty()) statement += " AND (created_at, id)<(?3, ?4)";
  statement += " ORDER BY created_at DESC, id DESC LIMIT ?5";
  Cursor cursor;
  if (!query.cursor.empty()) {
    KILN_TRY(parsed, parse_cursor(query.cursor));
    cursor = std::move(parsed);
  }
  const std::string_view state = query.state ? to_string(*query.state) : "";
  return db.query(statement.c_str(), state, query.label.value_or(""), cursor.created_ms, cursor.id, limit);
}

JobEvent read_event(const Rows& row) {
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

Result<std::vector<Artifact>> find_result_in(Database& db, const std::string& content_key) {
  KILN_TRY(rows, db.query("SELECT id FROM job WHERE content_key=? AND state='succeeded' AND finished_at IS NOT NULL "
                          "ORDER BY finished_at DESC LIMIT 1",
                          content_key));
  KILN_TRY(found, rows.next());
  if (!found) return std::vector<Artifact>{};
  return find_artifacts(db, rows.text(0));
}

Result<Job> SqliteStore::get(const std::string& id) {
  return read([&]() -> Result<Job> {
    KILN_TRY(job, find_job(reader_, id));
    if (!job) return fault("not_found", "there is no such job");
    return *job;
  });
}

Result<JobPage> SqliteStore::list(const JobQuery& query) {
  return read([&]() -> Result<JobPage> {
    const int limit = std::clamp(query.limit, 1, kMaxPage);
    KILN_TRY(rows, query_page(reader_, query, limit + 1));  // one more tells whether there is a next page
    JobPage page;
    while (true) {
      KILN_TRY(more, rows.next());
      if (!more) break;
      page.jobs.push_back(read_job(rows));
    }
    if (page.jobs.size() > static_cast<std::size_t>(limit)) {
      page.jobs.pop_back();
      page.next_cursor = std::to_string(page.jobs.back().created_ms) + "." + page.jobs.back().id;
    }
    for (Job& job : page.jobs) KILN_DO(read_lists(reader_, job));
    return page;
  });
}

Result<std::vector<Artifact>> SqliteStore::find_result(const std::string& content_key) {
  return read([&] { return find_result_in(reader_, content_key); });
}

Result<StoreCounts> SqliteStore::counts() {
  return read([&]() -> Result<StoreCounts> {
    StoreCounts counts;
    KILN_TRY(rows, reader_.query("SELECT state, count(*), min(created_at) FROM job GROUP BY state"));
    while (true) {
      KILN_TRY(more, rows.next());
      if (!more) return counts;
      const auto number = static_cast<std::uint64_t>(rows.integer(1));
      switch (parse_job_state(rows.text(0)).value_or(JobState::queued)) {
        case JobState::queued:
          counts.queued = number;
          counts.oldest_queued_ms = rows.integer(2);
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
  });
}

Result<std::optional<Millis>> SqliteStore::next_due() {
  return read([&]() -> Result<std::optional<Millis>> {
    KILN_TRY(rows, reader_.query("SELECT min(run_after) FROM job WHERE state='queued'"));
    KILN_DO(rows.next());
    if (rows.is_null(0)) return std::nullopt;
    return Millis(std::max<std::int64_t>(0, rows.integer(0) - now_ms_()));
  });
}

Result<std::vector<JobEvent>> SqliteStore::events_after(std::uint64_t after, const std::string& job_id, int limit) {
  return read([&]() -> Result<std::vector<JobEvent>> {
    std::string statement =
        "SELECT e.id, e.job_id, e.at, e.kind, e.state, e.message, a.name, a.media_type, a.sha256, a.bytes "
        "FROM job_event e LEFT JOIN artifact a ON a.job_id=e.job_id AND a.name=e.message AND e.kind='artifact' "
        "WHERE e.id>?1";
    if (!job_id.empty()) statement += " AND e.job_id=?2";
    statement += " ORDER BY e.id LIMIT ?3";
    KILN_TRY(rows, reader_.query(statement.c_str(), after, job_id, limit));
    std::vector<JobEvent> events;
    while (true) {
      KILN_TRY(more, rows.next());
      if (!more) return events;
      events.push_back(read_event(rows));
    }
  });
}

Result<std::uint64_t> SqliteStore::last_event_id() {
  return read([&]() -> Result<std::uint64_t> {
    KILN_TRY(rows, reader_.query("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name='job_event'"));
    KILN_DO(rows.next());
    return static_cast<std::uint64_t>(rows.integer(0));
  });
}

Result<void> SqliteStore::log(const std::string& job_id, const std::string& line) {
  return write([&](std::int64_t now) -> Result<void> {
    KILN_TRY(job, find_job(writer_, job_id));
    if (!job) return {};  // removed meanwhile: nobody reads its log
    KILN_DO(append_event(writer_, {job_id, EventKind::log, job->state, line}, now));
    return {};
  });
}

Result<void> SqliteStore::touch_blob(const std::string& sha256, std::uint64_t bytes) {
  return write([&](std::int64_t now) -> Result<void> {
    KILN_DO(writer_.run("INSERT INTO blob VALUES(?,?,?) ON CONFLICT DO UPDATE SET last_ref_at=excluded.last_ref_at",
                        sha256, bytes, now));
    return {};
  });
}

Result<bool> SqliteStore::knows_blob(const std::string& sha256) {
  return read([&]() -> Result<bool> {
    KILN_TRY(rows, reader_.query("SELECT 1 FROM blob WHERE sha256=?", sha256));
    return rows.next();
  });
}

Result<std::vector<std::string>> SqliteStore::forget_unused_blobs(Millis grace) {
  return write([&](std::int64_t now) -> Result<std::vector<std::string>> {
    std::vector<std::string> forgotten;
    KILN_TRY(rows, writer_.query("DELETE FROM blob WHERE last_ref_at<? "
                                 "AND NOT EXISTS(SELECT 1 FROM job_input i WHERE i.sha256=blob.sha256) "
                                 "AND NOT EXISTS(SELECT 1 FROM artifact a WHERE a.sha256=blob.sha256) "
                                 "RETURNING sha256",
                                 now - grace.count()));
    while (true) {
      KILN_TRY(more, rows.next());
      if (!more) return forgotten;
      forgotten.push_back(rows.text(0));
    }
  });
}

Result<void> SqliteStore::check_writable() {
  return write([&](std::int64_t now) -> Result<void> {
    KILN_DO(writer_.run("UPDATE counter SET value=? WHERE name='ready'", now));
    return {};
  });
}

}  // namespace kiln::sql
