#include "core/artifact/gltf_radiance.h"

#include <algorithm>
#include <cmath>

#include "core/sphere/hemispherical_polynomials.h"
#include "core/sphere/sh.h"

namespace kiln::gltf {
namespace {

constexpr const char* kPlace = "/extensions/KILN_radiance_functions";
constexpr float kLargest = 1e15F;  // its square times any area fits a float
constexpr double kShortest = 1e-6;

std::string attribute_place(const std::string& primitive, const std::string& name) {
  return primitive + "/attributes/" + name;
}

std::string radiance_name(std::size_t k) { return "_RF_" + std::to_string(k); }

/// Just the attributes that the declaration asks for, as three floats each, and normals.
void check_attributes(const Document& d, const Primitive& p, const std::string& place, Findings& findings) {
  const std::size_t count = d.radiance.count();
  for (std::size_t k = 0; k < count; ++k) {
    const std::string name = radiance_name(k);
    const int index = p.attribute(name.c_str());
    if (index < 0) {
      return findings.fail("radiance_incomplete",
                           "The primitive lacks " + name + " of the " + std::to_string(count) +
                               " coefficients that the file declares for each vertex.",
                           attribute_place(place, name));
    }
    const Accessor& a = d.accessors[static_cast<std::size_t>(index)];
    if (a.component == Component::f32 && a.width == 3 && !a.matrix) continue;
    return findings.fail("accessor_type", "A coefficient must be a VEC3 of floats: red, green and blue.",
                         attribute_place(place, name));
  }
  const auto carried = static_cast<std::size_t>(
      std::ranges::count_if(p.attributes, [](const auto& a) { return a.first.substr(0, 4) == "_RF_"; }));
  if (carried != count) {
    return findings.fail("radiance_count_mismatch",
                         "The primitive has " + std::to_string(carried) + " attributes _RF_n, the file declares " +
                             std::to_string(count) + " coefficients.",
                         place + "/attributes");
  }
  if (p.attribute("NORMAL") < 0)
    findings.fail("radiance_without_normals", "Radiance functions need the normals that they were made about.", place);
}

/// The floats of every coefficient, from accessors or from Draco.
std::vector<std::vector<float>> read_columns(const AccessorSource& source, const Primitive& p, const std::string& place,
                                             Findings& findings) {
  std::vector<std::string> packed;
  std::vector<std::vector<float>> out(source.document.radiance.count());
  for (std::size_t k = 0; k < out.size() && !findings.failed(); ++k) {
    const std::string name = radiance_name(k);
    if (p.draco.view >= 0 && p.draco.attributes.contains(name)) {
      packed.push_back(name);
    } else {
      out[k] = read_floats(source, p.attribute(name.c_str()), attribute_place(place, name), findings);
    }
  }
  if (packed.empty() || findings.failed()) return out;
  auto unpacked = read_draco_attributes(source, p, packed, place, findings);
  for (std::size_t k = 0, next = 0; k < out.size() && !findings.failed(); ++k) {
    if (out[k].empty()) out[k] = std::move(unpacked[next++]);
  }
  return out;
}

void check_values(const std::vector<std::vector<float>>& columns, const std::string& place, Findings& findings) {
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto far = std::ranges::find_if(columns[k], [](float c) { return std::abs(c) > kLargest; });
    if (far == columns[k].end()) continue;
    return findings.fail(
        "number_out_of_range", "A coefficient is larger than 1e15.",
        attribute_place(place, radiance_name(k)) + " element " + std::to_string((far - columns[k].begin()) / 3));
  }
}

/// Where the polynomials of a vertex live: x is the tangent, made upright, or that of basis_around.
Basis<double> polynomial_frame(const RawPart& part, std::size_t vertex, const Vec3d& normal, Findings& findings) {
  if (part.tangent.empty()) return basis_around(normal);
  const Vec4f& t = part.tangent[vertex];
  const Vec3d along = to_double(Vec3f{t.x, t.y, t.z}), x = along - normal * dot(normal, along);
  if (!(length(x) > kShortest)) {
    findings.fail("tangents_invalid", "The tangent has no direction along the surface, which the polynomials need.",
                  attribute_place(part.place, "TANGENT") + " element " + std::to_string(vertex));
    return basis_around(normal);
  }
  const Vec3d unit = normalized(x);
  return {unit, cross(normal, unit) * (t.w < 0 ? -1 : 1), normal};
}

/// Polynomials of a left-handed frame are those of the right-handed one with y turned round.
void turn_y_round(int degree, std::vector<double>& polynomials) {
  for (int k = 0; k <= degree; ++k) {
    for (int j = 1; j <= k; j += 2) polynomials[static_cast<std::size_t>(k * (k + 1) / 2 + j)] *= -1;
  }
}

/// Coefficients of one channel at one vertex, as the file has them, in harmonics of the part's axes.
std::vector<double> to_axes(const RadianceDeclaration& d, Basis<double> frame, std::vector<double> given) {
  if (d.basis == RadianceBasis::harmonics) return given;
  const int degree = static_cast<int>(d.degree);
  if (dot(cross(frame.x, frame.y), frame.z) < 0) {
    turn_y_round(degree, given);
    frame.y = -frame.y;
  }
  std::vector<double> out(static_cast<std::size_t>(sh_count(degree + 1)));
  polynomials_to_sh(degree, given.data(), out.data());
  rotate_sh(degree + 1, frame, out.data(), out.data());
  return out;
}

}  // namespace

void check_declaration(const Document& d, Findings& findings) {
  if (d.radiance) {
    if (d.radiance.version != 1)
      findings.fail("unsupported_version", "Only version 1 of the extension is read.",
                    std::string(kPlace) + "/version");
    if (d.radiance.degree > kMaxLightFieldDegree)
      findings.fail("number_out_of_range", "The degree must be 0 to 8.", std::string(kPlace) + "/degree");
    return;
  }
  for (std::size_t m = 0; m < d.meshes.size(); ++m) {
    for (std::size_t p = 0; p < d.meshes[m].primitives.size(); ++p) {
      if (d.meshes[m].primitives[p].attribute("_RF_0") < 0) continue;
      return findings.warn("radiance_not_declared",
                           "Attributes _RF_n mean nothing without the extension KILN_radiance_functions.",
                           "/meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p));
    }
  }
}

void warn_of_unused_radiance(Findings& findings) {
  findings.warn("radiance_not_used",
                "The file carries radiance functions, which only the step lightfield makes use of.", kPlace);
}

void read_radiance(const AccessorSource& source, const Primitive& primitive, RawPart& part, Findings& findings) {
  const RadianceDeclaration& d = source.document.radiance;
  check_attributes(source.document, primitive, part.place, findings);
  if (findings.failed()) return;
  const std::vector<std::vector<float>> columns = read_columns(source, primitive, part.place, findings);
  if (!findings.failed()) check_values(columns, part.place, findings);
  if (findings.failed()) return;
  const int degree = static_cast<int>(d.degree);
  const auto count = static_cast<std::size_t>(sh_count(degree + 1));
  part.radiance.reserve(3 * count * part.position.size());
  for (std::size_t v = 0; v < part.position.size(); ++v) {
    const Vec3d given = to_double(part.normal[v]);
    if (!(length(given) > kShortest)) {
      return findings.fail("radiance_without_normals", "The normal has no direction.",
                           attribute_place(part.place, "NORMAL") + " element " + std::to_string(v));
    }
    const Vec3d normal = normalized(given);
    const Basis<double> frame = polynomial_frame(part, v, normal, findings);
    if (findings.failed()) return;
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> one;
      for (const std::vector<float>& column : columns) one.push_back(double{column[3 * v + c]});
      one = to_axes(d, frame, std::move(one));
      if (d.reflected) reflect_harmonics(degree, normal, one.data());
      for (const double x : one) part.radiance.push_back(static_cast<float>(x));
    }
  }
}

void check_turns(std::span<const Placement> placements, Findings& findings) {
  constexpr double kTolerance = 1e-4;  // quaternions and matrices come as floats, nested ones multiplied
  for (const Placement& placement : placements) {
    for (const Affine& m : placement.instances) {
      const double size = dot(m.x, m.x),
                   worst = std::max({std::abs(dot(m.y, m.y) - size), std::abs(dot(m.z, m.z) - size),
                                     std::abs(dot(m.x, m.y)), std::abs(dot(m.y, m.z)), std::abs(dot(m.z, m.x))});
      if (size > 0 && worst <= kTolerance * size) continue;
      return findings.fail("radiance_transform",
                           "A mesh with radiance functions may be moved, turned, mirrored and scaled evenly, not "
                           "stretched or sheared.",
                           "/nodes/" + std::to_string(placement.node));
    }
  }
}

}  // namespace kiln::gltf
