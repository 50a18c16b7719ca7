#include "server/jobs/ids.h"

#include <sys/random.h>

#include <array>
#include <span>

#include "core/base/expects.h"

namespace kiln {
namespace {

void fill_random(void* out, std::size_t size) {
  EXPECTS(::getrandom(out, size, 0) == static_cast<ssize_t>(size));  // never short up to 256 bytes: getrandom(2)
}

constexpr const char* kBase32 = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";

}  // namespace

std::string random_token() {
  std::array<std::uint8_t, 16> bits{};
  fill_random(bits.data(), bits.size());
  std::string text;
  for (const std::uint8_t byte : bits) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string UlidGenerator::next(std::int64_t now_ms) {
  if (now_ms > last_ms_) {
    last_ms_ = now_ms;
    fill_random(&high_, sizeof high_);
    fill_random(&low_, sizeof low_);
    high_ &= 0x7FFF;  // room to count up within the millisecond
  } else if (++low_ == 0) {
    ++high_;
  }
  // 130 bits, five at a time from the end: low_, then high_, then the time.
  std::string id(26, '0');
  auto bits = static_cast<unsigned __int128>(low_) | (static_cast<unsigned __int128>(high_) << 64) |
              (static_cast<unsigned __int128>(last_ms_) << 80);
  for (std::size_t i = 26; i-- > 0; bits >>= 5) id[i] = kBase32[static_cast<unsigned>(bits & 31)];
  return id;
}

}  // namespace kiln
