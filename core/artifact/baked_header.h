#pragma once
// The JSON side of a scene.glb: what the KILN_radiance_transfer extensions say.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/findings.h"
#include "core/artifact/prt_slots.h"

namespace kiln {

struct BakedHeader {
  struct PartHeader {
    std::string name;
    int material = 0;  // checked against the materials by the caller
  };
  Transfer shape;  // order, channels, fixed; no coefficients
  SlotRanges ranges;
  BakedLight light;
  float exposure = 1;
  std::string provenance;
  std::vector<PartHeader> parts;  // of mesh 0's primitives, in order
};

/// Reads text that has passed scan_json. Fails with not_a_baked_scene, unsupported_version, json_type,
/// slot_count_mismatch or number_out_of_range.
BakedHeader read_baked_header(std::span<const std::uint8_t> json, Findings&);

}  // namespace kiln
