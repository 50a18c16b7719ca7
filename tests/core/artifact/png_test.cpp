#include "core/artifact/png.h"

#include <gtest/gtest.h>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb_image.h>
#pragma GCC diagnostic pop

#include "core/base/random.h"

namespace kiln {
namespace {

TEST(Png, DecodesToTheSamePixels) {
  for (const int channels : {1, 3, 4}) {
    Bytes pixels;
    Random random(7, 0);
    for (int i = 0; i < 31 * 17 * channels; ++i) pixels.push_back(static_cast<std::uint8_t>(random.next()));
    const Bytes file = write_png({31, 17, channels}, pixels);
    int width = 0, height = 0, found = 0;
    stbi_uc* decoded = stbi_load_from_memory(file.data(), static_cast<int>(file.size()), &width, &height, &found, 0);
    ASSERT_NE(decoded, nullptr);
    EXPECT_TRUE(width == 31 && height == 17 && found == channels);
    EXPECT_EQ(Bytes(decoded, decoded + pixels.size()), pixels);
    stbi_image_free(decoded);
  }
}

TEST(Png, OfSixteenBitsDecodesToTheSameValues) {
  for (const int channels : {1, 2, 3, 4}) {
    Bytes pixels;
    Random random(8, 0);
    for (int i = 0; i < 2 * 31 * 17 * channels; ++i) pixels.push_back(static_cast<std::uint8_t>(random.next()));
    const Bytes file = write_png({31, 17, channels, 16}, pixels);
    int width = 0, height = 0, found = 0;
    stbi_us* decoded = stbi_load_16_from_memory(file.data(), static_cast<int>(file.size()), &width, &height, &found, 0);
    ASSERT_NE(decoded, nullptr);
    EXPECT_TRUE(width == 31 && height == 17 && found == channels);
    for (std::size_t i = 0; i < pixels.size() / 2; ++i)
      ASSERT_EQ(decoded[i], 256 * pixels[2 * i] + pixels[2 * i + 1]) << i;
    stbi_image_free(decoded);
  }
}

}  // namespace
}  // namespace kiln
