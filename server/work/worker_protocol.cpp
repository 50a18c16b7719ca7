#include "server/work/worker_protocol.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxText = 4096;  // of one text in a line,
constexpr std::size_t kMaxCheckpoint = 32768;

/// Text that may hold anything, as JSON that any reader takes.
std::string dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

json place_json(const NamedBlob& file, std::size_t place) {
  return {{"name", file.name}, {"sha256", file.sha256}, {"file", input_path(place)}};
}

NamedBlob read_place(const json& value) {
  return {value.at("name").get<std::string>(), value.at("sha256").get<std::string>()};
}

std::string short_text(const json& value) {
  auto text = value.get<std::string>();
  if (text.size() > kMaxText) text.resize(kMaxText);
  return text;
}

ProgressEvent read_progress(const json& value) {
  ProgressEvent event{short_text(value.at("stage")), value.at("done").get<std::uint64_t>(),
                      value.at("total").get<std::uint64_t>(), value.at("fraction").get<double>()};
  event.fraction = std::isfinite(event.fraction) ? std::clamp(event.fraction, 0.0, 1.0) : 0.0;
  if (value.contains("error")) event.error = std::max(0.0, value["error"].get<double>());
  return event;
}

struct LineWriter {
  json operator()(const ProgressEvent& e) const {
    json progress = {{"stage", e.stage}, {"done", e.done}, {"total", e.total}, {"fraction", e.fraction}};
    if (e.error) progress["error"] = *e.error;
    return {{"progress", std::move(progress)}};
  }
  json operator()(const WorkerArtifact& a) const {
    return {{"artifact", {{"name", a.name}, {"media_type", a.media_type}}}};
  }
  json operator()(const Fault& f) const {
    return {{"fault", {{"code", f.code}, {"message", f.message}, {"where", f.where}}}};
  }
  json operator()(const WorkerCheckpoint& c) const { return {{"checkpoint", c.text}}; }
  json operator()(const WorkerDone&) const { return {{"done", true}}; }
};

WorkerLine read_line(const json& line) {
  if (line.contains("progress")) return read_progress(line["progress"]);
  if (line.contains("artifact")) {
    const json& value = line["artifact"];
    return WorkerArtifact{short_text(value.at("name")), short_text(value.at("media_type"))};
  }
  if (line.contains("checkpoint")) {
    WorkerCheckpoint checkpoint{line["checkpoint"].get<std::string>()};
    if (checkpoint.text.size() > kMaxCheckpoint) checkpoint.text.clear();
    return checkpoint;
  }
  if (line.contains("fault")) {
    const json& value = line["fault"];
    return Fault{short_text(value.at("code")), short_text(value.at("message")), short_text(value.at("where"))};
  }
  static_cast<void>(line.at("done").get<bool>());
  return WorkerDone{};
}

}  // namespace

std::string input_path(std::size_t place) { return "inputs/" + std::to_string(place); }

std::string order_json(const WorkerOrder& order) {
  std::size_t place = 0;
  json scene = place_json(order.inputs.scene, place);
  scene["main"] = input_path(place);
  scene["resources"] = json::array();
  for (const NamedBlob& file : order.inputs.resources) scene["resources"].push_back(place_json(file, ++place));
  json environment;
  if (order.inputs.environment) environment = place_json(*order.inputs.environment, ++place);
  return dump({{"scene", scene},
               {"environment", environment},
               {"recipe", order.recipe},
               {"mode", order.mode == WorkerMode::plan ? "plan" : "bake"},
               {"threads", order.threads},
               {"parent", order.parent},
               {"checkpoint", order.checkpoint},
               {"require_sandbox", order.require_sandbox}});
}

Result<WorkerOrder> parse_order(std::string_view text) try {
  const json value = json::parse(text);
  WorkerOrder order;
  order.inputs.scene = read_place(value.at("scene"));
  for (const json& file : value.at("scene").at("resources")) order.inputs.resources.push_back(read_place(file));
  if (!value.at("environment").is_null()) order.inputs.environment = read_place(value.at("environment"));
  order.recipe = value.at("recipe").get<std::string>();
  order.mode = value.at("mode") == "plan" ? WorkerMode::plan : WorkerMode::bake;
  order.threads = value.at("threads").get<int>();
  order.parent = value.at("parent").get<int>();
  order.checkpoint = value.at("checkpoint").get<std::string>();
  order.require_sandbox = value.at("require_sandbox").get<bool>();
  return order;
} catch (const json::exception&) {
  return fault("internal", "the worker did not understand its order");
}

std::string line_json(const WorkerLine& line) { return dump(std::visit(LineWriter{}, line)) + "\n"; }

std::optional<WorkerLine> parse_line(std::string_view line) try {
  const json value = json::parse(line);
  if (!value.is_object() || value.size() != 1) return std::nullopt;
  return read_line(value);
} catch (const json::exception&) {
  return std::nullopt;
}

bool is_artifact_name(std::string_view name) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         name.find_first_not_of(kLetters) == std::string_view::npos;
}

}  // namespace kiln
