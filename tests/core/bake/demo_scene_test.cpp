#include "core/bake/demo_scene.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

TEST(DemoScene, EveryNameIsAGlbWhoseLengthsAgree) {
  for (const std::string& name : demo_scene_names()) {
    const auto glb = demo_scene(name);
    ASSERT_TRUE(glb) << name;
    std::uint32_t length = 0, json_length = 0;
    std::memcpy(&length, glb->data() + 8, 4);
    std::memcpy(&json_length, glb->data() + 12, 4);
    EXPECT_EQ(length, glb->size()) << name;
    const auto json = nlohmann::json::parse(glb->begin() + 20, glb->begin() + 20 + json_length);
    EXPECT_EQ(json["buffers"][0]["byteLength"].get<std::size_t>() + 28 + json_length, glb->size()) << name;
    for (const auto& view : json["bufferViews"]) {
      EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(),
                json["buffers"][0]["byteLength"].get<std::size_t>());
    }
  }
  EXPECT_FALSE(demo_scene("nothing"));
}

}  // namespace
}  // namespace kiln
