#include <algorithm>

#include "cli/option_values.hpp"
#include "cli/texts.hpp"
#include "cli/verbs.hpp"

namespace panonav::command {

namespace {

/// Splits a name such as "route record" into two words; the second is empty for names of one word.
std::pair<std::string_view, std::string_view> split_verb(std::string_view verb) {
  const std::size_t blank = verb.find(' ');
  if (blank == std::string_view::npos) return {verb, {}};
  return {verb.substr(0, blank), verb.substr(blank + 1)};
}

/// Returns all two-word verbs whose first word is `first`.
std::vector<std::string_view> find_verbs_beginning_with(std::span<const Verb> verbs,
                                                        std::string_view first) {
  std::vector<std::string_view> found;
  for (const auto& verb : verbs) {
    const auto words = split_verb(verb.name);
    if (words.first == first && !words.second.empty()) found.push_back(verb.name);
  }
  return found;
}

bool is_help_flag(std::string_view word) {
  return word == "-h" || word == "--help" || word == "--help-all";
}

}  // namespace

const Verb* find_verb(std::span<const Verb> verbs, std::span<const std::string> words) {
  const Verb* found = nullptr;  // a verb of one word, unless there is one of both words
  for (const auto& verb : verbs) {
    const auto [first, second] = split_verb(verb.name);
    if (words.empty() || (first != words[0] && (verb.alias.empty() || verb.alias != words[0]))) {
      continue;
    }
    if (words.size() > 1 && second == words[1]) return &verb;
    if (second.empty() && found == nullptr) found = &verb;
  }
  return found;
}

const Verb& find_required_verb(std::span<const Verb> verbs, std::span<const std::string> words) {
  if (const Verb* verb = find_verb(verbs, words)) return *verb;
  if (words.empty()) throw UsageError("a verb is missing");
  const auto two_word_verbs = find_verbs_beginning_with(verbs, words[0]);
  if (!two_word_verbs.empty() && words.size() == 1) {
    throw UsageError("'" + words[0] + "' needs a second word: " + join_texts(two_word_verbs));
  }
  const std::string typed = two_word_verbs.empty() ? words[0] : words[0] + " " + words[1];
  if (looks_like_flag(typed)) throw UsageError("no such option: " + typed + "; a verb is missing");
  std::vector<std::string_view> names;
  for (const auto& verb : verbs) {
    names.push_back(verb.name);
    if (!verb.alias.empty()) names.push_back(verb.alias);
  }
  if (words.size() > 1) {  // the second word may belong to the verb
    const std::string both = words[0] + " " + words[1];
    if (const auto meant = suggest_name(both, names); !meant.empty()) {
      throw UsageError("'" + both + "' is not a verb" + meant);
    }
  }
  throw UsageError("'" + typed + "' is not a verb" +
                   (two_word_verbs.empty() ? suggest_name(typed, names)
                                           : "; allowed: " + join_texts(two_word_verbs)));
}

std::vector<std::string> verb_names() {
  std::vector<std::string> names;
  for (const auto& verb : all_verbs()) names.emplace_back(verb.name);
  return names;
}

const Verb& find_named_verb(std::span<const Verb> verbs, const std::vector<std::string>& words) {
  const Verb& verb = find_required_verb(verbs, words);
  const std::size_t word_count = split_verb(verb.name).second.empty() ? 1 : 2;
  if (words.size() > word_count)
    throw UsageError("'" + words[word_count] + "' is one argument too many");
  return verb;
}

ExitCode print_text(const std::string& text, Session& session) {
  session.print(session.json() ? json_line(ordered_json{{"text", text}}) : text);
  return ExitCode::done;
}

namespace {

/// A verb with its declared arguments and their values; `run` refers to both.
struct DeclaredVerb {
  CommonArguments common;
  Arguments arguments;
  Run run;
  std::size_t own_argument_count =
      0;                 ///< number of the verb's own arguments; common ones follow them
  bool ignored = false;  ///< unused target of --help, which `parse` handles itself

  [[nodiscard]] Description description(const Verb& verb) const {
    Description description{verb, arguments.infos()};
    for (std::size_t i = own_argument_count; i < description.arguments.size(); ++i) {
      description.arguments[i].of_every_verb = true;
    }
    return description;
  }
};

std::shared_ptr<DeclaredVerb> declare(const Verb& verb) {
  auto declared = std::make_shared<DeclaredVerb>();
  auto& arguments = declared->arguments;
  auto& common = declared->common;
  declared->run = verb.declare(arguments);
  declared->own_argument_count = arguments.infos().size();
  arguments.flag("--json", common.session.json, "Print results as JSON on standard output");
  arguments.flag(
      "-q,--quiet", common.session.quiet,
      "Print only results and errors: no progress, no notes and no suggested next commands");
  arguments.flag("-v,--verbose", common.session.verbose,
                 "Print each step and its duration on standard error");
  arguments.option("--threads", common.session.threads, 0, "Number of threads; 0: one per core");
  arguments.option("--config FILE", common.config,
                   "Read options from this TOML file; options on the command line have priority");
  arguments.flag("--config-template", common.config_template,
                 "Print a TOML file with all options, their defaults and ranges, and exit");
  arguments.flag("-h,--help", declared->ignored, "Print a short help and exit");
  arguments.flag("--help-all", declared->ignored, "Print the help with all options and exit");
  arguments.hide_from_help({"--threads", "--config", "--config-template"});
  return declared;
}

ParsedCommand make_print_command(std::string_view verb, std::string text) {
  return {verb, {.threads = 1}, [text = std::move(text)](Session& session) {
            session.print(text);
            return ExitCode::done;
          }};
}

}  // namespace

Description describe(const Verb& verb) {
  return declare(verb)->description(verb);
}

ParsedCommand parse(std::span<const Verb> verbs, std::span<const std::string> words) {
  if (words.size() == 1 && words[0] == "--version") {
    return make_print_command({}, "panonav " PANONAV_VERSION);
  }
  if (!words.empty() && is_help_flag(words[0])) return make_print_command({}, overview(verbs));
  if (words.size() > 1 && is_help_flag(words[1])) {
    const auto two_word_verbs = find_verbs_beginning_with(verbs, words[0]);
    if (!two_word_verbs.empty() && find_verb(verbs, words.first(1)) == nullptr)
      return make_print_command({}, "Verbs of two words: " + join_texts(two_word_verbs));
  }
  const Verb& verb = find_required_verb(verbs, words);
  const auto declared = declare(verb);
  const std::size_t own_words = split_verb(verb.name).second.empty() ? 1 : 2;
  const auto remaining = words.subspan(own_words);
  const std::vector<std::string> translated =
      verb.translate == nullptr ? std::vector<std::string>(remaining.begin(), remaining.end())
                                : verb.translate(remaining, declared->arguments.infos());
  for (const auto& word : translated) {
    if (word == "--") break;
    if (!is_help_flag(word)) continue;
    return make_print_command(verb.name,
                              format_help(declared->description(verb), word == "--help-all"));
  }
  const bool is_template_requested =
      std::ranges::find(translated, "--config-template") != translated.end();
  const auto& common = declared->common;
  declared->arguments.read(translated, verb.name, is_template_requested);
  if (common.session.quiet && common.session.verbose) {
    throw UsageError("--quiet and --verbose cannot be combined");
  }
  const EarlierOutputs outputs = declared->arguments.resolve(common.config, [&] {
    // Allows the sections of all verbs, as one file may serve several verbs.
    std::vector<std::string> sections;
    for (const auto& other : verbs) {
      const auto more = declare(other)->arguments.sections();
      sections.insert(sections.end(), more.begin(), more.end());
    }
    return sections;
  });
  if (is_template_requested) {
    return make_print_command(verb.name, declared->arguments.config_template(verb.name));
  }
  return {verb.name, common.session,
          [declared, outputs](Session& session) {  // keeps the arguments alive
            const ExitCode code = declared->run(session);
            for (const std::string& path : outputs.list_replaced()) {
              session.note(path + ": replaced the file that was there");
            }
            return code;
          },
          declared->arguments.interruption_text()};
}

}  // namespace panonav::command
