#pragma once
// Looks through JSON text before anything builds a tree of it. A tree of 6 MB of "{}" takes 27 times that.

#include <cstdint>
#include <span>

#include "core/artifact/findings.h"

namespace kiln {

struct JsonLimits {
  std::uint64_t max_bytes = 16u << 20;
  int max_depth = 64;
  std::uint64_t max_objects = 1'000'000;      // elements of one member of the root
  std::uint64_t max_tree_bytes = 128u << 20;  // estimate of the parsed tree
};

/// Fails with json_too_large, json_too_deep, too_many_objects or json_invalid. One pass, constant memory.
/// Text that passes can be parsed without a fault.
void scan_json(std::span<const std::uint8_t> text, const JsonLimits&, Findings&);

}  // namespace kiln
