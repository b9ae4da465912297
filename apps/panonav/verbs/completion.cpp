#include "cli/texts.hpp"
#include "cli/verbs.hpp"

namespace panonav::command {

namespace {

Run declare_completion(Arguments& arguments) {
  auto shell = std::make_shared<std::string>();
  arguments.positional("SHELL", *shell, "Name of the shell: bash, zsh or fish",
                       completion_shells());
  return [shell](Session& session) {
    return print_text(completion_script(describe(all_verbs()), *shell), session);
  };
}

}  // namespace

Verb completion_verb() {
  return {"completion",
          VerbGroup::tools,
          "Print a completion script for a shell",
          "Load the bash script with 'source'. Save the fish script as "
          "~/.config/fish/completions/panonav.fish and the zsh script as _panonav in a folder of "
          "$fpath. If panonav is installed, these scripts are installed, too.",
          "  panonav completion bash\n  panonav completion fish",
          declare_completion};
}

}  // namespace panonav::command
