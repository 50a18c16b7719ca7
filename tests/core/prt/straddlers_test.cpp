#include "core/prt/straddlers.h"

#include <gtest/gtest.h>

namespace kiln {
namespace {

// A floor of which x < 0 lies under a solid. Vertices 2 and 3 stand at one place of the contact line: 2 shows the dark
// side, 3 the lit one.
TEST(Straddlers, TakeTheCopyThatIsNotHidden) {
  Mesh mesh;
  mesh.position = {{-1, 0, 0}, {-1, 0, 1}, {0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  mesh.normal.assign(6, {0, 1, 0});
  mesh.triangles = {{0, 1, 2}, {1, 4, 2}, {4, 5, 3}};
  mesh.part.assign(3, 0);
  const auto at = [](float x) { return TransferPoint{{x, 0, 0}, {0, 1, 0}, {x, 0, 0}, {0, 1, 0}}; };
  Threads threads(1);
  const HiddenTest hidden = [](const TransferPoint& p) { return p.position.x < 0; };
  light_straddlers(mesh, {{2, at(-0.1F)}, {3, at(0.1F)}}, hidden, threads);
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));  // inside, whole
  EXPECT_EQ(mesh.triangles[1], (Triangle{1, 4, 3}));  // corner 4 can be seen
  EXPECT_EQ(mesh.triangles[2], (Triangle{4, 5, 3}));
}

TEST(Straddlers, WithoutALitCopyNothingChanges) {
  Mesh mesh;
  mesh.position = {{-1, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  mesh.normal.assign(3, {0, 1, 0});
  mesh.triangles = {{0, 1, 2}};
  mesh.part.assign(1, 0);
  Threads threads(1);
  const HiddenTest hidden = [](const TransferPoint& p) { return p.position.x < 0; };
  light_straddlers(mesh, {{2, {{-0.1F, 0, 1}, {0, 1, 0}, {-0.1F, 0, 1}, {0, 1, 0}}}}, hidden, threads);
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
}

}  // namespace
}  // namespace kiln
