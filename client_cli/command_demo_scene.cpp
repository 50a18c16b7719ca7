// kiln demo-scene NAME: a bundled scene as a GLB.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "core/bake/demo_scene.h"

namespace kiln {

Outcome<ExitCode> run(const DemoSceneOptions& options, Session&) {
  const auto scene = demo_scene(options.name);
  if (!scene) {
    std::string known;
    for (const std::string& name : demo_scene_names()) known += (known.empty() ? "" : ", ") + name;
    return fail(ExitCode::not_found, "not_found", "is no bundled scene; there are " + known, options.name);
  }
  const Outcome<void> written = write_file(options.output, *scene);
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
