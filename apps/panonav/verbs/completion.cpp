#include "cli/texts.hpp"
#include "cli/verbs.hpp"

namespace panonav::command {

namespace {

Run declare_completion(Arguments& arguments) {
  auto shell = std::make_shared<std::string>();
  arguments.positional("SHELL", *shell, "bash, zsh or fish", completion_shells());
  return [shell](Session& session) {
    return print_text(completion_script(describe(all_verbs()), *shell), session);
  };
}

}  // namespace

Verb completion_verb() {
  return {"completion", "Print a script that lets a shell complete verbs, options and values",
          "The bash script is read with source, the fish script is kept in the folder "
          "~/.config/fish/completions as panonav.fish, and the zsh script in a folder of fpath as "
          "_panonav. An installed panonav has them already.",
          "  panonav completion bash\n  panonav completion fish", declare_completion};
}

}  // namespace panonav::command
