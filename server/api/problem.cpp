#include "server/api/problem.h"

#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <utility>

namespace kiln {
namespace {

using json = nlohmann::ordered_json;  // what a person reads first comes first

constexpr std::pair<std::string_view, int> kStatusOfCode[] = {
    {"malformed_request", 400},
    {"malformed_json", 400},
    {"malformed_multipart", 400},
    {"bad_cursor", 400},
    {"bad_query", 400},
    {"bad_header", 400},
    {"incomplete_body", 400},
    {"unauthorized", 401},
    {"cross_origin", 403},
    {"forbidden", 403},
    {"not_found", 404},
    {"method_not_allowed", 405},
    {"timeout", 408},
    {"upload_busy", 409},
    {"offset_mismatch", 409},
    {"not_terminal", 409},
    {"pinned", 409},
    {"no_artifacts", 409},
    {"length_required", 411},
    {"tus_version", 412},
    {"too_large", 413},
    {"uri_too_long", 414},
    {"unsupported_media_type", 415},
    {"unsupported_encoding", 415},
    {"range_not_satisfiable", 416},
    {"expectation_failed", 417},
    {"misdirected", 421},
    {"queue_full", 429},
    {"plan_busy", 429},
    {"quota", 429},
    {"daily_quota", 429},
    {"rate_limited", 429},
    {"header_too_large", 431},
    {"checksum_mismatch", 460},  // as tus has it
    {"internal", 500},
    {"store_failed", 500},
    {"io_failed", 500},
    {"blobs_refused", 500},
    {"not_implemented", 501},
    {"overloaded", 503},
    {"draining", 503},
    {"store_unavailable", 503},
    {"blobs_unavailable", 503},
    {"not_ready", 503},
    {"version_not_supported", 505},
    {"disk_full", 507},
};

std::string dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

json error_object(const FieldError& error) {
  json object = {{"pointer", error.pointer}, {"detail", error.detail}};
  if (!error.received.empty()) {
    const json received = json::parse(error.received, nullptr, false);
    object["received"] = received.is_discarded() ? json(error.received) : received;
  }
  if (!error.allowed.empty()) object["allowed"] = error.allowed;
  return object;
}

std::string text_at(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) return {};
  return found->is_string() ? found->get<std::string>() : dump(*found);
}

std::vector<FieldError> read_errors(const json& object) {
  std::vector<FieldError> errors;
  const auto list = object.find("errors");
  if (list == object.end() || !list->is_array()) return errors;
  for (const json& item : *list) {
    if (!item.is_object()) continue;
    errors.push_back({text_at(item, "pointer"), text_at(item, "detail"),
                      item.contains("received") ? dump(item["received"]) : std::string(), text_at(item, "allowed")});
  }
  return errors;
}

std::string code_of_type(std::string_view type) {
  const std::string_view base = kProblemBase;
  return std::string(type.starts_with(base) ? type.substr(base.size()) : type);
}

}  // namespace

int status_of_code(std::string_view code) {
  for (const auto& [known, status] : kStatusOfCode)
    if (known == code) return status;
  return 422;
}

Problem make_problem(std::string code, std::string detail, std::vector<FieldError> errors) {
  Problem problem;
  problem.status = status_of_code(code);
  problem.code = std::move(code);
  problem.detail = std::move(detail);
  problem.errors = std::move(errors);
  return problem;
}

Problem problem_of(const Fault& fault) {
  Problem problem = make_problem(fault.code, fault.message);
  problem.where = fault.where;
  return problem;
}

std::string problem_title(std::string_view code) {
  std::string title(code);
  for (char& c : title)
    if (c == '_') c = ' ';
  if (!title.empty()) title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  return title;
}

std::string problem_json(const Problem& problem) {
  json object = {{"type", kProblemBase + problem.code},
                 {"title", problem_title(problem.code)},
                 {"status", problem.status},
                 {"detail", problem.detail}};
  if (!problem.request_id.empty()) object["request_id"] = problem.request_id;
  if (!problem.where.empty()) object["where"] = problem.where;
  for (const FieldError& error : problem.errors) object["errors"].push_back(error_object(error));
  return dump(object);
}

Result<Problem> parse_problem(std::string_view text) {
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) return fault("not_a_problem", "the reply is no problem document");
  Problem problem;
  problem.code = code_of_type(text_at(object, "type"));
  problem.status = object.contains("status") && object["status"].is_number_integer() ? object["status"].get<int>() : 0;
  problem.detail = text_at(object, "detail");
  problem.request_id = text_at(object, "request_id");
  problem.where = text_at(object, "where");
  problem.errors = read_errors(object);
  return problem;
}

}  // namespace kiln
