#pragma once
// Comma-separated values (RFC 4180), and the file of rows that a sweep appends to and resumes from.

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tests/bench/trade/row.h"

namespace kiln::trade {

/// One line without its end; what holds a comma, a quote or a line's end is quoted.
std::string csv_line(const std::vector<std::string>& fields);

/// Lines of fields. A last line without its end was cut off while it was written: it is not among them.
std::vector<std::vector<std::string>> parse_csv(std::string_view text);

/// Rows of a file; none when there is no file. Cuts off a last line that was never finished.
/// Fails  other_columns when it was written by another version of this tool, bad_row
Result<std::vector<Row>> open_rows(const std::string& path);

/// Appends and flushes: a row that was measured is never measured again.
Result<void> append_row(const std::string& path, const Row&);

}  // namespace kiln::trade
