#include "server/jobs/postgres_db.h"

#include <libpq-fe.h>
#include <poll.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace kiln::sql {
namespace {

using Clock = std::chrono::steady_clock;

// A statement ends by itself after 15 s at the server; whoever says nothing for 20 s is taken for gone.
constexpr const char* kSession =
    "SET statement_timeout='15s'; SET lock_timeout='10s'; SET idle_in_transaction_session_timeout='30s'; "
    "SET search_path=kiln";
constexpr std::chrono::seconds kAnswerWait{20};

/// `?` -> $1, $2, ... Our statements hold no question mark of their own.
std::string numbered(const std::string& statement) {
  std::string text;
  int number = 0;
  for (const char c : statement) {
    if (c == '?') {
      text += "$" + std::to_string(++number);
    } else {
      text += c;
    }
  }
  return text;
}

/// As the text that the server reads. PostgreSQL holds no NUL in a text: such a one becomes U+FFFD.
std::string text_of(const Value& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return std::to_string(*number);
  if (const auto* real = std::get_if<double>(&value)) {
    std::array<char, 32> digits{};
    std::snprintf(digits.data(), digits.size(), "%.17g", *real);
    return digits.data();
  }
  std::string text;
  for (const char c : std::get<std::string>(value)) {
    if (c == '\0') {
      text += "\xEF\xBF\xBD";
    } else {
      text += c;
    }
  }
  return text;
}

Value cell_of(const PGresult* result, int row, int column) {
  constexpr Oid kInt8 = 20, kInt2 = 21, kInt4 = 23, kFloat8 = 701;
  if (PQgetisnull(result, row, column) != 0) return nullptr;
  const char* text = PQgetvalue(result, row, column);
  switch (PQftype(result, column)) {
    case kInt8:
    case kInt2:
    case kInt4:
      return std::int64_t{std::strtoll(text, nullptr, 10)};
    case kFloat8:
      return std::strtod(text, nullptr);
    default:
      return std::string(text, static_cast<std::size_t>(PQgetlength(result, row, column)));
  }
}

Rows rows_of(PGresult* result) {
  Rows rows;
  for (int row = 0; row < PQntuples(result); ++row) {
    std::vector<Value> cells;
    for (int column = 0; column < PQnfields(result); ++column) cells.push_back(cell_of(result, row, column));
    rows.all.emplace_back(std::move(cells));
  }
  rows.changed = std::atoi(PQcmdTuples(result));
  return rows;
}

/// The server ends, refuses or follows another: it will be back, or another will.
bool means_gone(std::string_view state) {
  return state.starts_with("08") || state.starts_with("57P") || state == "25006" || state == "53300";
}

}  // namespace

void PostgresConnection::Clear::operator()(pg_result* result) const { PQclear(result); }

Result<std::unique_ptr<PostgresConnection>> PostgresConnection::open(const PostgresOptions& options) {
  constexpr std::array keys{
      "connect_timeout", "tcp_user_timeout",     "application_name", "dbname",
      "client_encoding", "target_session_attrs", "keepalives_idle",  static_cast<const char*>(nullptr)};
  const std::array values{"5",    "15000",      "kilnd", options.address.c_str(),
                          "UTF8", "read-write", "10",    static_cast<const char*>(nullptr)};
  std::unique_ptr<PostgresConnection> connection(
      new PostgresConnection(PQconnectdbParams(keys.data(), values.data(), 1), options.now_ms));
  if (PQstatus(connection->handle_) != CONNECTION_OK) return connection->lost();
  PQsetNoticeProcessor(
      connection->handle_, [](void*, const char*) {}, nullptr);
  PQsetnonblocking(connection->handle_, 1);
  KILN_DO(connection->check_settings());
  return connection;
}

PostgresConnection::~PostgresConnection() { PQfinish(handle_); }

Result<void> PostgresConnection::check_settings() {
  KILN_DO(execute(kSession));
  for (const char* setting : {"synchronous_commit", "fsync"}) {
    KILN_TRY(rows, query("SELECT current_setting(?)", setting));
    if (rows.front().text(0) != "off") continue;
    return fault("store_unsafe",
                 std::string("PostgreSQL runs with ") + setting + "=off: it would forget jobs that were acknowledged");
  }
  return {};
}

tl::unexpected<Fault> PostgresConnection::lost() {
  trouble_ = Trouble::lost;
  return fault("store_unavailable", "the job store does not answer");
}

tl::unexpected<Fault> PostgresConnection::failed(const pg_result* result) {
  const char* field = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const std::string state = field == nullptr ? "" : field;
  if (state.empty() || means_gone(state) || PQstatus(handle_) != CONNECTION_OK) return lost();
  // 40: deadlock, serialisation; 23503, 23505: a row or a key that another program wrote or removed at this moment.
  const bool again = state.starts_with("40") || state == "23503" || state == "23505";
  trouble_ = again ? Trouble::again : Trouble::other;
  if (state == "53100") return fault("disk_full", "the job store has no space left");
  if (state == "57014" || state == "55P03") return fault("store_unavailable", "the job store is too slow to answer");
  return fault("store_failed", "the job store failed with SQLSTATE " + state);
}

/// Sends what waits and takes what comes until an answer is whole; false when the time is over.
Result<bool> PostgresConnection::wait_ready() {
  const auto deadline = Clock::now() + kAnswerWait;
  while (true) {
    const int unsent = PQflush(handle_);
    if (unsent < 0) return lost();
    if (unsent == 0 && PQisBusy(handle_) == 0) return true;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd socket{PQsocket(handle_), static_cast<short>(unsent > 0 ? POLLIN | POLLOUT : POLLIN), 0};
    if (::poll(&socket, 1, static_cast<int>(left)) < 0 && errno != EINTR) return lost();
    if (PQconsumeInput(handle_) == 0) return lost();
  }
}

Result<PostgresConnection::Answer> PostgresConnection::wait_answer() {
  Answer last;
  while (true) {
    KILN_TRY(ready, wait_ready());
    if (!ready) {
      PQfinish(std::exchange(handle_, nullptr));  // what it was asked for may still happen, but not for us
      return lost();
    }
    Answer next(PQgetResult(handle_));
    if (!next) break;
    const ExecStatusType status = PQresultStatus(next.get());
    const bool good = status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK;
    if (!last || !good) last = std::move(next);
  }
  if (!last) return lost();
  const ExecStatusType status = PQresultStatus(last.get());
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) return failed(last.get());
  return last;
}

Result<Rows> PostgresConnection::ask(const std::string& statement, const std::vector<Value>& values) {
  trouble_ = Trouble::none;
  std::vector<std::string> texts;
  for (const Value& value : values) {
    texts.push_back(std::holds_alternative<std::nullptr_t>(value) ? std::string() : text_of(value));
  }
  std::vector<const char*> pointers;
  for (std::size_t i = 0; i < values.size(); ++i) {
    pointers.push_back(std::holds_alternative<std::nullptr_t>(values[i]) ? nullptr : texts[i].c_str());
  }
  const int count = static_cast<int>(values.size());
  const std::string text = numbered(statement);
  if (handle_ == nullptr ||
      PQsendQueryParams(handle_, text.c_str(), count, nullptr, pointers.data(), nullptr, nullptr, 0) == 0) {
    return lost();
  }
  KILN_TRY(answer, wait_answer());
  return rows_of(answer.get());
}

Result<void> PostgresConnection::execute(const std::string& statements) {
  trouble_ = Trouble::none;
  if (handle_ == nullptr || PQsendQuery(handle_, statements.c_str()) == 0) return lost();
  KILN_DO(wait_answer());
  return {};
}

Result<std::int64_t> PostgresConnection::now_ms() {
  if (now_ms_) return now_ms_();
  KILN_TRY(rows, query("SELECT (extract(epoch FROM clock_timestamp()) * 1000)::bigint"));
  return rows.front().integer(0);
}

bool PostgresConnection::idle() const {
  return handle_ != nullptr && PQstatus(handle_) == CONNECTION_OK && PQtransactionStatus(handle_) == PQTRANS_IDLE;
}

Result<bool> PostgresConnection::take_notices() {
  if (handle_ == nullptr || PQconsumeInput(handle_) == 0) return lost();
  bool any = false;
  while (PGnotify* notice = PQnotifies(handle_)) {
    PQfreemem(notice);
    any = true;
  }
  return any;
}

int PostgresConnection::descriptor() const { return handle_ == nullptr ? -1 : PQsocket(handle_); }

}  // namespace kiln::sql

namespace kiln {

bool has_password(const std::string& postgres_address) {
  PQconninfoOption* options = PQconninfoParse(postgres_address.c_str(), nullptr);
  bool found = false;
  for (const PQconninfoOption* option = options; option != nullptr && option->keyword != nullptr; ++option) {
    found = found || (std::string_view(option->keyword) == "password" && option->val != nullptr);
  }
  PQconninfoFree(options);
  return found;
}

}  // namespace kiln
