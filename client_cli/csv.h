#pragma once
// Comma-separated numbers: a first line of names, or none where the columns have known names.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_cli/failure.h"

namespace kiln {

struct CsvTable {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;  // each as long as columns
  std::vector<std::size_t> lines;         // line number of each row, from 1

  std::optional<std::size_t> find(std::string_view column) const;
};

/// Reads numbers (also nan and inf) separated by commas. Empty lines and lines that start with # are skipped. Without a
/// line of names the columns are the first of `default_columns`.
/// Fails  malformed_csv: names the line and what stands there
Outcome<CsvTable> parse_csv(std::string_view text, const std::string& name,
                            const std::vector<std::string>& default_columns);

/// Shortest text that reads back as the same number.
std::string number_text(double value);
std::string number_text(float value);

}  // namespace kiln
