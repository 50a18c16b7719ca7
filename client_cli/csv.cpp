#include "client_cli/csv.h"

#include <algorithm>
#include <charconv>

namespace kiln {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t start = 0;;) {
    const auto comma = line.find(',', start);
    cells.push_back(trimmed(line.substr(start, comma - start)));
    if (comma == std::string_view::npos) return cells;
    start = comma + 1;
  }
}

std::optional<double> number_of(std::string_view cell) {
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

tl::unexpected<Failure> malformed(const std::string& name, std::size_t line, std::string what) {
  return fail(ExitCode::rejected, "malformed_csv", std::move(what), name + ": line " + std::to_string(line));
}

Outcome<void> add_row(CsvTable& table, std::string_view line, std::size_t number, const std::string& name) {
  const auto cells = cells_of(line);
  if (cells.size() != table.columns.size()) {
    return malformed(
        name, number,
        std::to_string(cells.size()) + " values where " + std::to_string(table.columns.size()) + " columns are named");
  }
  std::vector<double> row;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto value = number_of(cells[i]);
    if (!value)
      return malformed(name, number, table.columns[i] + " is not a number: " + std::string(cells[i].substr(0, 40)));
    row.push_back(*value);
  }
  table.rows.push_back(std::move(row));
  table.lines.push_back(number);
  return {};
}

/// Names the columns by the first line; true when that line holds names and no data.
Outcome<bool> take_names(CsvTable& table, std::string_view line, std::size_t number, const std::string& name,
                         const std::vector<std::string>& defaults) {
  const auto cells = cells_of(line);
  if (!number_of(cells[0])) {
    for (const auto cell : cells) table.columns.emplace_back(cell);
    return true;
  }
  if (cells.size() > defaults.size()) {
    return malformed(name, number,
                     std::to_string(cells.size()) + " values, but without a line of names there can be at most " +
                         std::to_string(defaults.size()));
  }
  table.columns.assign(defaults.begin(), defaults.begin() + static_cast<std::ptrdiff_t>(cells.size()));
  return false;
}

template <class T>
std::string shortest(T value) {
  char text[48];
  const auto result = std::to_chars(text, text + sizeof text, value);
  return {text, result.ptr};
}

}  // namespace

std::optional<std::size_t> CsvTable::find(std::string_view column) const {
  const auto found = std::find(columns.begin(), columns.end(), column);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

Outcome<CsvTable> parse_csv(std::string_view text, const std::string& name,
                            const std::vector<std::string>& default_columns) {
  CsvTable table;
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    if (table.columns.empty()) {
      KILN_TRY(names, take_names(table, line, number, name, default_columns));
      if (names) continue;
    }
    const Outcome<void> added = add_row(table, line, number, name);
    if (!added) return tl::make_unexpected(added.error());
  }
  return table;
}

std::string number_text(double value) { return shortest(value); }
std::string number_text(float value) { return shortest(value); }

}  // namespace kiln
