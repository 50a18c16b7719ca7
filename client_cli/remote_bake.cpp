#include "client_cli/remote_bake.h"

#include <filesystem>

#include "client_cli/files.h"
#include "client_cli/models.h"
#include "client_cli/progress_bar.h"

namespace kiln {
namespace {

/// An artefact's name comes from the server: it may name a file in the folder and nothing else.
bool is_plain_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && name.find_first_of("/\\") == std::string::npos &&
         name.find('\0') == std::string::npos;
}

/// A bake whose input was refused by the worker ends as a refusal, as it does in this process.
ExitCode exit_of_bake(const JobReply& job) {
  return job.status == "failed" && job.error && job.error->status == 422 ? ExitCode::rejected : exit_of(job);
}

void show_event(const ServerEvent& event, ProgressBar& bar) {
  if (event.type != "progress") return;
  if (const auto progress = parse_progress(event.data)) bar.update(*progress);
}

}  // namespace

Outcome<JobInput> job_input(const std::string& input, const RecipeOptions& options,
                            const std::string& idempotency_key) {
  KILN_TRY(recipe, load_recipe(options, true));
  KILN_TRY(scene, load_files(input));
  return JobInput{std::move(recipe), std::move(scene), idempotency_key};
}

Outcome<JobReply> watch_with_bar(ServerLink& link, const std::string& id) {
  ProgressBar bar(link.session().terminal);
  auto job = watch_job(link, id, [&](const ServerEvent& event) { show_event(event, bar); });
  bar.clear();
  if (!job && job.error().exit == ExitCode::interrupted) {
    say("detached; job " + id + " goes on");
    say("to see it:    kiln watch " + id + " --server " + link.url());
    say("to cancel it: kiln cancel " + id + " --server " + link.url());
  }
  return job;
}

void show_end(const JobReply& job, const Session& session) {
  if (job.status == "canceled") say("job " + job.id + " was canceled");
  if (job.status != "failed") return;
  Failure failure{ExitCode::job_failed, job.error.value_or(Problem{})};
  if (failure.problem.detail.empty()) failure.problem.detail = "job " + job.id + " failed without a reason";
  show_failure(session.terminal, failure);
}

Outcome<BakedFiles> download_all(ServerLink& link, const JobReply& job, const std::string& folder,
                                 const std::string& name) {
  const Outcome<void> made = make_folder(folder);
  if (!made) return tl::make_unexpected(made.error());
  BakedFiles files{folder, {}, {}};
  for (const ArtifactReply& artifact : job.artifacts) {
    if (!name.empty() && artifact.name != name) continue;
    if (!is_plain_name(artifact.name))
      return fail(ExitCode::error, "bad_reply", "the server named an artefact that is no file name", artifact.name);
    const std::string path = (std::filesystem::path(folder) / artifact.name).string();
    const Outcome<void> got = download_artifact(link, job.id, artifact, path);
    if (!got) return tl::make_unexpected(got.error());
    files.names.push_back(artifact.name);
    if (artifact.name != "report.json") continue;
    KILN_TRY(report, read_text(path));
    files.report = std::move(report);
  }
  if (!name.empty() && files.names.empty())
    return fail(ExitCode::not_found, "not_found", "job " + job.id + " has no such artefact", name);
  return files;
}

Outcome<ExitCode> bake_remotely(const BakeOptions& options, Session& session) {
  const std::string folder = output_folder(options.output, options.input);
  if (const Outcome<void> usable = check_folder(folder); !usable) return tl::make_unexpected(usable.error());
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(input, job_input(options.input, options.recipe, options.idempotency_key));
  KILN_TRY(submitted, submit_job(link, input));
  say("job " + submitted.id + (submitted.cached ? ", known already" : ""));
  KILN_TRY(job, is_terminal(submitted) ? Outcome<JobReply>(submitted) : watch_with_bar(link, submitted.id));
  show_end(job, session);
  if (job.status != "succeeded") return exit_of_bake(job);
  KILN_TRY(files, download_all(link, job, folder, ""));
  return show_bake(files, options.max_error, session);
}

}  // namespace kiln
