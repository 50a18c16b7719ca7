#pragma once
// The matrices of many vertices, as weights of few components: no more of them exist at once than one block.
//   1. components of the matrices of some vertices (principal ones, in the metric below, by the Gram matrix of the
//      samples), as many as leave `left_out` of them
//   2. each vertex: its matrix, its weights, and what they leave out of it
// Metric  an error of M counts as that of the arriving light that it causes, relative to the mean light that arrives,
//         in the mean over directions, R, G, B and area, under distant light of the given power in each band and no
//         preferred direction; lamps count as one more lighting, relative to their own mean light.
//         (core/prt/components.h is the same for transfer vectors.) Bands that a rough surface blurs away count as if a
//         mirror showed them.
// Memory  a row of rank floats for a vertex; kGlossySamples matrices
// Repeat  same bits for any thread count.      Fails  never on a valid scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/prt/glossy_matrix.h"
#include "core/prt/glossy_transfer.h"
#include "core/prt/hidden.h"

namespace kiln {

inline constexpr std::size_t kGlossySamples = 512;  // vertices whose matrices make the components

struct GlossyBake {
  GlossyMatrix matrix;
  std::vector<double> band_power = {};  // of light of mean 1: matrix.order of them, all above zero
  double left_out = 0.01;               // relative error of the arriving light that components may leave
  std::size_t most = 128;               // components
  std::vector<StandIn> stand_ins = {};  // where hidden vertices look from instead; ascending
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};  // vertices
};

struct GlossyBaked {
  GlossyTransfer transfer;
  double left_out = 0;  // what the components leave out of all vertices, in the metric
  double noise = 0;     // of the rays: the same norm of half the difference of two draws, at the sampled vertices
  std::uint64_t rays = 0;
};

/// `vertices` of tracer.scene().mesh ascend; `light` holds the transfer vectors of all. At least one vertex.
GlossyBaked bake_glossy(const Tracer&, const Transfer& light, std::span<const std::uint32_t> vertices,
                        const GlossyBake&, Threads&);

}  // namespace kiln
