#include "tests/bench/trade/row.h"

#include <charconv>
#include <functional>
#include <nlohmann/json.hpp>

namespace kiln::trade {
namespace {

/// A column reads and writes one member.
struct Column {
  std::string name;
  std::function<std::string(const Row&)> text;
  std::function<bool(const std::string&, Row&)> read;
};

template <class T>
std::string text_of(const T& value) {
  if constexpr (std::is_same_v<T, std::string>) {
    return value;
  } else {
    char out[32];
    if constexpr (std::is_floating_point_v<T>)
      return {out, std::to_chars(out, out + sizeof out, value, std::chars_format::general, 6).ptr};
    else
      return {out, std::to_chars(out, out + sizeof out, value).ptr};
  }
}

template <class T>
bool read(const std::string& text, T& value) {
  if constexpr (std::is_same_v<T, std::string>) {
    value = text;
    return true;
  } else {
    const char* end = text.data() + text.size();
    const auto [stop, problem] = std::from_chars(text.data(), end, value);
    return problem == std::errc() && stop == end;
  }
}

template <class T>
Column column(const char* name, T Row::*member) {
  return {name, [member](const Row& row) { return text_of(row.*member); },
          [member](const std::string& text, Row& row) { return read(text, row.*member); }};
}

void add_error(std::vector<Column>& all, const std::string& name, Error Row::*member) {
  const auto add = [&](const std::string& full, double Error::*part) {
    all.push_back({full, [=](const Row& row) { return text_of(row.*member.*part); },
                   [=](const std::string& text, Row& row) { return read(text, row.*member.*part); }});
  };
  add(name, &Error::relrmse);
  add(name + "_low", &Error::low);
  add(name + "_high", &Error::high);
}

const std::vector<Column>& columns() {
  static const std::vector<Column> all = [] {
    std::vector<Column> c = {
        column("engine", &Row::engine),
        column("scene", &Row::scene),
        column("scene_sha256", &Row::scene_sha256),
        column("setting", &Row::setting),
        column("threads", &Row::threads),
        column("seconds", &Row::seconds),
        column("cpu_seconds", &Row::cpu_seconds),
        column("rays", &Row::rays),
        column("peak_memory_bytes", &Row::peak_memory_bytes),
        column("artifact_bytes", &Row::artifact_bytes),
        column("triangles", &Row::triangles),
        column("vertices", &Row::vertices),
    };
    add_error(c, "relrmse", &Row::all);
    add_error(c, "relrmse_seen", &Row::seen);
    add_error(c, "relrmse_job_light", &Row::job_light);
    add_error(c, "certified", &Row::certified);
    for (Column& more : std::vector<Column>{
             column("predicted_seconds", &Row::predicted_seconds), column("predicted_rays", &Row::predicted_rays),
             column("predicted_memory_bytes", &Row::predicted_memory_bytes),
             column("predicted_bytes", &Row::predicted_bytes), column("predicted_vertices", &Row::predicted_vertices),
             column("parameters", &Row::parameters), column("recipe", &Row::recipe)})
      c.push_back(std::move(more));
    return c;
  }();
  return all;
}

}  // namespace

std::string key_of(const Row& row) {
  return row.engine + '\n' + row.scene + '\n' + row.scene_sha256 + '\n' + row.recipe;
}

int order_of(const Row& row) {
  const auto json = nlohmann::json::parse(row.parameters, nullptr, false);
  const bool known = json.is_object() && json.contains("order") && json["order"].is_number_integer();
  return known ? json["order"].get<int>() : 0;
}

const std::vector<std::string>& column_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const Column& c : columns()) out.push_back(c.name);
    return out;
  }();
  return names;
}

std::vector<std::string> fields_of(const Row& row) {
  std::vector<std::string> out;
  for (const Column& c : columns()) out.push_back(c.text(row));
  return out;
}

Result<Row> row_of(const std::vector<std::string>& fields) {
  if (fields.size() != columns().size())
    return fault("bad_row",
                 "has " + std::to_string(fields.size()) + " fields instead of " + std::to_string(columns().size()));
  Row row;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!columns()[i].read(fields[i], row)) return fault("bad_row", "is not a number: " + fields[i], columns()[i].name);
  }
  return row;
}

}  // namespace kiln::trade
