#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/texts.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

ExitCode show(const std::string& text, Session& session) {
  session.print(session.json() ? json_line(ordered_json{{"text", text}}) : text);
  return ExitCode::done;
}

std::vector<std::string> verb_names() {
  std::vector<std::string> names;
  for (const auto& verb : all_verbs()) names.emplace_back(verb.name);
  return names;
}

/// The words after `help` or `man`; throws UsageError when they are more than a verb.
const Verb& named_verb(std::span<const Verb> verbs, const std::vector<std::string>& words) {
  const Verb& verb = required_verb(verbs, words);
  const std::size_t own = verb.name.find(' ') == std::string_view::npos ? 1 : 2;
  if (words.size() > own) throw UsageError("'" + words[own] + "' is one argument too many");
  return verb;
}

Run declare_help(Arguments& arguments) {
  auto words = std::make_shared<std::vector<std::string>>();
  arguments.optional_positionals("VERB", *words,
                                 "Verb to explain; none: all verbs with a line each", verb_names());
  return [words](Session& session) {
    const auto verbs = all_verbs();
    if (words->empty()) return show(overview(verbs), session);
    return show(help_text(describe(named_verb(verbs, *words)), false), session);
  };
}

Run declare_completion(Arguments& arguments) {
  auto shell = std::make_shared<std::string>();
  arguments.positional("SHELL", *shell, "bash, zsh or fish", completion_shells());
  return [shell](Session& session) {
    return show(completion_script(describe(all_verbs()), *shell), session);
  };
}

struct ManArguments {
  std::vector<std::string> words;
  std::optional<std::string> out;
};

ExitCode man(const ManArguments& wanted, Session& session) {
  const auto verbs = all_verbs();
  if (wanted.out && !wanted.words.empty()) {
    throw UsageError("--out writes the pages of all verbs; leave out '" + wanted.words[0] + "'");
  }
  if (!wanted.words.empty()) {
    return show(manual_page(describe(named_verb(verbs, wanted.words))), session);
  }
  const auto descriptions = describe(verbs);
  if (!wanted.out) return show(manual_overview(descriptions), session);
  const fs::path folder(*wanted.out);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
  write_file(folder / "panonav.1", manual_overview(descriptions) + "\n");
  for (const auto& description : descriptions) {
    write_file(folder / (manual_name(description.verb) + ".1"), manual_page(description) + "\n");
  }
  if (session.json()) {
    session.print(json_line(ordered_json{{"folder", *wanted.out}, {"pages", verbs.size() + 1}}));
  } else {
    session.print(std::to_string(verbs.size() + 1) + " manual pages in " + *wanted.out);
  }
  return ExitCode::done;
}

Run declare_man(Arguments& arguments) {
  auto wanted = std::make_shared<ManArguments>();
  arguments.optional_positionals("VERB", wanted->words, "Verb of the page; none: the overview",
                                 verb_names());
  arguments.option("-o,--out FOLDER", wanted->out,
                   "Write the pages of all verbs as files into this folder instead");
  return [wanted](Session& session) { return man(*wanted, session); };
}

}  // namespace

Verb help_verb() {
  return {"help", "Show how a verb is used",
          "The same as panonav VERB --help. panonav VERB --help-all shows every option of a verb.",
          "  panonav help\n  panonav help route record", declare_help};
}

Verb completion_verb() {
  return {"completion", "Print a script that lets a shell complete verbs, options and values",
          "The bash script is read with source, the fish script is kept in the folder "
          "~/.config/fish/completions as panonav.fish, and the zsh script in a folder of fpath as "
          "_panonav. An installed panonav has them already.",
          "  panonav completion bash\n  panonav completion fish", declare_completion};
}

Verb man_verb() {
  return {"man", "Print the manual page of a verb as roff",
          "An installed panonav has these pages: man panonav-localise. A page that is written to a "
          "file is read with man -l FILE.",
          "  panonav man localise\n  panonav man --out pages", declare_man};
}

}  // namespace panonav::command
