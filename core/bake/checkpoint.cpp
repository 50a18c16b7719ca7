#include "core/bake/checkpoint.h"

#include <nlohmann/json.hpp>

#include "core/bake/bake.h"

namespace kiln {
namespace {

using nlohmann::json;

json optional_json(const std::optional<double>& x) { return x ? json(*x) : json(nullptr); }

std::optional<double> optional_number(const json& value) {
  return value.is_null() ? std::nullopt : std::optional(value.get<double>());
}

json record_json(const PassRecord& p) {
  const ErrorSources& s = p.sources;
  return {{"order", p.order},
          {"samples", p.samples},
          {"bounce_samples", p.bounce_samples},
          {"bounces", p.bounces},
          {"triangles", p.triangles},
          {"vertices", p.vertices},
          {"rays", p.rays},
          {"bounce_rays", p.bounce_rays},
          {"points", p.points},
          {"gathered", p.gathered},
          {"seconds", p.seconds},
          {"certificate_seconds", p.certificate_seconds},
          {"elapsed_s", p.elapsed_s},
          {"relrmse", p.relrmse},
          {"interval", {p.low, p.high}},
          {"own_relrmse", optional_json(p.own_relrmse)},
          {"own_high", optional_json(p.own_high)},
          {"sources",
           {s.noise, s.noise_of_reflections, s.bounce_tail, s.quantisation, s.compression, s.interpolation, s.merging,
            s.points}},
          {"truncation", optional_json(s.truncation)}};
}

PassRecord read_record(const json& value) {
  const json& s = value.at("sources");
  return {.order = value.at("order").get<int>(),
          .samples = value.at("samples").get<int>(),
          .bounce_samples = value.at("bounce_samples").get<int>(),
          .bounces = value.at("bounces").get<int>(),
          .triangles = value.at("triangles").get<std::uint64_t>(),
          .vertices = value.at("vertices").get<std::uint64_t>(),
          .rays = value.at("rays").get<std::uint64_t>(),
          .bounce_rays = value.at("bounce_rays").get<std::uint64_t>(),
          .seconds = value.at("seconds").get<double>(),
          .certificate_seconds = value.at("certificate_seconds").get<double>(),
          .elapsed_s = value.at("elapsed_s").get<double>(),
          .points = value.at("points").get<std::uint64_t>(),
          .gathered = value.at("gathered").get<std::uint64_t>(),
          .relrmse = value.at("relrmse").get<double>(),
          .low = value.at("interval").at(0).get<double>(),
          .high = value.at("interval").at(1).get<double>(),
          .own_relrmse = optional_number(value.at("own_relrmse")),
          .own_high = optional_number(value.at("own_high")),
          .sources = {.noise = s.at(0).get<double>(),
                      .noise_of_reflections = s.at(1).get<double>(),
                      .bounce_tail = s.at(2).get<double>(),
                      .quantisation = s.at(3).get<double>(),
                      .compression = s.at(4).get<double>(),
                      .interpolation = s.at(5).get<double>(),
                      .merging = s.at(6).get<double>(),
                      .points = s.at(7).get<double>(),
                      .truncation = optional_number(value.at("truncation"))}};
}

}  // namespace

std::string checkpoint_json(std::span<const PassRecord> passes) {
  json list = json::array();
  for (const PassRecord& pass : passes) list.push_back(record_json(pass));
  return json{{"engine", kEngineVersion}, {"passes", list}}.dump();
}

std::vector<PassRecord> parse_checkpoint(std::string_view text) try {
  const json document = json::parse(text);
  if (document.at("engine") != kEngineVersion) return {};
  std::vector<PassRecord> out;
  for (const json& pass : document.at("passes")) out.push_back(read_record(pass));
  return out;
} catch (const json::exception&) {
  return {};
}

}  // namespace kiln
