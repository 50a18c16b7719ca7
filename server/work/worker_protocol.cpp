#include "server/work/worker_protocol.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kiln {

NLOHMANN_JSON_SERIALIZE_ENUM(WorkerMode,
                             {{WorkerMode::bake, "bake"}, {WorkerMode::plan, "plan"}, {WorkerMode::part, "part"}})

namespace {

using nlohmann::json;

constexpr std::size_t kMaxText = 4096;  // of one text in a line,
constexpr std::size_t kMaxCheckpoint = 32768;
constexpr std::size_t kMaxCuts = 1024;

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

/// A whole number that a worker gives: any other JSON would be converted to one.
std::uint64_t whole(const json& value) {
  if (!value.is_number_unsigned()) throw json::other_error::create(501, "not a count", &value);
  return value.get<std::uint64_t>();
}

json range_json(const LoopRange& range) { return {{"loop", range.loop}, {"first", range.first}, {"last", range.last}}; }

LoopRange read_range(const json& value) {
  const LoopRange range{whole(value.at("loop")), whole(value.at("first")), whole(value.at("last"))};
  if (range.first >= range.last) throw json::other_error::create(501, "an empty range", &value);
  return range;
}

WorkerShare read_share(const json& value) {
  WorkerShare share{whole(value.at("loop")), short_text(value.at("name")), whole(value.at("journal_bytes")), {}};
  for (const json& cut : value.at("cuts")) share.cuts.push_back(whole(cut));
  const bool sorted = std::is_sorted(share.cuts.begin(), share.cuts.end(), std::less_equal<>());
  if (share.cuts.size() < 2 || share.cuts.size() > kMaxCuts || !sorted)
    throw json::other_error::create(501, "cuts that are none", &value);
  return share;
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
  json operator()(const WorkerShare& s) const {
    return {{"share", {{"loop", s.loop}, {"name", s.name}, {"journal_bytes", s.journal_bytes}, {"cuts", s.cuts}}}};
  }
  json operator()(const WorkerNext& n) const { return {{"next", n.loop}}; }
  json operator()(const WorkerMade& m) const { return {{"made", {{"range", range_json(m.range)}, {"file", m.file}}}}; }
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
  if (line.contains("share")) return read_share(line["share"]);
  if (line.contains("next")) return WorkerNext{whole(line["next"])};
  if (line.contains("made")) {
    return WorkerMade{read_range(line["made"].at("range")), short_text(line["made"].at("file"))};
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
  json known = json::array();
  for (const LoopRange& range : order.known) known.push_back(range_json(range));
  return dump({{"scene", scene},
               {"environment", environment},
               {"recipe", order.recipe},
               {"mode", order.mode},
               {"share_s", order.sharing.least_s},
               {"share_repeats", order.sharing.repeats},
               {"known", known},
               {"journal", order.journal},
               {"range", order.range ? range_json(*order.range) : json()},
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
  order.mode = value.at("mode").get<WorkerMode>();
  order.sharing = {value.at("share_s").get<double>(), value.at("share_repeats").get<double>()};
  for (const json& range : value.at("known")) order.known.push_back(read_range(range));
  order.journal = value.at("journal").get<std::string>();
  if (!value.at("range").is_null()) order.range = read_range(value["range"]);
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

std::string reply_json(const RangeReply& reply) {
  return dump({{"range", range_json(reply.range)}, {"file", reply.file}}) + "\n";
}

Result<RangeReply> parse_reply(std::string_view line) try {
  const json value = json::parse(line);
  return RangeReply{read_range(value.at("range")), value.at("file").get<std::string>()};
} catch (const json::exception&) {
  return fault("internal", "the worker did not understand an answer");
}

std::string part_json(const PartOrder& order) {
  return dump({{"range", range_json(order.range)}, {"checkpoint", order.checkpoint}});
}

Result<PartOrder> parse_part(std::string_view text) try {
  const json value = json::parse(text);
  return PartOrder{read_range(value.at("range")), value.at("checkpoint").get<std::string>()};
} catch (const json::exception&) {
  return fault("internal", "this server does not understand the order of a part");
}

bool is_artifact_name(std::string_view name) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
  return !name.empty() && name.size() <= 64 && name.front() != '.' &&
         name.find_first_not_of(kLetters) == std::string_view::npos;
}

}  // namespace kiln
