#include "cli/texts.hpp"
#include "cli/verbs.hpp"

namespace panonav::command {

namespace {

Run declare_help(Arguments& arguments) {
  auto words = std::make_shared<std::vector<std::string>>();
  arguments.optional_positionals("VERB", *words, "Verb to explain; default: a list of all verbs",
                                 verb_names());
  return [words](Session& session) {
    const auto verbs = all_verbs();
    return print_text(words->empty() ? overview(verbs)
                                     : format_help(describe(find_named_verb(verbs, *words)), false),
                      session);
  };
}

}  // namespace

Verb help_verb() {
  return {"help",
          VerbGroup::tools,
          "Explain a verb",
          "panonav help VERB is the same as panonav VERB --help. panonav VERB --help-all lists all "
          "options of a verb.",
          "  panonav help\n  panonav help route record",
          declare_help};
}

}  // namespace panonav::command
