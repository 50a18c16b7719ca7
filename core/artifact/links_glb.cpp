#include "core/artifact/links_glb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/artifact/glb_arrays.h"
#include "core/artifact/glb_extension.h"
#include "core/artifact/gltf_bytes.h"
#include "core/artifact/gltf_check.h"
#include "core/artifact/json_fields.h"
#include "core/artifact/points_glb.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

using json = nlohmann::ordered_json;

constexpr const char* kName = "KILN_meshless_light";
constexpr const char* kPlace = "/extensions/KILN_meshless_light";
constexpr int kVersion = 1;
constexpr std::uint32_t kMostSweeps = 1000;
constexpr float kMostTail = 1e4F, kFarOut = 4;  // of the unit cube

static_assert(sizeof(LightLink) == 8 && sizeof(SenderSample) == 16 && sizeof(TreeChild) == 4 && sizeof(RowSite) == 16);

// Writing.

class Appender {
 public:
  Appender(json& document, Bytes& binary) : document_(document), binary_(binary) {}

  template <class T>
  std::size_t view(const std::vector<T>& numbers) {
    binary_.resize((binary_.size() + 3) / 4 * 4, 0);
    const std::size_t bytes = numbers.size() * sizeof(T);
    document_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}});
    const std::size_t at = binary_.size();
    binary_.resize(at + bytes);
    if (bytes > 0) std::memcpy(binary_.data() + at, numbers.data(), bytes);
    return document_["bufferViews"].size() - 1;
  }

 private:
  json& document_;
  Bytes& binary_;
};

json extension_of(const LightLinks& l, Appender& to) {
  std::vector<std::uint32_t> rows;
  std::vector<std::uint8_t> weights;
  for (const RowTerm& t : l.terms) rows.push_back(t.row), weights.push_back(t.weight);
  json out = {{"version", kVersion},
              {"units", "W m^-2 sr^-1 of value = irradiance / pi; lengths of the unit cube"},
              {"senders", l.senders},
              {"nodes", l.nodes()},
              {"rows", l.rows()},
              {"links", l.links.size()},
              {"vertices", l.vertices()},
              {"sweeps", l.sweeps},
              {"tail", l.tail}};
  const auto put = [&](const char* name, const auto& numbers) {
    if (!numbers.empty()) out["bufferViews"][name] = to.view(numbers);
  };
  put("sampleBegin", l.sample_begin);
  put("samples", l.samples);
  put("childBegin", l.child_begin);
  put("children", l.children);
  put("sites", l.sites);
  put("scale", l.scale);
  put("linkBegin", l.link_begin);
  put("links", l.links);
  put("termBegin", l.term_begin);
  put("termRows", rows);
  put("termWeights", weights);
  return out;
}

// Reading.

class Checker {
 public:
  explicit Checker(Findings& findings) : findings_(findings) {}

  void count(const char* name, std::size_t found, std::size_t expected) {
    if (found != expected)
      findings_.fail("slot_count_mismatch",
                     "There are " + std::to_string(found) + " elements and not " + std::to_string(expected) + ".",
                     place(name));
  }
  /// From 0 to `end`, never falling.
  void begins(const char* name, const std::vector<std::uint32_t>& x, std::size_t end) {
    bool good = !x.empty() && x.front() == 0 && x.back() == end;
    for (std::size_t i = 1; good && i < x.size(); ++i) good = x[i - 1] <= x[i];
    if (!good) findings_.fail("index_out_of_range", "The beginnings do not ascend from 0 to the end.", place(name));
  }
  void range(const char* name, bool good) {
    if (!good) findings_.fail("index_out_of_range", "An index points past the end.", place(name));
  }
  void numbers(const char* name, bool good) {
    if (!good) findings_.fail("number_out_of_range", "A number is not finite or not in its range.", place(name));
  }

 private:
  static std::string place(const char* name) { return std::string(kPlace) + "/bufferViews/" + name; }
  Findings& findings_;
};

bool near_cube(const Vec3f& p) {
  return is_finite(p) && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kFarOut;
}

void check_links(const LightLinks& l, std::size_t nodes, std::size_t vertices, Findings& findings) {
  Checker check(findings);
  check.count("sampleBegin", l.sample_begin.size(), std::size_t{l.senders} + 1);
  check.count("childBegin", l.child_begin.size(), nodes - l.senders + 1);
  check.count("linkBegin", l.link_begin.size(), l.rows() + 1);
  check.count("sites", l.sites.size(), l.rows());
  check.count("termBegin", l.term_begin.size(), vertices + 1);
  check.range("scale", l.rows() >= l.senders);
  check.begins("sampleBegin", l.sample_begin, l.samples.size());
  check.begins("childBegin", l.child_begin, l.children.size());
  check.begins("linkBegin", l.link_begin, l.links.size());
  check.begins("termBegin", l.term_begin, l.terms.size());
  if (findings.failed()) return;
  bool children = true;
  for (std::size_t i = 0; i + 1 < l.child_begin.size(); ++i) {
    for (std::uint32_t k = l.child_begin[i]; k < l.child_begin[i + 1]; ++k)
      children = children && l.children[k].node < l.senders + i && l.children[k].share > 0;
  }
  check.range("children", children);
  check.range("links", std::ranges::all_of(l.links, [&](const LightLink& x) { return x.node < nodes; }));
  check.range("termRows", std::ranges::all_of(l.terms, [&](const RowTerm& t) { return t.row < l.rows(); }));
  check.numbers("scale", std::ranges::all_of(l.scale, [](float x) { return x >= 0 && x <= 1; }));
  check.numbers("sites", std::ranges::all_of(l.sites, [](const RowSite& s) { return near_cube(s.position); }));
  check.numbers("samples", std::ranges::all_of(l.samples, [](const SenderSample& s) { return near_cube(s.position); }));
}

LightLinks links_in(const Fields& fields, const gltf::BufferBytes& bytes, std::size_t vertices, Findings& findings) {
  LightLinks l;
  if (fields.count("version", 0) != kVersion)
    findings.fail("unsupported_version", "Only version 1 of KILN_meshless_light is read.", fields.pointer("version"));
  const std::uint64_t senders = fields.count("senders", 0), nodes = fields.count("nodes", 0);
  const std::uint64_t sweeps = fields.count("sweeps", 0);
  const double tail = fields.number("tail", 0);
  if (nodes > kMostNodes || senders > nodes || sweeps > kMostSweeps || !(tail >= 0 && tail <= kMostTail))
    findings.fail("number_out_of_range", "Senders, nodes, sweeps or tail are out of range.", kPlace);
  if (findings.failed()) return {};
  l.senders = static_cast<std::uint32_t>(senders);
  l.sweeps = static_cast<std::uint32_t>(sweeps);
  l.tail = static_cast<float>(tail);
  const Fields views = fields.object("bufferViews");
  const ArrayViews from(views, bytes, findings);
  l.sample_begin = from.take<std::uint32_t>("sampleBegin");
  l.samples = from.take<SenderSample>("samples");
  l.child_begin = from.take<std::uint32_t>("childBegin");
  l.children = from.take<TreeChild>("children");
  l.sites = from.take<RowSite>("sites");
  l.scale = from.take<float>("scale");
  l.link_begin = from.take<std::uint32_t>("linkBegin");
  l.links = from.take<LightLink>("links");
  l.term_begin = from.take<std::uint32_t>("termBegin");
  const auto rows = from.take<std::uint32_t>("termRows");
  const auto weights = from.take<std::uint8_t>("termWeights");
  if (rows.size() != weights.size())
    findings.fail("slot_count_mismatch", "Each row of a vertex has one weight.", fields.pointer("bufferViews"));
  if (findings.failed()) return {};
  for (std::size_t i = 0; i < rows.size(); ++i) l.terms.push_back({rows[i], weights[i]});
  check_links(l, static_cast<std::size_t>(nodes), vertices, findings);
  return l;
}

LightLinks read_file(std::span<const std::uint8_t> file, std::size_t vertices, Findings& findings) {
  LightLinks out;
  read_root_extension(file, kName, findings, [&](const Fields& extension, const gltf::BufferBytes& bytes) {
    if (extension.count("version", 0) == kPointsVersion) return;  // points_glb.h
    out = links_in(extension, bytes, vertices, findings);
  });
  return out;
}

}  // namespace

Result<Bytes> add_links(std::span<const std::uint8_t> glb, const LightLinks& links) {
  KILN_TRY(chunks, split_glb(glb));
  json document = json::parse(chunks.json);
  Bytes binary(chunks.binary.begin(), chunks.binary.end());
  Appender to(document, binary);
  document["extensions"][kName] = extension_of(links, to);
  document["extensionsUsed"].push_back(kName);
  std::sort(document["extensionsUsed"].begin(), document["extensionsUsed"].end());
  document["buffers"][0]["byteLength"] = (binary.size() + 3) / 4 * 4;
  return join_glb(document.dump(-1, ' ', false, json::error_handler_t::replace), std::move(binary));
}

Result<LightLinks> read_links(std::span<const std::uint8_t> glb, const BakedScene& baked) {
  Findings findings("scene.glb");
  LightLinks out = read_file(glb, baked.scene.mesh.position.size(), findings);
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  return out;
}

}  // namespace kiln
