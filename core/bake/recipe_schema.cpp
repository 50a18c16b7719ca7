// The JSON Schema of a recipe, beside the parser that enforces it: tests hold the two against each other.
#include "core/bake/recipe.h"

namespace kiln {

std::string recipe_schema() {
  return R"json({
  "$schema": "http://json-schema.org/draft-07/schema#",
  "$id": "https://kiln.invalid/v1/schema/recipe.json",
  "title": "Kiln recipe",
  "type": "object",
  "additionalProperties": false,
  "definitions": {
    "sha256": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
    "auto": {"const": "auto"},
    "gather_scheme": {"description": "rows: the transport operator is traced once and kept", "enum": ["rows"], "default": "rows"},
    "gather_points": {
      "type": "object", "additionalProperties": false,
      "properties": {
        "radius": {"description": "of the coarsest points, metres", "anyOf": [{"type": "number", "minimum": 1e-9, "maximum": 1e12}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "levels": {"description": "each halves the radius", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 12}, {"$ref": "#/definitions/auto"}], "default": "auto"}
      }
    },
    "eps_irradiance": {"description": "prediction error that asks for finer points, of the mean light", "anyOf": [{"type": "number", "minimum": 0, "maximum": 1e6}, {"$ref": "#/definitions/auto"}], "default": "auto"},
    "gather_rays": {"description": "of a gather", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 65536}, {"$ref": "#/definitions/auto"}], "default": "auto"},
    "gather_bounces": {"description": "reflections between surfaces; auto: until a ten-thousandth of the light is left", "anyOf": [{"type": "integer", "minimum": 0, "maximum": 1000}, {"$ref": "#/definitions/auto"}], "default": "auto"},
    "subdivide": {
      "default": "auto",
      "anyOf": [{"enum": ["auto", "off"]}, {
        "type": "object", "additionalProperties": false,
        "properties": {
          "measure": {"enum": ["residual", "eq2", "eq3", "eq4"], "default": "residual"},
          "alpha": {"type": "number", "minimum": 0, "maximum": 1e6, "default": 1},
          "threshold": {"description": "split while the measure is above", "type": "number", "minimum": 0, "maximum": 1e30},
          "triangles": {"description": "budget of the final mesh", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 50000000}, {"$ref": "#/definitions/auto"}], "default": "auto"},
          "max_depth": {"type": "integer", "minimum": 0, "maximum": 16, "default": 8}
        }
      }]
    },
    "prt": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "anyOf": [{"required": ["solver"], "properties": {"solver": {"const": "meshless"}}},
                {"not": {"anyOf": [{"required": ["points"]}, {"required": ["eps_transfer"]}]}}],
      "properties": {
        "do": {"enum": ["prt"]},
        "order": {"description": "SH bands; coefficients = order^2", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 10}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "bounces": {"description": "reflections between surfaces", "anyOf": [{"type": "integer", "minimum": 0, "maximum": 64}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "samples": {"description": "rays per vertex", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 65536}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "solver": {"description": "where reflected light and matrices are computed: at every vertex, or at points on the surface, fewer where they change little", "enum": ["vertices", "meshless"], "default": "vertices"},
        "points": {"$ref": "#/definitions/gather_points"},
        "eps_transfer": {"description": "finer points have matrices where one differs in the 1-norm by more than this from what coarser points predict, in parts of the light that arrives", "anyOf": [{"type": "number", "minimum": 0, "maximum": 1e6}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "merge": {"description": "collapse edges that light and shape do not need, before vertices are added where light changes: auto where the input has many, on always", "enum": ["auto", "on", "off"], "default": "auto"},
        "glossy": {"description": "transfer matrices for specular reflection: auto where it shows, on everywhere", "enum": ["auto", "on", "off"], "default": "auto"},
        "subdivide": {"$ref": "#/definitions/subdivide"},
        "encoding": {
          "type": "object", "additionalProperties": false,
          "not": {"required": ["form", "rank"], "properties": {"form": {"const": "raw"}, "rank": {"type": "integer"}}},
          "properties": {
            "form": {"description": "raw: every coefficient; pca: weights of principal components; auto: what is smaller", "enum": ["auto", "raw", "pca"], "default": "auto"},
            "rank": {"description": "components; auto: as few as a tenth of the error target allows", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 300}, {"$ref": "#/definitions/auto"}], "default": "auto"},
            "bits": {"description": "of each stored number", "anyOf": [{"type": "integer", "minimum": 4, "maximum": 20}, {"$ref": "#/definitions/auto"}], "default": "auto"}
          }
        }
      }
    },
    "radiosity": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "allOf": [
        {"not": {"required": ["lightmap"], "properties": {"deliver": {"not": {"contains": {"enum": ["lightmap"]}}}}}},
        {"anyOf": [{"required": ["scheme"], "properties": {"scheme": {"enum": ["paper"]}}}, {"properties": {"eps_solid_angle": {"$ref": "#/definitions/auto"}}}]}
      ],
      "properties": {
        "do": {"enum": ["radiosity"]},
        "scheme": {"description": "rows: transport is traced once, bounces are sparse sweeps; paper: that of Lehtinen et al. 2007, slower, for comparison", "enum": ["rows", "paper"], "default": "rows"},
        "eps_solid_angle": {"description": "scheme paper: solid angle, sr, below which functions where a ray lands are fine enough; auto: pi / 10", "anyOf": [{"type": "number", "minimum": 0, "maximum": 12.566370614359172}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "points": {"$ref": "#/definitions/gather_points"},
        "eps_irradiance": {"$ref": "#/definitions/eps_irradiance"},
        "rays": {"$ref": "#/definitions/gather_rays"},
        "bounces": {"$ref": "#/definitions/gather_bounces"},
        "subdivide": {"$ref": "#/definitions/subdivide"},
        "deliver": {
          "description": "where the light goes: to the vertices, which are split where it changes; into a lightmap over TEXCOORD_1 (MOZ_lightmap in scene.glb, and lightmap.exr); as the hierarchy of points that it was solved on (KILN_meshless_light). Without vertices the mesh is not split",
          "type": "array", "minItems": 1, "uniqueItems": true, "items": {"enum": ["vertices", "lightmap", "points"]}, "default": ["vertices"]
        },
        "lightmap": {
          "type": "object", "additionalProperties": false,
          "properties": {"size": {"description": "texels along a side; auto: as many as the quality has for the surface", "anyOf": [{"type": "integer", "minimum": 16, "maximum": 8192}, {"$ref": "#/definitions/auto"}], "default": "auto"}}
        }
      }
    },
    "transport": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "properties": {
        "do": {"enum": ["transport"]},
        "scheme": {"$ref": "#/definitions/gather_scheme"},
        "points": {"$ref": "#/definitions/gather_points"},
        "eps_irradiance": {"$ref": "#/definitions/eps_irradiance"},
        "rays": {"$ref": "#/definitions/gather_rays"},
        "bounces": {"$ref": "#/definitions/gather_bounces"},
        "subdivide": {"$ref": "#/definitions/subdivide"},
        "sender_level": {"description": "the finest level of points that send, from 0; auto: the finest with at most 6000 (draft), 12000 or 40000 (final) points", "anyOf": [{"type": "integer", "minimum": 0, "maximum": 11}, {"$ref": "#/definitions/auto"}], "default": "auto"}
      }
    },
    "grid": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "properties": {
        "do": {"enum": ["grid"]},
        "resolution": {"description": "vertices along x, y and z", "anyOf": [{"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "integer", "minimum": 1, "maximum": 512}}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "content": {"description": "indirect: reflected light; all: lamps and sky too", "enum": ["indirect", "all"], "default": "indirect"},
        "blend": {"description": "exact: nine numbers a channel, right for light of three SH bands; paper: Pacanowski's twelve textures", "enum": ["exact", "paper"], "default": "exact"},
        "bounces": {"description": "reflections between surfaces", "anyOf": [{"type": "integer", "minimum": 0, "maximum": 1000}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "samples": {"description": "rays of a vertex", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 65536}, {"$ref": "#/definitions/auto"}], "default": "auto"}
      }
    },
    "lightfield": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "properties": {
        "do": {"enum": ["lightfield"]},
        "basis": {"description": "what is fitted: spherical harmonics, (degree + 1)^2 coefficients, or polynomials of the direction along the surface, (degree + 1)(degree + 2) / 2; files hold harmonics in world axes in either case", "enum": ["sh", "polynomial"], "default": "sh"},
        "sky": {"description": "apart: smooth surfaces mirror the sky as it is, as much of it as each vertex sees; series: everything is in the series; auto: apart where something mirrors the sky more sharply than the series can say", "enum": ["auto", "apart", "series"], "default": "auto"},
        "degree": {"description": "bands 0 .. degree of radiance towards the eye; not used where the file carries its light", "anyOf": [{"type": "integer", "minimum": 0, "maximum": 8}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "rays": {"description": "of a vertex", "anyOf": [{"type": "integer", "minimum": 1, "maximum": 65536}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "bounces": {"$ref": "#/definitions/gather_bounces"},
        "subdivide": {"$ref": "#/definitions/subdivide"},
        "simplify": {
          "default": "auto",
          "anyOf": [{"enum": ["auto", "off"]}, {
            "type": "object", "additionalProperties": false,
            "not": {"required": ["triangles", "ratio"]},
            "properties": {
              "ratio": {"description": "of the baked triangles", "type": "number", "minimum": 1e-6, "maximum": 1},
              "triangles": {"description": "of the result, at most, where topology allows", "type": "integer", "minimum": 4, "maximum": 50000000},
              "max_error": {"description": "relRMSE that simplification may add, by its own estimate", "type": "number", "minimum": 0, "maximum": 1},
              "collapse": {"description": "where joint vertices lie: where quadrics are least, or at one end", "enum": ["edge", "half-edge"], "default": "edge"},
              "geometry_weight": {"description": "share of shape in the cost of a collapse; light has the rest", "type": "number", "minimum": 0, "maximum": 1, "default": 0.01}
            }
          }]
        },
        "lods": {"description": "coarser files lod1.glb ..., each of a quarter of the triangles before it", "type": "integer", "minimum": 0, "maximum": 8, "default": 0},
        "progressive": {"description": "KILN_progressive_mesh in scene.glb: every level of detail by vertex splits", "type": "boolean", "default": false}
      }
    },
    "light": {"anyOf": [{"$ref": "#/definitions/prt"}, {"$ref": "#/definitions/radiosity"}, {"$ref": "#/definitions/grid"}, {"$ref": "#/definitions/transport"}, {"$ref": "#/definitions/lightfield"}]},
    "reduce": {
      "type": "object", "required": ["do"], "additionalProperties": false,
      "not": {"required": ["triangles", "ratio"], "properties": {"triangles": {"type": "integer"}}},
      "properties": {
        "do": {"enum": ["reduce"]},
        "triangles": {"description": "of the result, at most; auto: a tenth of the model's, at most 200000", "anyOf": [{"type": "integer", "minimum": 4, "maximum": 50000000}, {"$ref": "#/definitions/auto"}], "default": "auto"},
        "ratio": {"description": "of the model's triangles, instead of triangles", "type": "number", "minimum": 1e-6, "maximum": 1},
        "method": {"description": "what a model larger than limits.memory_mb goes through first: cells of one size, or an octree that is fine where the model is curved", "enum": ["cluster", "adaptive"], "default": "adaptive"},
        "normal_map": {"description": "texels along a side", "anyOf": [{"type": "integer", "minimum": 64, "maximum": 8192}, {"enum": ["auto", "off"]}], "default": "auto"},
        "normal_bits": {"description": "of a value of the normal map; viewers in browsers show eight of sixteen", "enum": [8, 16], "default": 8}
      }
    }
  },
  "properties": {
    "scene": {"type": "object", "additionalProperties": false, "properties": {"asset": {"$ref": "#/definitions/sha256"}}},
    "environment": {
      "type": "object", "additionalProperties": false,
      "description": "Distant light. At most one of asset, file (command line only), constant and builtin; none of them, or no environment: the scene's own lights.",
      "properties": {
        "asset": {"$ref": "#/definitions/sha256"},
        "file": {"type": "string", "maxLength": 4096},
        "constant": {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": "number", "minimum": 0, "maximum": 1e9}},
        "builtin": {"enum": ["uniform", "overcast", "clear", "courtyard"]},
        "rotation_deg": {"type": "number", "minimum": -360, "maximum": 360, "default": 0},
        "intensity": {"type": "number", "minimum": 0, "maximum": 1e9, "default": 1}
      }
    },
    "steps": {
      "type": "array", "minItems": 1, "default": [{"do": "prt"}],
      "anyOf": [
        {"maxItems": 1, "items": {"anyOf": [{"$ref": "#/definitions/light"}, {"$ref": "#/definitions/reduce"}]}},
        {"minItems": 2, "maxItems": 2, "items": [{"$ref": "#/definitions/reduce"}, {"$ref": "#/definitions/light"}]}
      ]
    },
    "quality": {
      "default": "standard",
      "anyOf": [{"enum": ["draft", "standard", "final"]}, {
        "type": "object", "additionalProperties": false, "minProperties": 1,
        "description": "What the bake must reach; of both, whichever comes first.",
        "properties": {
          "target_error": {"description": "relRMSE that the upper end of the certificate's interval must not exceed; of a light field towards eyes, and simplified until it does; of transport that of links, relative to the root mean square of each lamp's light", "type": "number", "minimum": 1e-4, "maximum": 1},
          "time_budget_s": {"description": "seconds of the whole bake, kept within 20 %", "type": "number", "minimum": 0.01, "maximum": 2592000}
        }
      }]
    },
    "seed": {"type": "integer", "minimum": 0, "maximum": 9007199254740991, "default": 0},
    "limits": {
      "type": "object", "additionalProperties": false,
      "properties": {
        "memory_mb": {"type": "integer", "minimum": 64, "maximum": 1048576, "default": 4096},
        "threads": {"description": "0: all", "type": "integer", "minimum": 0, "maximum": 1024, "default": 0},
        "wall_s": {"type": "number", "minimum": 0.1, "maximum": 2592000, "default": 3600}
      }
    },
    "strict": {"description": "refuse what would be a warning", "type": "boolean", "default": false},
    "certificate": {"description": "measure the error of the result", "type": "boolean", "default": true},
    "label": {"type": "string", "maxLength": 200, "default": ""}
  }
})json";
}

}  // namespace kiln
