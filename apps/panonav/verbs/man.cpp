#include <filesystem>
#include <optional>

#include "cli/texts.hpp"
#include "cli/verbs.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct ManArguments {
  std::vector<std::string> words;
  std::optional<std::string> out;
};

ExitCode man(const ManArguments& arguments, Session& session) {
  const auto verbs = all_verbs();
  if (arguments.out && !arguments.words.empty()) {
    throw UsageError("--out writes the pages of all verbs; leave out '" + arguments.words[0] + "'");
  }
  if (!arguments.words.empty()) {
    return print_text(manual_page(describe(find_named_verb(verbs, arguments.words))), session);
  }
  const auto descriptions = describe(verbs);
  if (!arguments.out) return print_text(manual_overview(descriptions), session);
  const fs::path folder(*arguments.out);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be created: " + error.message());
  write_file(folder / "panonav.1", manual_overview(descriptions) + "\n");
  for (const auto& description : descriptions) {
    write_file(folder / (manual_name(description.verb) + ".1"), manual_page(description) + "\n");
  }
  if (session.json()) {
    session.print(json_line(ordered_json{{"folder", *arguments.out}, {"pages", verbs.size() + 1}}));
  } else {
    session.print(std::to_string(verbs.size() + 1) + " manual pages in " + *arguments.out);
  }
  return ExitCode::done;
}

Run declare_man(Arguments& arguments) {
  auto values = std::make_shared<ManArguments>();
  arguments.optional_positionals("VERB", values->words,
                                 "Verb whose page is printed; default: the overview of all verbs",
                                 verb_names());
  arguments.option("-o,--out FOLDER", values->out,
                   "Write the pages of all verbs as files into this folder");
  arguments.declare_outputs({"--out"});
  return [values](Session& session) { return man(*values, session); };
}

}  // namespace

Verb man_verb() {
  return {"man",
          VerbGroup::tools,
          "Print the manual page of a verb",
          "The page is printed in roff format. To read a page that is saved in a file, run man -l "
          "FILE. If panonav is installed, you can also run, for example, man panonav-localise.",
          "  panonav man localise\n  panonav man --out pages",
          declare_man};
}

}  // namespace panonav::command
