#include "tests/bench/trade/csv.h"

#include <filesystem>
#include <fstream>
#include <iterator>

namespace kiln::trade {
namespace {

std::string quoted(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string out = "\"";
  for (const char c : field) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

std::string csv_line(const std::vector<std::string>& fields) {
  std::string out;
  for (std::size_t i = 0; i < fields.size(); ++i) out += (i == 0 ? "" : ",") + quoted(fields[i]);
  return out;
}

std::vector<std::vector<std::string>> parse_csv(std::string_view text) {
  std::vector<std::vector<std::string>> lines;
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_quotes && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
      fields.back() += '"';
      ++i;
    } else if (c == '"') {
      in_quotes = !in_quotes;
    } else if (c == ',' && !in_quotes) {
      fields.emplace_back();
    } else if (c == '\n' && !in_quotes) {
      if (!fields.back().empty() && fields.back().back() == '\r') fields.back().pop_back();
      lines.push_back(std::move(fields));
      fields.assign(1, "");
    } else {
      fields.back() += c;
    }
  }
  return lines;
}

Result<std::vector<Row>> open_rows(const std::string& path) {
  std::vector<Row> rows;
  if (!std::filesystem::exists(path)) return rows;
  const std::string text = read_text(path);
  const std::size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
  if (whole < text.size()) std::filesystem::resize_file(path, whole);
  const auto lines = parse_csv(std::string_view(text).substr(0, whole));
  if (lines.empty()) return rows;
  if (lines.front() != column_names())
    return fault("other_columns", "was written by another version of this tool: move it away, or use --fresh", path);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    auto row = row_of(lines[i]);
    if (!row)
      return fault(row.error().code, row.error().message,
                   path + " line " + std::to_string(i + 1) + " " + row.error().where);
    rows.push_back(std::move(*row));
  }
  return rows;
}

Result<void> append_row(const std::string& path, const Row& row) {
  const bool fresh = !std::filesystem::exists(path) || std::filesystem::file_size(path) == 0;
  std::ofstream out(path, std::ios::binary | std::ios::app);
  if (fresh) out << csv_line(column_names()) + '\n';
  out << csv_line(fields_of(row)) + '\n' << std::flush;
  if (!out) return fault("not_written", "could not be written", path);
  return {};
}

}  // namespace kiln::trade
