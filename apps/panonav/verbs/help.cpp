#include "cli/texts.hpp"
#include "cli/verbs.hpp"

namespace panonav::command {

namespace {

Run declare_help(Arguments& arguments) {
  auto words = std::make_shared<std::vector<std::string>>();
  arguments.optional_positionals("VERB", *words,
                                 "Verb to explain; none: all verbs with a line each", verb_names());
  return [words](Session& session) {
    const auto verbs = all_verbs();
    return print_text(words->empty() ? overview(verbs)
                                     : help_text(describe(find_named_verb(verbs, *words)), false),
                      session);
  };
}

}  // namespace

Verb help_verb() {
  return {"help", "Show how a verb is used",
          "The same as panonav VERB --help. panonav VERB --help-all shows every option of a verb.",
          "  panonav help\n  panonav help route record", declare_help};
}

}  // namespace panonav::command
