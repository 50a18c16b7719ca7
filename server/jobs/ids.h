#pragma once
// Names that nobody can guess and that sort by time.

#include <cstdint>
#include <string>

namespace kiln {

/// 128 bits from the system, 32 hex digits.
std::string random_token();

/// Ids of 26 letters (Crockford base 32): 48 bits of milliseconds, then 80 random bits. Within one generator each id is
/// greater than the one before, even when the clock stands still or goes back. Not safe for two threads at once.
class UlidGenerator {
 public:
  std::string next(std::int64_t now_ms);
  /// The time inside the newest id.
  std::int64_t last_ms() const { return last_ms_; }

 private:
  std::int64_t last_ms_ = 0;
  std::uint16_t high_ = 0;  // of the 80 bits
  std::uint64_t low_ = 0;
};

}  // namespace kiln
