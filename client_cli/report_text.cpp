#include "client_cli/report_text.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client_cli/terminal.h"

namespace kiln {
namespace {

using nlohmann::json;

json parsed(std::string_view text) {
  json document = json::parse(text, nullptr, false);
  return document.is_object() ? document : json::object();
}

double number_of(const json& object, const char* name) {
  return object.contains(name) && object[name].is_number() ? object[name].get<double>() : 0.0;
}

std::string text_of(const json& object, const char* name) {
  if (!object.is_object() || !object.contains(name)) return {};
  return object[name].is_string() ? object[name].get<std::string>() : object[name].dump();
}

json list_of(const json& object, const char* name) {
  return object.contains(name) && object[name].is_array() ? object[name] : json::array();
}

std::string count(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f", number);
  return text;
}

std::string error_text(const json& error) {
  std::string out = "relRMSE " + percent_text(number_of(error, "relrmse"));
  const json interval = list_of(error, "interval");
  if (interval.size() == 2 && interval[0].is_number() && interval[1].is_number())
    out += " (95 % interval " + percent_text(interval[0].get<double>()) + " .. " +
           percent_text(interval[1].get<double>()) + ")";
  return out;
}

json certificate_of(const json& document, const char* step) {
  const json::json_pointer place(std::string("/") + step + "/certificate");
  return document.contains(place) ? document[place] : json();
}

/// Of the vertices; of a lightmap alone there is none.
std::string vertices_text(const json& certificate) {
  if (!certificate.is_object()) return {};
  std::string out = error_text(certificate) + ", without worst 1 % " +
                    percent_text(number_of(certificate, "relrmse_without_worst_1pct")) + ", 99th percentile " +
                    percent_text(number_of(certificate, "p99")) + ", bias " +
                    percent_text(number_of(certificate, "bias")) + ", at " + count(number_of(certificate, "points")) +
                    " points";
  if (certificate.contains("seen") && certificate["seen"].is_object())
    out += "\nwhere it can be seen (" + count(number_of(certificate["seen"], "points")) +
           " points): " + error_text(certificate["seen"]);
  if (certificate.contains("job_light") && certificate["job_light"].is_object()) {
    constexpr double kMuch = 0.5;  // of the mean light: shadows are in the wrong place, and what is dark looks black
    out += "\nunder the job's own light in full: " + error_text(certificate["job_light"]);
    if (number_of(certificate["job_light"], "relrmse") > std::max(kMuch, 2 * number_of(certificate, "relrmse")))
      out +=
          "\nits bands are too few for what the sky has of detail here, as a sun through a window; the step radiosity "
          "bakes one light in full";
  }
  return out;
}

/// What reduction cost, where it changed the model.
std::string reduction_text(const json& document) {
  const json reduce = document.value("reduce", json());
  if (!reduce.is_object() || reduce.value("unchanged", false) || !reduce.contains("error")) return {};
  constexpr double kFar = 0.01;  // of the diagonal: seen at a glance
  const double rms = number_of(reduce["error"], "rms");
  return "the model is " + percent_text(rms) + " of its diagonal from the reduced surface (RMS), " +
         percent_text(number_of(reduce["error"], "max")) + " where it is farthest" +
         (rms > kFar ? "; it needs more triangles than that: \"triangles\" of the step reduce" : "");
}

std::string prediction_text(const json& plan) {
  if (!plan.contains("prediction")) return {};
  const json& p = plan["prediction"];
  const std::string of = text_of(p, "of"), reason = text_of(p, "reason");
  const bool floor = text_of(p, "ended_by") == "floor";
  const std::string passes = p.contains("passes") ? ", " + count(number_of(p, "passes")) + " passes" : "";
  return (floor ? "it does not look as if the promise can be kept: " + reason + "\n" : "") + "predicted" +
         (of.empty() || of == "the bake" ? "" : " for " + of) + ": " + human_seconds(number_of(p, "seconds")) + ", " +
         human_bytes(number_of(p, "memory_bytes")) + " of memory, " + human_bytes(number_of(p, "artifact_bytes")) +
         " of result, " + count(number_of(p, "triangles")) + " triangles" + passes + "\n";
}

std::vector<std::string> warnings_of(const json& document) {
  std::vector<std::string> out;
  for (const json& warning : list_of(document, "warnings")) {
    const std::string where = text_of(warning, "where");
    out.push_back((where.empty() ? "" : where + ": ") + text_of(warning, "message") + " [" + text_of(warning, "code") +
                  "]");
  }
  return out;
}

}  // namespace

std::string plan_text(std::string_view text) {
  const json plan = parsed(text);
  std::string out;
  for (const json& decision : list_of(plan, "plan")) {
    char line[128];
    std::snprintf(line, sizeof line, "%-18s %-14s ", text_of(decision, "decision").c_str(),
                  text_of(decision, "value").c_str());
    out += line + text_of(decision, "reason") + "\n";
  }
  for (const std::string& warning : warnings_of(plan)) out += "warning: " + warning + "\n";
  return out + prediction_text(plan);
}

std::vector<std::string> report_warnings(std::string_view report) { return warnings_of(parsed(report)); }

std::string certificate_text(std::string_view report) {
  const json document = parsed(report), lightmap = certificate_of(document, "lightmap");
  std::string out = vertices_text(document.value("certificate", json()));
  if (lightmap.is_object())
    out += (out.empty() ? "" : "\n") + std::string("of the lightmap, at ") + count(number_of(lightmap, "points")) +
           " points that can be seen: " + error_text(lightmap) + "; its 8-bit image: " + error_text(lightmap["image"]);
  std::string reduced = reduction_text(document);
  if (out.empty()) return reduced;
  if (!reduced.empty()) out = reduced + "\n" + out;
  const json levels = document.contains("lightfield") ? list_of(document["lightfield"], "levels") : json::array();
  for (const json& level : levels) {
    if (!level.contains("certificate") || !level["certificate"].is_object()) continue;
    out += "\ntowards eyes, " + text_of(level, "file") + " (" + count(number_of(level, "triangles")) +
           " triangles): " + error_text(level["certificate"]);
  }
  if (const json links = certificate_of(document, "links"); links.is_object() && links.contains("of_rms")) {
    out += "\nof what lamps reflect, at " + count(number_of(links, "points")) +
           " points: " + percent_text(number_of(links, "of_rms")) + " of its root mean square";
  }
  if (const json grid = certificate_of(document, "grid"); grid.is_object())
    out += "\nof the grid, at " + count(number_of(grid, "points")) + " points of the surface: " + error_text(grid);
  return out;
}

std::string promise_text(std::string_view report) {
  const json document = parsed(report);
  if (!document.contains("promise") || !document["promise"].is_object()) return {};
  const json& promise = document["promise"];
  std::string out = text_of(promise, "reason") + " (" + count(static_cast<double>(list_of(promise, "passes").size())) +
                    " passes, " + human_seconds(number_of(document, "seconds")) + ")";
  if (!document.contains("error_sources")) return out;
  const json& sources = document["error_sources"];
  out += "\nof the error: noise " + percent_text(number_of(sources, "noise")) + " (of reflections " +
         percent_text(number_of(sources, "noise_of_reflections")) + "), " +
         (sources.contains("points") ? "points " + percent_text(number_of(sources, "points")) + ", " : "") +
         "interpolation " + percent_text(number_of(sources, "interpolation")) + ", bounces left out " +
         percent_text(number_of(sources, "bounce_tail")) + ", quantisation " +
         percent_text(number_of(sources, "quantisation")) + ", compression " +
         percent_text(number_of(sources, "compression"));
  return out;
}

bool promise_kept(std::string_view report) {
  const json document = parsed(report);
  return !document.contains("promise") || document["promise"].value("kept", true);
}

std::optional<double> certified_error(std::string_view report) {
  const json document = parsed(report);
  json certificate = document.value("certificate", json());
  if (!certificate.is_object()) certificate = certificate_of(document, "lightmap");
  if (!certificate.is_object() || !certificate.contains("relrmse") || !certificate["relrmse"].is_number())
    return std::nullopt;
  return std::max({certificate["relrmse"].get<double>(), number_of(certificate_of(document, "grid"), "relrmse"),
                   number_of(certificate_of(document, "lightmap"), "relrmse"),
                   number_of(certificate_of(document, "lightfield"), "relrmse")});
}

}  // namespace kiln
