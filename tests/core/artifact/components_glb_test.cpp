// Transfer vectors stored as weights of components: what is written is read back within the stated error.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/artifact/baked_geometry.h"
#include "core/artifact/glb.h"
#include "core/artifact/stored_transfer.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/round_trip.h"
#include "tests/core/artifact/sample_scene.h"

namespace kiln {
namespace {

/// The bound of slot `s` after rounding: half a step of each weight times its row, float sums of as many terms.
double slot_bound(const StoredTransfer& stored, const Transfer& shape, std::size_t s) {
  const StoredForm& form = stored.form();
  double sum = std::abs(form.components.mean()[s]) * 0x1p-23 + 1e-12, size = 0;
  for (std::size_t k = 0; k < form.components.rank(); ++k) {
    const double row = std::abs(form.components.row(k)[s]);
    sum += row * form.scale[k] / (std::exp2(stored.bits(k / 4)) - 1);
    size += row * (std::abs(form.offset[k]) + form.scale[k]);
  }
  const auto slots = static_cast<std::size_t>(shape.slots());
  if (shape.fixed && s % slots == slots - 1) {
    const std::size_t j = form.components.rank() + s / slots;
    sum += form.scale[j] / (std::exp2(stored.bits(j / 4)) - 1);
    size += std::abs(form.offset[j]) + form.scale[j];
  }
  return sum + 4 * size * 0x1p-23;  // the float of the weight, of the stored number, of the level, of the sum
}

TEST(ComponentsGlb, EverySlotComesBackWithinTheRoundingOfItsWeights) {
  for (const int channels : {1, 3}) {
    for (const bool fixed : {false, true}) {
      const BakedScene written = random_baked({.order = 3, .channels = channels, .fixed = fixed});
      const auto all = static_cast<std::size_t>(channels * sh_count(3));  // nothing is left out
      const TransferEncoding encoding = as_components(written, all);
      const StoredTransfer stored(written.transfer, encoding, used_vertices(written.scene.mesh));
      const BakedScene read = round_trip(written, {.transfer = encoding});
      ASSERT_EQ(read.transfer.stride(), written.transfer.stride());
      const auto original = [&] {
        BakedScene numbered = read;  // flat slot 0 is the vertex number, give or take the rounding of its weights
        for (std::size_t v = 0; v < numbered.transfer.vertices(); ++v) {
          float& number = numbered.transfer.coefficients[v * numbered.transfer.stride()];
          number = std::round(number);
        }
        return original_vertices(numbered);
      }();
      double worst = 0;
      for (std::size_t v = 0; v < original.size(); ++v) {
        for (std::size_t s = 0; s < written.transfer.stride(); ++s) {
          const double error = std::abs(written.transfer.at(original[v], 0)[s] - read.transfer.at(v, 0)[s]);
          worst = std::max(worst, error / slot_bound(stored, written.transfer, s));
        }
      }
      EXPECT_LE(worst, 1) << channels << fixed;
      EXPECT_GT(worst, 0.1);  // rounding of nine to 27 weights at once: their half steps hardly ever all add up
    }
  }
}

TEST(ComponentsGlb, AReaderFindsWhatReadBackForetells) {
  const BakedScene written = random_baked({.order = 2, .fixed = true});
  TransferEncoding encoding = as_components(written, 12);
  encoding.weight_step = 0.01;
  const BakedScene read = round_trip(written, {.transfer = encoding});
  const StoredTransfer stored(written.transfer, encoding, used_vertices(written.scene.mesh));
  std::vector<std::vector<float>> foretold;
  for (std::size_t v = 0; v < written.transfer.vertices(); ++v) foretold.push_back(stored.read_back(v, true));
  for (std::size_t v = 0; v < read.transfer.vertices(); ++v) {
    const float* there = read.transfer.at(v, 0);
    const auto difference = [&](const std::vector<float>& slots) {
      float largest = 0;
      for (std::size_t s = 0; s < slots.size(); ++s) largest = std::max(largest, std::abs(slots[s] - there[s]));
      return largest;
    };
    float nearest = difference(foretold[0]);
    for (const auto& slots : foretold) nearest = std::min(nearest, difference(slots));
    ASSERT_LT(nearest, 1e-3F);  // float sums of numbers up to 700: 1e-4. Vertices are far further apart
  }
}

TEST(ComponentsGlb, CoarserStepsNeedFewerBits) {
  const BakedScene written = random_baked({.order = 2});
  TransferEncoding encoding = as_components(written, 8);
  std::vector<int> bits;
  for (const double step : {1e-4, 1e-2, 1.0, 1e6}) {
    encoding.weight_step = step;
    bits.push_back(StoredTransfer(written.transfer, encoding, used_vertices(written.scene.mesh)).bits(0));
  }
  EXPECT_TRUE(std::ranges::is_sorted(bits, std::greater<>()));
  EXPECT_EQ(bits.back(), 2);
  EXPECT_LE(bits.front(), 20);
}

// A vertex beside a lamp has thousands of times the mean: its range must not cost the others their digits.
TEST(ComponentsGlb, OneVertexBesideALampLeavesTheOthersTheirDigits) {
  for (const bool raw : {false, true}) {
    BakedScene baked = random_baked({.order = 2, .channels = 1, .fixed = true});
    float& brightest = baked.transfer.coefficients[static_cast<std::size_t>(baked.transfer.slots()) - 1];
    brightest = 5000;
    TransferEncoding encoding = raw ? TransferEncoding{.bits = 10} : as_components(baked, 4);
    encoding.lamp_step = 0.01;
    const StoredTransfer stored(baked.transfer, encoding, used_vertices(baked.scene.mesh));
    for (std::size_t v = 0; v < baked.transfer.vertices(); ++v) {
      const auto lamp = static_cast<std::size_t>(baked.transfer.slots()) - 1;
      const float exact = baked.transfer.at(v, 0)[lamp], rounded = stored.read_back(v, true)[lamp];
      EXPECT_NEAR(exact, rounded, 0.005 + 4 * std::abs(exact) * 0x1p-23 + 5000 * 0x1p-23) << v;  // half a step, floats
    }
  }
}

TEST(ComponentsGlb, AConstantSceneNeedsNoBits) {
  BakedScene written = random_baked({.order = 2, .channels = 1});
  for (std::size_t i = 0; i < written.transfer.coefficients.size(); ++i)
    written.transfer.coefficients[i] = 0.25F * static_cast<float>(i % 4);
  const BakedScene read = round_trip(written, {.transfer = as_components(written, 4)});  // a rank larger than needed
  for (std::size_t i = 0; i < read.transfer.coefficients.size(); ++i)
    ASSERT_NEAR(read.transfer.coefficients[i], 0.25F * static_cast<float>(i % 4), 1e-6);
}

/// The file with its JSON text changed.
Bytes with_json(const Bytes& file, const std::string& from, const std::string& to) {
  const auto chunks = split_glb(file);
  std::string json(chunks->json);
  const auto at = json.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  json.replace(at, from.size(), to);
  return *join_glb(json, Bytes(chunks->binary.begin(), chunks->binary.end()));
}

std::string code_of(const Bytes& file) {
  const auto read = read_baked_glb(file);
  return read ? "" : read.error().code;
}

TEST(ComponentsGlb, EachBrokenPromiseHasItsCode) {
  const BakedScene written = random_baked({.order = 2});
  const Bytes file = *write_baked_glb(written, {.transfer = as_components(written, 8)});
  ASSERT_EQ(code_of(file), "");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":8", "\"rank\":7")), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":8", "\"rank\":0")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":8", "\"rank\":1000000000")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"form\":\"components\"", "\"form\":\"raw\"")), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"form\":\"components\"", "\"form\":\"zip\"")), "not_a_baked_scene");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":8,\"bufferView\":", "\"rank\":8,\"bufferView\":9")),
            "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":8,\"bufferView\":", "\"rank\":8,\"bufferView\":-")), "json_type");
}

TEST(ComponentsGlb, AComponentThatIsNoNumberIsRefused) {
  const BakedScene written = random_baked({.order = 2});
  TransferEncoding encoding = as_components(written, 8);
  encoding.components.rows[13] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(code_of(*write_baked_glb(written, {.transfer = encoding})), "number_out_of_range");
}

}  // namespace
}  // namespace kiln
