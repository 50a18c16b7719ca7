#pragma once
// The JSON side of a scene.glb: what the KILN_radiance_transfer and KILN_light_field extensions say.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/findings.h"
#include "core/artifact/sky_levels.h"
#include "core/artifact/stored_transfer.h"

namespace kiln {

struct BakedHeader {
  struct PartHeader {
    std::string name;
    int material = 0;     // checked against the materials by the caller
    bool glossy = false;  // its vertices have matrices
  };
  Transfer shape;            // order, channels, fixed; no coefficients
  StoredForm form;           // of components only the shape: their numbers are in a buffer view
  int components_view = -1;  // checked against the buffer views by the caller; -1: raw
  bool has_field = false;    // r-RFs
  Transfer field_shape;      // as they are stored: order is their degree + 1
  StoredForm field_form;
  int field_view = -1;  // checked as components_view
  struct Sky {          // that the field keeps apart
    StoredForm form;    // of its visibility
    PackedSky levels;   // without texels
    int levels_view = -1;
    Vec3f mean;
    double slope = 0;
  };
  std::optional<Sky> sky;
  std::vector<FieldLamp> lamps;        // that the field keeps apart
  StoredForm lamp_form;                // of how much of them is seen
  bool emission_apart = false;         // by the field
  std::optional<Vec3f> diffuse_color;  // where it keeps diffuse light apart: as LightField has it
  GlossyTransfer glossy;               // its shape; of rank 0 (and order 0) where there are no matrices
  StoredForm glossy_form;
  int glossy_view = -1, lobes_view = -1;  // checked as components_view
  BakedLight light;
  float exposure = 1;
  std::string provenance;
  std::vector<PartHeader> parts;  // of mesh 0's primitives, in order
};

/// Reads text that has passed scan_json. Fails with not_a_baked_scene, unsupported_version, json_type,
/// slot_count_mismatch or number_out_of_range.
BakedHeader read_baked_header(std::span<const std::uint8_t> json, Findings&);

}  // namespace kiln
