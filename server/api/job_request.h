#pragma once
// What a user asks for: bodies and queries become typed requests here, or a Problem that names every mistake.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/bake/recipe.h"
#include "server/api/problem.h"

namespace kiln {

using QueryParams = std::vector<std::pair<std::string, std::string>>;  // decoded, in order

/// A job document: a recipe, plus `preset` (the recipe's base; members given beside it win) and `force`.
struct JobRequest {
  Recipe recipe;
  bool force = false;  // bake even if the same result is known
};

/// Files that came with the document; each hash takes the place of the member that would name an asset.
struct JobFiles {
  std::string scene;        // sha256; empty: the document names the scene
  std::string environment;  // sha256; empty: the document says
};

inline constexpr std::size_t kMaxJobDocument = 1u << 20;  // bytes
inline constexpr int kMaxJsonDepth = 64;

/// Checks that `json` is one JSON document: UTF-8, no member named twice, nested at most kMaxJsonDepth deep.
/// Codes  malformed_json (400, with line and column), json_too_deep (422), duplicate_member (422)
Answer<void> check_json(std::string_view json);

/// Parses a job document; with `files` the job is complete or refused. All mistakes at once.
Answer<JobRequest> parse_job_request(std::string_view json, const JobFiles& files = {});

/// The job of a raw upload (its scene still unnamed), from its query: preset (required), label, environment, force,
/// quality, seed, name (of the scene). environment is the name of a built-in sky, r,g,b, or the sha256 of an asset.
Answer<JobRequest> parse_raw_request(const QueryParams&, const JobFiles& files = {});

struct JobListRequest {
  std::string status;  // empty: all
  std::string label;   // empty: all
  int limit = 50;      // 1..200
  std::string cursor;  // opaque; empty: from the newest
};

/// ?status=&label=&limit=&cursor=; an unknown or repeated name is a mistake.
Answer<JobListRequest> parse_list_request(const QueryParams&);

/// The values of the allowed names, in the order of `allowed`; empty when absent. Unknown and repeated names are
/// mistakes.
Answer<std::vector<std::string>> take_params(const QueryParams&, const std::vector<std::string>& allowed);

}  // namespace kiln
