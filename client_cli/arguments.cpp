#include "client_cli/arguments.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <sstream>

#include "client_cli/exit_code.h"
#include "core/bake/bake.h"

namespace kiln {
namespace {

constexpr const char* kServerVariable = "KILN_SERVER";
constexpr const char* kTokenVariable = "KILN_TOKEN";
constexpr const char* kFooter =
    "stdout is data, stderr is talk. Exit codes: 0 ok, 1 error, 2 usage, 3 job failed, 4 canceled, 5 not found,\n"
    "6 server unreachable, 7 input or recipe rejected, 8 target error not met, 130 interrupted.";
constexpr const char* kLightHelp = "light: .hdr or .exr file, r,g,b, builtin:NAME";

/// The program being described: its parser, and where a parsed command goes.
struct Program {
  CLI::App app{"Kiln bakes light: a glTF in, a glTF that carries its own light transport out."};
  Options options;
  bool local = false;
};

/// A subcommand whose fields become options.command when it is the one given.
template <class T>
struct Command {
  CLI::App* parser;
  std::shared_ptr<T> fields;
};

template <class T>
Command<T> add_command(Program& program, const std::string& name, const std::string& description) {
  Command<T> command{program.app.add_subcommand(name, description), std::make_shared<T>()};
  command.parser->add_flag("--json", program.options.common.json, "data as JSON");
  command.parser->final_callback([&program, fields = command.fields] { program.options.command = *fields; });
  return command;
}

void add_server(Program& program, CLI::App* parser) {
  // Not ->envname(): the library would let the variable of commands that were not given overrule the option.
  parser->add_option("--server", program.options.common.server, "address of the server; KILN_SERVER without it")
      ->type_name("URL");
}

void add_local(Program& program, CLI::App* parser) {
  add_server(program, parser);
  parser->add_flag("--local", program.local, "in this process, whatever KILN_SERVER says");
}

void add_light(CLI::App* parser, LightOptions& light, const std::string& help) {
  parser->add_option("--env", light.name, help)->type_name("LIGHT");
  parser->add_option("--rotation", light.rotation_deg, "turns the light about +Y")->type_name("DEGREES");
  parser->add_option("--intensity", light.intensity, "multiplies the light")->type_name("FACTOR");
}

void add_recipe(CLI::App* parser, RecipeOptions& recipe) {
  auto* file = parser->add_option("-r,--recipe", recipe.file, "recipe, JSON")->type_name("FILE");
  parser->add_option("--preset", recipe.preset, "named recipe (see kiln presets); prt when nothing is given")
      ->type_name("NAME")
      ->excludes(file);
  add_light(parser, recipe.light, kLightHelp + std::string("; instead of the recipe's"));
  parser->add_option("--label", recipe.label, "a name to find the job by")->type_name("TEXT");
  auto* quality = parser->add_option("--quality", recipe.quality, "draft, standard or final")->type_name("WORD");
  parser->add_option("--target-error", recipe.target_error, "bake until the certificate proves this relRMSE, as 0.02")
      ->type_name("X")
      ->excludes(quality);
  parser->add_option("--time-budget", recipe.time_budget_s, "spend this long; with a target, whichever comes first")
      ->type_name("SECONDS")
      ->excludes(quality);
  parser->add_option("--seed", recipe.seed, "of all random numbers")->type_name("N");
  parser->add_option("--threads", recipe.threads, "0: all")->type_name("N")->check(CLI::Range(0, 1024));
}

void add_submission(CLI::App* parser, std::string& input, RecipeOptions& recipe, std::string& key) {
  parser->add_option("input", input, "scene: .glb, .gltf or .ply")->required()->type_name("IN");
  add_recipe(parser, recipe);
  parser->add_flag("--force", recipe.force, "bake even if the server knows the result");
  parser->add_option("--idempotency-key", key, "the same key never makes a second job")->type_name("TEXT");
}

void add_bake(Program& program) {
  const auto command = add_command<BakeOptions>(program, "bake", "Bake a scene, here or on a server");
  auto& fields = *command.fields;
  add_submission(command.parser, fields.input, fields.recipe, fields.idempotency_key);
  command.parser->add_option("-o,--output", fields.output, "folder for the artefacts; IN-baked when not given")
      ->type_name("DIR");
  command.parser->add_option("--max-error", fields.max_error, "exit with 8 when the certified error is above")
      ->type_name("X");
  add_local(program, command.parser);
}

void add_submit(Program& program) {
  const auto command = add_command<SubmitOptions>(program, "submit", "Hand a bake to a server; its id on stdout");
  add_submission(command.parser, command.fields->input, command.fields->recipe, command.fields->idempotency_key);
  add_server(program, command.parser);
}

void add_jobs(Program& program) {
  const auto watch = add_command<WatchOptions>(program, "watch", "Follow a job to its end");
  watch.parser->add_option("id", watch.fields->id, "job")->required()->type_name("ID");
  const auto get = add_command<GetOptions>(program, "get", "Show a job, or download its artefacts");
  get.parser->add_option("id", get.fields->id, "job")->required()->type_name("ID");
  get.parser->add_option("-o,--output", get.fields->output, "folder to download to")->type_name("DIR");
  get.parser->add_option("--artifact", get.fields->artifact, "only this one")->type_name("NAME");
  const auto list = add_command<ListOptions>(program, "list", "List jobs, newest first");
  list.parser->add_option("--status", list.fields->status, "queued, running, succeeded, failed, canceled")
      ->type_name("WORD");
  list.parser->add_option("--label", list.fields->label, "only jobs of this label")->type_name("TEXT");
  list.parser->add_option("--limit", list.fields->limit, "jobs on one page")->check(CLI::Range(1, 200))->type_name("N");
  list.parser->add_option("--cursor", list.fields->cursor, "where the page before ended")->type_name("TEXT");
  list.parser->add_flag("--all", list.fields->all, "all pages");
  const auto cancel = add_command<CancelOptions>(program, "cancel", "Stop jobs");
  cancel.parser->add_option("ids", cancel.fields->ids, "jobs")->required()->type_name("ID");
  const auto remove = add_command<RemoveOptions>(program, "rm", "Forget jobs and their artefacts");
  remove.parser->add_option("ids", remove.fields->ids, "jobs")->required()->type_name("ID");
  const auto pin = add_command<PinOptions>(program, "pin", "Keep jobs or files on the server, however old they grow");
  pin.parser->add_option("ids", pin.fields->ids, "jobs, or files by their SHA-256")->required()->type_name("ID");
  pin.parser->add_flag("--off", pin.fields->off, "let them go when their time is over");
  const auto open = add_command<OpenOptions>(program, "open", "Address of a job's viewer; opens it on a desktop");
  open.parser->add_option("id", open.fields->id, "job")->required()->type_name("ID");
  for (CLI::App* parser :
       {watch.parser, get.parser, list.parser, cancel.parser, remove.parser, pin.parser, open.parser})
    add_server(program, parser);
}

void add_plan(Program& program) {
  const auto command = add_command<PlanOptions>(program, "plan", "What a bake would model and skip, and why");
  command.parser->add_option("input", command.fields->input, "scene: .glb, .gltf or .ply")->required()->type_name("IN");
  add_recipe(command.parser, command.fields->recipe);
  add_local(program, command.parser);
}

void add_albedo(CLI::App* parser, bool& scene) {
  parser
      ->add_option_function<std::string>(
          "--albedo", [&scene](const std::string& word) { scene = word == "scene"; },
          "radiance for albedo one, or as the scene's materials show it (to the eye of a point that has one)")
      ->check(CLI::IsMember({"one", "scene"}))
      ->type_name("one|scene");
}

void add_inspect(Program& program) {
  const auto command = add_command<InspectOptions>(program, "inspect", "What an artefact or a scene holds");
  command.parser->add_option("file", command.fields->file, "scene.glb of a bake, or any scene")
      ->required()
      ->type_name("FILE");
}

void add_lamp(CLI::App* parser, std::string& lamp) {
  parser->add_option("--light", lamp, "a point lamp (world metres, W/sr) in place of all other light")
      ->type_name("X,Y,Z[,R,G,B]")
      ->excludes("--env");
}

void add_eval(Program& program) {
  const auto command = add_command<EvalOptions>(program, "eval", "Light values from an artefact at points");
  auto& fields = *command.fields;
  command.parser->add_option("file", fields.file, "scene.glb or grid.exr of a bake")->required()->type_name("FILE");
  command.parser->add_option("--points", fields.points, "CSV x,y,z,nx,ny,nz[,vx,vy,vz]; - is stdin")
      ->required()
      ->type_name("P.csv");
  add_light(command.parser, fields.light, kLightHelp + std::string("; the baked light when not given"));
  add_lamp(command.parser, fields.lamp);
  command.parser->add_flag("--indirect", fields.indirect, "with --light: reflected light only");
  command.parser->add_flag("--lightmap", fields.lightmap, "what the lightmap shows, not the vertices")
      ->excludes("--light")
      ->excludes("--env");
  command.parser->add_option("--sh-order", fields.sh_order, "only the first bands of the light; 0: all")
      ->check(CLI::Range(0, 10))
      ->type_name("N");
  add_albedo(command.parser, fields.scene_albedo);
  command.parser->add_option("-o,--output", fields.output, "file instead of stdout")->type_name("FILE");
}

void add_reference(Program& program) {
  const auto command = add_command<TruthOptions>(program, "reference", "The path-traced truth at points of a scene");
  auto& fields = *command.fields;
  command.parser->add_option("input", fields.input, "scene: .glb, .gltf or .ply")->required()->type_name("IN");
  command.parser->add_option("--points", fields.points, "CSV x,y,z,nx,ny,nz[,vx,vy,vz]; - is stdin")
      ->required()
      ->type_name("P.csv");
  add_light(command.parser, fields.light, kLightHelp + std::string("; only the scene's lamps when not given"));
  add_lamp(command.parser, fields.lamp);
  command.parser->add_option("--samples", fields.samples, "paths for each point")
      ->check(CLI::Range(2, 1 << 24))
      ->type_name("N");
  command.parser->add_option("--bounces", fields.bounces, "reflections; -1: all")
      ->check(CLI::Range(-1, 1000))
      ->type_name("N");
  command.parser->add_flag("--indirect", fields.indirect, "reflected light only, as a grid holds it");
  command.parser->add_flag("--highlights", fields.highlights,
                           "towards eyes: adds highlights of punctual lights, as a light field holds them");
  command.parser->add_option("--sh-order", fields.sh_order, "projects the light to this order first; 0: full detail")
      ->check(CLI::Range(0, 10))
      ->type_name("N");
  command.parser->add_option("--seed", fields.seed, "of all random numbers")->type_name("N");
  command.parser->add_option("--threads", fields.threads, "0: all")->check(CLI::Range(0, 1024))->type_name("N");
  add_albedo(command.parser, fields.scene_albedo);
  command.parser->add_option("-o,--output", fields.output, "file instead of stdout")->type_name("FILE");
}

void add_compare(Program& program) {
  const auto command = add_command<CompareOptions>(program, "compare", "The error of A against B, with its interval");
  auto& fields = *command.fields;
  command.parser->add_option("a", fields.a, "CSV of eval, or artefact")->required()->type_name("A");
  command.parser->add_option("b", fields.b, "CSV of reference or eval, or artefact")->required()->type_name("B");
  command.parser->add_option("--max-error", fields.max_error, "exit with 8 when relRMSE is above")->type_name("X");
  command.parser->add_option("--column", fields.column, "irradiance or radiance")
      ->check(CLI::IsMember({"irradiance", "radiance"}))
      ->type_name("WORD");
  add_light(command.parser, fields.light, kLightHelp + std::string("; for artefacts; the baked light when not given"));
  add_albedo(command.parser, fields.scene_albedo);
  command.parser->add_option("--count", fields.count, "points when both are artefacts")
      ->check(CLI::Range(1, 100'000'000))
      ->type_name("N");
  command.parser->add_option("--seed", fields.seed, "of points and interval")->type_name("N");
}

void add_points(Program& program) {
  const auto command = add_command<PointsOptions>(program, "points", "Points uniform by area on a scene or artefact");
  auto& fields = *command.fields;
  command.parser->add_option("input", fields.input, "scene or artefact")->required()->type_name("IN");
  command.parser->add_option("--count", fields.count, "how many")->check(CLI::Range(0, 100'000'000))->type_name("N");
  command.parser->add_option("--seed", fields.seed, "of the random numbers")->type_name("N");
  command.parser->add_flag("--views", fields.views, "each with a random view direction");
  command.parser->add_flag("--specular", fields.specular, "only where the artefact has matrices");
  command.parser->add_option("-o,--output", fields.output, "file instead of stdout")->type_name("P.csv");
}

void add_small(Program& program) {
  add_command<PresetsOptions>(program, "presets", "The named recipes");
  const auto demo = add_command<DemoSceneOptions>(program, "demo-scene", "A bundled scene as a GLB");
  demo.parser->add_option("name", demo.fields->name, "column or room")->required()->type_name("NAME");
  demo.parser->add_option("-o,--output", demo.fields->output, "file instead of stdout")->type_name("FILE");
  const auto completion = add_command<CompletionOptions>(program, "completion", "Shell completion, as a script");
  completion.parser->add_option("shell", completion.fields->shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->type_name("SHELL");
}

void describe(Program& program) {
  program.app.name("kiln");
  program.app.require_subcommand(1);
  program.app.footer(kFooter);
  program.app.set_version_flag("--version", std::string("kiln ") + kEngineVersion);
  add_bake(program);
  add_submit(program);
  add_jobs(program);
  add_plan(program);
  add_inspect(program);
  add_eval(program);
  add_reference(program);
  add_compare(program);
  add_points(program);
  add_small(program);
}

/// "help" is a word for --help: kiln help, kiln help bake.
std::vector<std::string> words_of(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words[0] != "help") return words;
  words.erase(words.begin());
  words.resize(std::min<std::size_t>(words.size(), 1));
  words.push_back("--help");
  return words;
}

void finish(Program& program) {
  std::string& server = program.options.common.server;
  if (const char* variable = std::getenv(kServerVariable); variable && server.empty()) server = variable;
  if (program.local) server.clear();
  if (const char* token = std::getenv(kTokenVariable)) program.options.common.token = token;
}

}  // namespace

ParsedArguments parse_arguments(int argc, const char* const* argv) {
  Program program;
  describe(program);
  ParsedArguments parsed;
  try {
    std::vector<std::string> words = words_of(argc, argv);
    std::reverse(words.begin(), words.end());  // as the library wants them
    program.app.parse(words);
    finish(program);
    parsed.options = program.options;
  } catch (const CLI::ParseError& error) {
    std::ostringstream out, err;
    const int code = program.app.exit(error, out, err);
    parsed.exit = code == 0 ? 0 : static_cast<int>(ExitCode::usage);
    parsed.out = out.str();
    parsed.err = err.str();
  }
  return parsed;
}

std::vector<CommandWords> command_words() {
  Program program;
  describe(program);
  std::vector<CommandWords> all;
  for (const CLI::App* command : program.app.get_subcommands([](const CLI::App*) { return true; })) {
    CommandWords words{command->get_name(), command->get_description(), {}};
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) words.options.push_back("--" + name);
    }
    all.push_back(std::move(words));
  }
  return all;
}

}  // namespace kiln
