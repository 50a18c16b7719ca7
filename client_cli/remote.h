#pragma once
// What a client asks of a server: upload, submit, watch, download.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "client_cli/recipe_input.h"
#include "client_cli/server_link.h"
#include "client_cli/sse.h"
#include "server/api/job.h"

namespace kiln {

/// What a job is made from: a recipe and the files of a scene.
struct JobInput {
  LoadedRecipe recipe;
  SceneFiles scene;
  std::string idempotency_key;  // empty: none
};

/// Uploads bytes under their hash unless the server knows them; goes on where an earlier upload broke, more than 16 MiB
/// in pieces. The hash.
Outcome<std::string> upload_asset(ServerLink&, std::span<const std::uint8_t> bytes, const std::string& name);

/// Sends bytes in pieces of 16 MiB (tus 1.0), over lost connections: those that arrived are not sent again. False when
/// this address does not keep uploads: an older server, or a balancer before servers that do not share them.
/// Fails  unreachable when nothing more arrives for a minute, interrupted
Outcome<bool> upload_in_pieces(ServerLink&, std::span<const std::uint8_t> bytes, const std::string& sha256);

/// Uploads the scene if it is not known and posts the job to /v1/jobs. A .gltf with files beside it, or an environment
/// file, goes as one form, so that the files keep their names.
Outcome<JobReply> submit_job(ServerLink&, const JobInput&);
/// The same to /v1/plan: the plan as JSON.
Outcome<std::string> request_plan(ServerLink&, const JobInput&);

Outcome<JobReply> fetch_job(ServerLink&, const std::string& id);

/// Follows a job to its end, over lost connections. `on_event` sees every event.
/// Fails  unreachable when the server stays away for a minute, interrupted (the job goes on), not_found
Outcome<JobReply> watch_job(ServerLink&, const std::string& id,
                            const std::function<void(const ServerEvent&)>& on_event);

/// Downloads one artefact and checks its hash; tries again when a transfer broke.
Outcome<void> download_artifact(ServerLink&, const std::string& id, const ArtifactReply&, const std::string& path);

/// A job's id as part of a path. Fails  usage: an id has letters, digits, - and _ only
Outcome<std::string> job_path(const std::string& id);

/// 3 for a failed job, 4 for a canceled one.
ExitCode exit_of(const JobReply&);

}  // namespace kiln
