#include "server/api/job_request.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "server/api/header_fields.h"

namespace kiln {
namespace {

using nlohmann::json;

std::string dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

/// Walks a document without building it: depth, member names, syntax.
class JsonCheck : public json::json_sax_t {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    if (names_.back().insert(name).second) return true;
    problem_ = make_problem("duplicate_member", "a member is given twice",
                            {{"", "is given twice", dump(json(name)), "each member once"}});
    return false;
  }
  bool parse_error(std::size_t position, const std::string&, const json::exception&) override {
    position_ = position;
    return false;
  }
  const Problem& problem() const { return problem_; }
  std::size_t position() const { return position_; }

 private:
  bool enter() {
    names_.emplace_back();
    if (names_.size() <= kMaxJsonDepth) return true;
    problem_ = make_problem("json_too_deep", "JSON may nest " + std::to_string(kMaxJsonDepth) + " levels deep");
    return false;
  }
  bool leave() {
    names_.pop_back();
    return true;
  }
  std::vector<std::set<std::string>> names_;
  Problem problem_;
  std::size_t position_ = 0;
};

std::string line_and_column(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, std::min(position, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t newline = before.rfind('\n');
  const std::size_t column = newline == std::string_view::npos ? before.size() : before.size() - newline - 1;
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

FieldError mistake(const char* pointer, const char* detail, const json& received, std::string allowed) {
  return {pointer, detail, dump(received), std::move(allowed)};
}

std::string preset_names() {
  std::string names;
  for (const Preset& preset : presets()) names += (names.empty() ? "" : ", ") + preset.name;
  return names;
}

const Preset* find_preset(const std::string& name) {
  for (const Preset& preset : presets())
    if (preset.name == name) return &preset;
  return nullptr;
}

/// Takes the member out of the document; null when absent.
json take(json& document, const char* name) {
  const auto found = document.find(name);
  if (found == document.end()) return nullptr;
  json value = std::move(*found);
  document.erase(found);
  return value;
}

/// Lays the document's own members over those of its preset.
void apply_preset(json& document, const json& name, std::vector<FieldError>& errors) {
  if (name.is_null()) return;
  const Preset* preset = name.is_string() ? find_preset(name.get<std::string>()) : nullptr;
  if (preset == nullptr) {
    errors.push_back(mistake("/preset", "must be the name of a preset", name, preset_names()));
    return;
  }
  json base = json::parse(preset->recipe);
  for (auto& [key, value] : document.items()) base[key] = value;
  document = std::move(base);
}

/// Rules of a request that a recipe alone does not have.
void check_sources(const Recipe& recipe, bool needs_scene, std::vector<FieldError>& errors) {
  if (needs_scene && recipe.scene_asset.empty())
    errors.push_back({"/scene/asset", "is missing", "", "the sha256 of an uploaded asset"});
  if (recipe.environment.kind == EnvironmentChoice::Kind::file)
    errors.push_back({"/environment/file", "is for the command line only", dump(json(recipe.environment.name)),
                      "asset, constant, builtin"});
}

/// Puts the hashes of the files where the document would name assets.
void apply_files(json& document, const JobFiles& files) {
  if (!files.scene.empty()) document["scene"] = {{"asset", files.scene}};
  if (files.environment.empty()) return;
  if (!document.contains("environment") || document["environment"].is_null()) document["environment"] = json::object();
  if (document["environment"].is_object()) document["environment"]["asset"] = files.environment;
}

Answer<JobRequest> parse_document(json document, const JobFiles& files, bool needs_scene) {
  std::vector<FieldError> errors;
  JobRequest request;
  const json force = take(document, "force");
  if (force.is_boolean()) request.force = force.get<bool>();
  if (!force.is_null() && !force.is_boolean())
    errors.push_back(mistake("/force", "must be true or false", force, "true, false"));
  apply_preset(document, take(document, "preset"), errors);
  apply_files(document, files);

  auto recipe = parse_recipe(dump(document));
  if (recipe)
    check_sources(*recipe, needs_scene, errors);
  else
    errors.insert(errors.end(), recipe.error().begin(), recipe.error().end());
  if (!errors.empty()) {
    const std::string count = std::to_string(errors.size()) + (errors.size() == 1 ? " mistake" : " mistakes");
    return refuse("invalid_recipe", "the job has " + count + "; each is listed in errors", std::move(errors));
  }
  request.recipe = std::move(*recipe);
  return request;
}

json number_or_text(const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end ? json(value) : json(text);
}

json environment_object(const std::string& text) {
  if (text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos) return {{"asset", text}};
  if (text.find(',') == std::string::npos) return {{"builtin", text}};
  json channels = json::array();
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    channels.push_back(number_or_text(text.substr(begin, comma - begin)));
    begin = comma + 1;
  }
  return {{"constant", std::move(channels)}};
}

json flag_or_text(const std::string& text) {
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return text;
}

}  // namespace

Answer<void> check_json(std::string_view text) {
  if (text.size() > kMaxJobDocument)
    return refuse("too_large", "a JSON document may have " + std::to_string(kMaxJobDocument) + " bytes");
  JsonCheck check;
  if (json::sax_parse(text, &check)) return {};
  if (!check.problem().code.empty()) return tl::make_unexpected(check.problem());
  return refuse("malformed_json", "the body is no valid JSON (UTF-8) at " + line_and_column(text, check.position()));
}

Answer<JobRequest> parse_job_request(std::string_view text, const JobFiles& files) {
  if (auto checked = check_json(text); !checked) return tl::make_unexpected(checked.error());
  json document = json::parse(text, nullptr, false);
  if (!document.is_object())
    return refuse("invalid_recipe", "the job must be an object",
                  {mistake("", "must be an object", document.type_name(), "object")});
  return parse_document(std::move(document), files, true);
}

Answer<JobRequest> parse_raw_request(const QueryParams& params, const JobFiles& files) {
  const std::vector<std::string> names = {"preset", "label", "environment", "force", "quality", "seed", "name"};
  auto values = take_params(params, names);
  if (!values) return tl::make_unexpected(values.error());
  const auto& value = *values;
  if (value[0].empty())
    return refuse("bad_query",
                  "an upload without a job document needs ?preset=", {{"?preset", "is missing", "", preset_names()}});
  json document = {{"preset", value[0]}};
  if (!value[1].empty()) document["label"] = value[1];
  if (!value[2].empty()) document["environment"] = environment_object(value[2]);
  if (!value[3].empty()) document["force"] = flag_or_text(value[3]);
  if (!value[4].empty()) document["quality"] = value[4];
  if (!value[5].empty()) {
    const auto seed = parse_decimal(value[5]);
    document["seed"] = seed ? json(*seed) : json(value[5]);
  }
  return parse_document(std::move(document), files, false);
}

Answer<std::vector<std::string>> take_params(const QueryParams& params, const std::vector<std::string>& allowed) {
  std::string names;
  for (const std::string& name : allowed) names += (names.empty() ? "" : ", ") + name;
  std::vector<std::string> values(allowed.size());
  std::set<std::string> seen;
  std::vector<FieldError> errors;
  for (const auto& [name, value] : params) {
    const auto found = std::find(allowed.begin(), allowed.end(), name);
    if (found == allowed.end())
      errors.push_back({"?" + name, "is not known here", dump(json(value)), names});
    else if (!seen.insert(name).second)
      errors.push_back({"?" + name, "is given twice", dump(json(value)), "once"});
    else
      values[static_cast<std::size_t>(found - allowed.begin())] = value;
  }
  if (!errors.empty())
    return refuse("bad_query", "the query has mistakes; each is listed in errors", std::move(errors));
  return values;
}

Answer<JobListRequest> parse_list_request(const QueryParams& params) {
  auto values = take_params(params, {"status", "label", "limit", "cursor"});
  if (!values) return tl::make_unexpected(values.error());
  JobListRequest request{(*values)[0], (*values)[1], 50, (*values)[3]};
  const std::set<std::string> states = {"", "queued", "running", "succeeded", "failed", "canceled"};
  std::vector<FieldError> errors;
  if (!states.contains(request.status))
    errors.push_back(
        {"?status", "is no state", dump(json(request.status)), "queued, running, succeeded, failed, canceled"});
  if (!(*values)[2].empty()) {
    const auto limit = parse_decimal((*values)[2]);
    if (limit && *limit >= 1 && *limit <= 200)
      request.limit = static_cast<int>(*limit);
    else
      errors.push_back({"?limit", "must be an integer from 1 to 200", dump(json((*values)[2])), "1 to 200"});
  }
  if (!errors.empty())
    return refuse("bad_query", "the query has mistakes; each is listed in errors", std::move(errors));
  return request;
}

}  // namespace kiln
