// Damage at random: job documents (2000, or KILN_MUTATIONS) are refused with reasons, or say the same when they are
// written and read again.

#include <array>
#include <string>

#include "server/api/job_request.h"
#include "tests/core/artifact/mutated.h"

namespace kiln::test {
namespace {

const std::array<std::string, 4> kDocuments{
    R"({"scene":{"asset":"0000000000000000000000000000000000000000000000000000000000000000"},"environment":{"constant":)"
    R"([1,0.5,0.25],"rotation_deg":30,"intensity":2},"steps":[{"do":"reduce","triangles":2000},{"do":"prt","order":4,)"
    R"("bounces":2,"samples":256,"glossy":"auto","subdivide":{"measure":"residual","alpha":1,"threshold":0.01,)"
    R"("triangles":6000,"max_depth":4},"encoding":{"form":"pca","rank":8,"bits":12}}],"quality":{"target_error":0.02},)"
    R"("seed":7,"limits":{"memory_mb":512,"threads":2,"wall_s":60},"strict":true,"label":"n"})",
    R"({"scene":{"asset":"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"},"steps":[{"do":)"
    R"("lightfield","basis":"polynomial","degree":4,"simplify":{"ratio":0.25,"collapse":"half-edge"},"lods":3,)"
    R"("progressive":true}],"quality":"draft"})",
    R"({"steps":[{"do":"grid","resolution":[8,8,8],"content":"indirect","blend":"exact","bounces":2,"samples":64}],)"
    R"("environment":{"builtin":"clear"}})",
    R"({"preset":"lamps","steps":[{"do":"radiosity","scheme":"rows","points":{"radius":0.1,"levels":4},)"
    R"("eps_irradiance":0.01,"eps_solid_angle":0.1,"rays":64,"bounces":3,"deliver":["vertices"]}],"force":true})",
};

TEST(RecipeMutation, DamagedDocumentsAreRefusedWithReasonsOrSayTheSameTwice) {
  std::uint64_t accepted = 0;
  Costs costs;
  const std::uint64_t count = mutation_count();
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(20061, i);
    const std::string& document = kDocuments[i % kDocuments.size()];
    const auto bytes = mutated({document.begin(), document.end()}, random, 1);
    const std::string text(bytes.begin(), bytes.end());
    SCOPED_TRACE(text);
    const auto request = costs.of([&] { return parse_job_request(text); });
    if (request) {
      ++accepted;
      const std::string written = recipe_json(request->recipe);
      const auto again = parse_recipe(written);
      ASSERT_TRUE(again);
      EXPECT_EQ(recipe_json(*again), written);
      EXPECT_EQ(recipe_identity(*again), recipe_identity(request->recipe));
    } else {
      EXPECT_TRUE(request.error().status == 400 || request.error().status == 422);
      EXPECT_FALSE(request.error().code.empty() || request.error().detail.empty());
    }
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(accepted, count / 100) << "the mutations are too harsh to test anything";
  costs.expect_small("recipe", count, accepted);
}

}  // namespace
}  // namespace kiln::test
