#pragma once
// The matrices of many vertices, as weights of few components: no more of them exist at once than one block.
//   1. components of the matrices of some vertices (glossy_components.h), as many as leave `left_out` of them
//   2. each vertex: its matrix, its weights, and what they leave out of it
// Memory  a row of rank floats for a vertex; kGlossySamples matrices
// Repeat  same bits for any thread count.      Fails  never on a valid scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/glossy_components.h"
#include "core/prt/glossy_matrix.h"
#include "core/prt/glossy_transfer.h"
#include "core/prt/hidden.h"

namespace kiln {

inline constexpr std::size_t kGlossySamples = 512;  // vertices whose matrices make the components

struct GlossyBake {
  GlossyMatrix matrix;
  GlossyRank rank;
  std::vector<StandIn> stand_ins = {};  // where hidden vertices look from instead; ascending
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};  // vertices
};

struct GlossyBaked {
  GlossyTransfer transfer;
  double left_out = 0;  // what the components leave out of all vertices, in the metric
  double noise = 0;     // of the rays: the same norm of half the difference of two draws, at the sampled places
  std::uint64_t rays = 0;
};

/// A third of each triangle's area at those of its corners that are among `vertices`; they sum to 1.
std::vector<double> vertex_shares(const Mesh&, std::span<const std::uint32_t> vertices);

/// `vertices` of tracer.scene().mesh ascend; `light` holds the transfer vectors of all. At least one vertex.
GlossyBaked bake_glossy(const Tracer&, const Transfer& light, std::span<const std::uint32_t> vertices,
                        const GlossyBake&, Threads&);

}  // namespace kiln
