// The published schema and the parser must agree on every document.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "core/bake/recipe.h"

namespace kiln {
namespace {

bool schema_accepts(const nlohmann::json& document) {
  const nlohmann::json text = nlohmann::json::parse(recipe_schema());
  valijson::Schema schema;
  valijson::SchemaParser parser;
  parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(text), schema);
  valijson::Validator validator;
  return validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), nullptr);
}

class SchemaAndParser : public testing::TestWithParam<std::pair<const char*, bool>> {};

TEST_P(SchemaAndParser, AgreeOnADocument) {
  const auto& [text, good] = GetParam();
  EXPECT_EQ(parse_recipe(text).has_value(), good) << text;
  EXPECT_EQ(schema_accepts(nlohmann::json::parse(text)), good) << text;
}

INSTANTIATE_TEST_SUITE_P(
    Documents, SchemaAndParser,
    testing::Values(
        std::pair{R"({"steps":[{"do":"prt","merge":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"prt","merge":"on"}]})", true},
        std::pair{R"({"steps":[{"do":"prt","merge":true}]})", false},
        std::pair{R"({"steps":[{"do":"prt","solver":"vertices"}]})", true},
        std::pair{R"({"steps":[{"do":"prt","solver":"points"}]})", false},
        std::pair{R"({"steps":[{"do":"prt","solver":"meshless"}]})", true},
        std::pair{R"({"steps":[{"do":"prt","solver":"meshless","eps_transfer":0.1,
                               "points":{"radius":0.5,"levels":4}}]})",
                  true},
        std::pair{R"({"steps":[{"do":"prt","solver":"meshless","eps_transfer":-1}]})", false},
        std::pair{R"({"steps":[{"do":"prt","solver":"meshless","points":{"radius":0}}]})", false},
        std::pair{R"({"steps":[{"do":"prt","solver":"vertices","eps_transfer":0.1}]})", false},
        std::pair{R"({"steps":[{"do":"prt","points":{"levels":4}}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","merge":"on"}]})", false}, std::pair{"{}", true},
        std::pair{R"({"quality":"final"})", true}, std::pair{R"({"quality":"best"})", false},
        std::pair{R"({"quality":{"target_error":0.1}})", true}, std::pair{R"({"quality":{"target_error":0}})", false},
        std::pair{R"({"quality":{"target_error":-0.1}})", false},
        std::pair{R"({"quality":{"target_error":1.5}})", false},
        std::pair{R"({"quality":{"target_error":"low"}})", false},
        std::pair{R"({"quality":{"time_budget_s":0}})", false},
        std::pair{R"({"quality":{"time_budget_s":1e9}})", false},
        std::pair{R"({"quality":{"target_error":0.1,"time_budget_s":60}})", true},
        std::pair{R"({"quality":{}})", false}, std::pair{R"({"quality":{"speed":1}})", false},
        std::pair{R"({"steps":[]})", false}, std::pair{R"({"steps":[{}]})", false},
        std::pair{R"({"steps":[{"do":"bricks"}]})", false}, std::pair{R"({"steps":[{"do":"grid"}]})", true},
        std::pair{R"({"steps":[{"do":"grid","resolution":[16,8,1],"content":"all","blend":"paper","bounces":2,
                                 "samples":64}]})",
                  true},
        std::pair{R"({"steps":[{"do":"grid","resolution":"auto","bounces":"auto","samples":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"grid","resolution":[16,8]}]})", false},
        std::pair{R"({"steps":[{"do":"grid","resolution":[16,8,0]}]})", false},
        std::pair{R"({"steps":[{"do":"grid","resolution":[16,8,513]}]})", false},
        std::pair{R"({"steps":[{"do":"grid","resolution":[16,8,2.5]}]})", false},
        std::pair{R"({"steps":[{"do":"grid","resolution":16}]})", false},
        std::pair{R"({"steps":[{"do":"grid","content":"direct"}]})", false},
        std::pair{R"({"steps":[{"do":"grid","blend":"sh"}]})", false},
        std::pair{R"({"steps":[{"do":"grid","rays":6}]})", false}, std::pair{R"({"steps":[{"do":"reduce"}]})", true},
        std::pair{R"({"steps":[{"do":"reduce","triangles":1000,"method":"cluster","normal_map":512}]})", true},
        std::pair{R"({"steps":[{"do":"reduce","triangles":"auto","ratio":0.5,"normal_map":"off"}]})", true},
        std::pair{R"({"steps":[{"do":"reduce","triangles":1000,"ratio":0.5}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","triangles":3}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","ratio":0}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","ratio":1.5}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","method":"sloppy"}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","normal_bits":16}]})", true},
        std::pair{R"({"steps":[{"do":"reduce","normal_bits":12}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","normal_map":63}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","normal_map":"on"}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","normal_map":0}]})", false},
        std::pair{R"({"steps":[{"do":"reduce","samples":4}]})", false},
        std::pair{R"({"steps":[{"do":"reduce"},{"do":"prt","order":4}]})", true},
        std::pair{R"({"steps":[{"do":"reduce","ratio":0.5},{"do":"grid"}]})", true},
        std::pair{R"({"steps":[{"do":"prt"},{"do":"reduce"}]})", false},
        std::pair{R"({"steps":[{"do":"reduce"},{"do":"reduce"}]})", false},
        std::pair{R"({"steps":[{"do":"prt"},{"do":"grid"}]})", false},
        std::pair{R"({"steps":[{"do":"reduce"},{"do":"prt","order":0}]})", false},
        std::pair{R"({"steps":[{"do":"reduce"},{"do":"prt"},{"do":"grid"}]})", false},
        std::pair{R"({"steps":[{"do":"prt","order":"auto","bounces":3,"samples":65536}]})", true},
        std::pair{R"({"steps":[{"do":"prt","samples":0}]})", false},
        std::pair{R"({"steps":[{"do":"prt","subdivide":"off"}]})", true},
        std::pair{R"({"steps":[{"do":"prt","subdivide":{"triangles":"auto","threshold":0}}]})", true},
        std::pair{R"({"steps":[{"do":"prt","subdivide":{"triangles":0}}]})", false},
        std::pair{R"({"steps":[{"do":"prt","encoding":{"form":"pca","rank":24}}]})", true},
        std::pair{R"({"steps":[{"do":"prt","encoding":{"form":"raw","rank":24}}]})", false},
        std::pair{R"({"steps":[{"do":"prt","encoding":{"rank":0}}]})", false},
        std::pair{R"({"steps":[{"do":"prt","encoding":{"form":"zip"}}]})", false},
        std::pair{R"({"steps":[{"do":"prt","encoding":{"bits":8}}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity"}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"rows","rays":64,"bounces":"auto",
                                 "points":{"radius":0.5,"levels":4},"eps_irradiance":0.1,"subdivide":"off"}]})",
                  true},
        std::pair{R"({"steps":[{"do":"radiosity","points":{"radius":"auto"},"eps_irradiance":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","points":{"radius":0}}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"paper"}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"paper","eps_solid_angle":0.1}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"paper","eps_solid_angle":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"paper","eps_solid_angle":13}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","eps_solid_angle":0.1}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"rows","eps_solid_angle":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","scheme":"columns"}]})", false},
        std::pair{R"({"steps":[{"do":"transport","scheme":"rows"}]})", true},
        std::pair{R"({"steps":[{"do":"transport","scheme":"paper"}]})", false},
        std::pair{R"({"steps":[{"do":"grid","scheme":"paper"}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["points","lightmap"],"lightmap":{"size":512}}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":"auto"}}]})", true},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":[]}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":"lightmap"}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["vertices","vertices"]}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["textures"]}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","lightmap":{"size":512}}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["points"],"lightmap":{"size":512}}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","deliver":["lightmap"],"lightmap":{"size":8}}]})", false},
        std::pair{R"({"steps":[{"do":"transport","deliver":["lightmap"]}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","order":6}]})", false},
        std::pair{R"({"steps":[{"do":"transport"}]})", true},
        std::pair{R"({"steps":[{"do":"transport","rays":64,"sender_level":2,"bounces":3}]})", true},
        std::pair{R"({"steps":[{"do":"transport","sender_level":"auto"}]})", true},
        std::pair{R"({"steps":[{"do":"transport","sender_level":12}]})", false},
        std::pair{R"({"steps":[{"do":"radiosity","sender_level":2}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield"}]})", true},
        std::pair{R"({"steps":[{"do":"reduce"},{"do":"lightfield","degree":0,"rays":64,"lods":8,"progressive":true}]})",
                  true},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"ratio":0.25,"collapse":"half-edge"}}]})", true},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"max_error":0,"geometry_weight":1}}]})", true},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"ratio":0}}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"ratio":1.5}}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"ratio":0.5,"triangles":100}}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":{"collapse":"vertex"}}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","simplify":"on"}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","degree":9}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","basis":"wavelets"}]})", false},
        std::pair{R"({"steps":[{"do":"lightfield","basis":"polynomial","degree":4}]})", true},
        std::pair{R"({"steps":[{"do":"prt","rays":6}]})", false}, std::pair{R"({"scene":{"asset":"zz"}})", false},
        std::pair{R"({"environment":{"builtin":"overcast","rotation_deg":-90}})", true},
        std::pair{R"({"environment":{"constant":[0,1,2]}})", true},
        std::pair{R"({"environment":{"constant":[0,-1,2]}})", false}, std::pair{R"({"limits":{"memory_mb":1}})", false},
        std::pair{R"({"limits":{"wall_s":0.5}})", true}, std::pair{R"({"label":7})", false},
        std::pair{R"({"extra":7})", false}));

}  // namespace
}  // namespace kiln
