#include "server/jobs/sql.h"

namespace kiln::sql {

std::int64_t Row::integer(std::size_t column) const {
  const auto* number = std::get_if<std::int64_t>(&cells_[column]);
  return number == nullptr ? 0 : *number;
}

double Row::real(std::size_t column) const {
  const auto* number = std::get_if<double>(&cells_[column]);
  return number == nullptr ? static_cast<double>(integer(column)) : *number;
}

std::string Row::text(std::size_t column) const {
  const auto* text = std::get_if<std::string>(&cells_[column]);
  return text == nullptr ? std::string() : *text;
}

}  // namespace kiln::sql
