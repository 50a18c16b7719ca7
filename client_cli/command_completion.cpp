// kiln completion SHELL: a script that completes commands, their options, presets, and files.
//   bash   source <(kiln completion bash)
//   zsh    source <(kiln completion zsh)
//   fish   kiln completion fish | source
#include "client_cli/arguments.h"
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "core/bake/demo_scene.h"
#include "core/bake/recipe.h"

namespace kiln {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : " ") + word;
  return out;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const Preset& preset : presets()) names.push_back(preset.name);
  return names;
}

std::string command_names() {
  std::vector<std::string> names{"help"};
  for (const CommandWords& command : command_words()) names.push_back(command.name);
  return joined(names);
}

/// What may follow an option or command whose values are words and not files.
struct Values {
  std::string after, words;
};

std::vector<Values> known_values() {
  return {{"--preset", joined(preset_names())},
          {"--quality", "draft standard final"},
          {"--albedo", "one scene"},
          {"--column", "irradiance radiance"},
          {"--status", "queued running succeeded failed canceled"},
          {"completion", "bash zsh fish"},
          {"demo-scene", joined(demo_scene_names())},
          {"help", command_names()}};
}

std::string bash_script() {
  std::string out =
      "_kiln() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} words=\n"
      "  case \"$previous\" in\n";
  for (const Values& values : known_values())
    out += "    " + values.after + ") COMPREPLY=($(compgen -W '" + values.words + "' -- \"$current\")); return ;;\n";
  out += "  esac\n  if [ \"$COMP_CWORD\" -eq 1 ]; then words='" + command_names() + " --help --version'; fi\n";
  out += "  if [[ $current == -* && $COMP_CWORD -gt 1 ]]; then\n    case \"${COMP_WORDS[1]}\" in\n";
  for (const CommandWords& command : command_words())
    out += "      " + command.name + ") words='" + joined(command.options) + "' ;;\n";
  out +=
      "    esac\n  fi\n"
      "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
      "}\n"
      "complete -o default -o bashdefault -F _kiln kiln\n";
  return out;
}

/// zsh runs the bash function through its own compatibility layer.
std::string zsh_script() { return "autoload -U +X bashcompinit && bashcompinit\n" + bash_script(); }

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

std::string fish_script() {
  std::string out;
  for (const CommandWords& command : command_words()) {
    out += "complete -c kiln -n __fish_use_subcommand -a " + command.name + " -d " + quoted(command.description) + "\n";
    for (const std::string& option : command.options)
      out += "complete -c kiln -n '__fish_seen_subcommand_from " + command.name + "' -l " + option.substr(2) + "\n";
  }
  for (const Values& values : known_values()) {
    const bool option = values.after.rfind("--", 0) == 0;
    out += option ? "complete -c kiln -l " + values.after.substr(2) + " -x -a " + quoted(values.words) + "\n"
                  : "complete -c kiln -n '__fish_seen_subcommand_from " + values.after + "' -f -a " +
                        quoted(values.words) + "\n";
  }
  return out;
}

}  // namespace

Outcome<ExitCode> run(const CompletionOptions& options, Session&) {
  const std::string script = options.shell == "bash"  ? bash_script()
                             : options.shell == "zsh" ? zsh_script()
                                                      : fish_script();
  const Outcome<void> written = write_text("", script);
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
