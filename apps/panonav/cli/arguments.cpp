#include "cli/arguments.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <deque>
#include <iostream>
#include <map>
#include <numeric>
#include <utility>

#include "cli/option_values.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/option_file.hpp"

namespace panonav::command {

struct Arguments::Parser {
  CLI::App& app;
};

struct Arguments::Implementation {
  struct Section {
    std::string name;
    Visit visit;
    std::function<void()> check;
    OptionEntries entries;
  };
  struct Former {
    std::string flag;
    std::string name;  ///< of the value; of the flag where `value` is false
    std::string now;
    bool value = false;
  };
  CLI::App& app;
  std::deque<Section> sections = {};  // a deque: the parser keeps references into it
  std::vector<Former> former = {};
};

namespace {

/// `cell_size_m` as `--cell-size-m`.
std::string flag_of(std::string_view name) {
  std::string flag = "--" + std::string(name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

/// Adds a flag for each member that it visits, and remembers what is typed as text.
class FlagDeclarer final : public OptionVisitor {
 public:
  FlagDeclarer(Arguments& arguments, CLI::App& app, std::string group, std::string prefix,
               OptionEntries& entries)
      : arguments_(arguments),
        app_(app),
        group_(std::move(group)),
        prefix_(std::move(prefix)),
        entries_(entries) {}

  void visit(const OptionInfo& info, int& value) override {
    declare(info, "INT", std::to_string(value), range_text(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    declare(info, "NUMBER", to_text(value), range_text(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    declare(info, "BOOL", value ? "true" : "false", "true or false");
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    std::string all;
    for (const auto choice : choices) all += (all.empty() ? "" : ", ") + std::string(choice);
    declare(info, "NAME", std::string(choices[static_cast<std::size_t>(value)]), all);
    for (std::size_t i = 0; i < info.former_choices.size(); ++i) {
      if (info.former_choices[i].empty()) continue;
      arguments_.formerly(flag_of(prefix_ + std::string(info.name)),
                          std::string(info.former_choices[i]), std::string(choices[i]));
    }
  }

 private:
  void declare(const OptionInfo& info, const std::string& type, const std::string& initial,
               const std::string& range) {
    auto& text = entries_[std::string(info.name)].text;
    std::string help(info.help);
    help += " (default " + initial;
    if (range != "any finite number") help += "; " + range;
    const std::string flag = flag_of(prefix_ + std::string(info.name));
    app_.add_option(flag, text, help + ")")->type_name(type)->group(group_);
    if (info.former.empty()) return;
    arguments_.formerly(flag_of(prefix_ + std::string(info.former)), flag);
  }
  Arguments& arguments_;
  CLI::App& app_;
  std::string group_;
  std::string prefix_;
  OptionEntries& entries_;
};

int whole_number(const std::string& flag, const std::string& text, int low) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low) {
    throw UsageError(flag + " is '" + text + "'; allowed: whole numbers from " +
                     std::to_string(low));
  }
  return value;
}

/// The longest of a flag's forms, for messages.
std::string long_form(const std::string& flag) {
  return flag.substr(flag.rfind(',') + 1);
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// "route record": a verb of two words; the second one is empty where there is none.
std::pair<std::string_view, std::string_view> words_of(const Verb& verb) {
  const std::size_t blank = verb.name.find(' ');
  if (blank == std::string_view::npos) return {verb.name, {}};
  return {verb.name.substr(0, blank), verb.name.substr(blank + 1)};
}

/// All verbs of two words that begin with this one, with commas between.
std::string verbs_beginning_with(std::span<const Verb> verbs, std::string_view first) {
  std::string all;
  for (const auto& verb : verbs) {
    const auto words = words_of(verb);
    if (words.first != first || words.second.empty()) continue;
    all += (all.empty() ? "" : ", ") + std::string(verb.name);
  }
  return all;
}

std::string unknown_verb(std::span<const Verb> verbs, const std::string& typed) {
  std::string message = "'" + typed + "' is no verb";
  for (const auto& verb : verbs) {
    if (edit_distance(typed, verb.name) <= 2) {
      return message + "; did you mean '" + std::string(verb.name) + "'?";
    }
  }
  return message;
}

/// With what was typed that is no option: the parser looks for missing arguments first, and a
/// misspelt flag is often why one is missing.
std::string one_line(const CLI::ParseError& error, const CLI::App& app) {
  std::string text = error.what();
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) return text;
  std::string unknown;
  for (const auto& typed : app.remaining(true)) {
    if (typed.starts_with("-")) unknown += (unknown.empty() ? "" : ", ") + typed;
  }
  return unknown.empty() ? text : "no such option: " + unknown + "; and " + text;
}

}  // namespace

Arguments::Arguments(Parser& parser)
    : implementation_(std::make_unique<Implementation>(Implementation{parser.app})) {}
Arguments::~Arguments() = default;

void Arguments::positional(const std::string& name, std::string& value, const std::string& help) {
  implementation_->app.add_option(name, value, help)->required()->type_name("");
}

void Arguments::positionals(const std::string& name, std::vector<std::string>& values,
                            const std::string& help) {
  implementation_->app.add_option(name, values, help)->required()->type_name("");
}

void Arguments::option(const std::string& flag, std::string& value, const std::string& help) {
  implementation_->app.add_option(flag, value, help)->type_name("TEXT");
}

void Arguments::required_option(const std::string& flag, std::string& value,
                                const std::string& help) {
  implementation_->app.add_option(flag, value, help)->type_name("FILE")->required();
}

void Arguments::option(const std::string& flag, std::optional<std::string>& value,
                       const std::string& help) {
  implementation_->app.add_option(flag, value, help)->type_name("TEXT");
}

void Arguments::option(const std::string& flag, std::optional<std::uint64_t>& value,
                       const std::string& help) {
  const std::string name = long_form(flag);
  implementation_->app
      .add_option_function<std::string>(
          flag,
          [&value, name](const std::string& text) {
            std::uint64_t number = 0;
            const auto [end, error] =
                std::from_chars(text.data(), text.data() + text.size(), number);
            if (error != std::errc() || end != text.data() + text.size()) {
              throw UsageError(name + " is '" + text + "'; allowed: whole numbers from 0");
            }
            value = number;
          },
          help)
      ->type_name("INT");
}

void Arguments::option(const std::string& flag, std::optional<double>& value,
                       const std::string& help) {
  const std::string name = long_form(flag);
  implementation_->app
      .add_option_function<std::string>(
          flag, [&value, name](const std::string& text) { value = number_from_text(name, text); },
          help)
      ->type_name("NUMBER");
}

void Arguments::option(const std::string& flag, std::optional<std::pair<double, double>>& value,
                       const std::string& help) {
  const std::string name = long_form(flag);
  implementation_->app
      .add_option_function<std::vector<std::string>>(
          flag,
          [&value, name](const std::vector<std::string>& texts) {
            value = {number_from_text(name, texts.at(0)), number_from_text(name, texts.at(1))};
          },
          help)
      ->type_size(2)
      ->expected(1)
      ->type_name("LOW HIGH");
}

namespace {

/// For an int and an optional one alike.
template <class Value>
void add_whole_number(CLI::App& app, const std::string& flag, Value& value, int low,
                      const std::string& help) {
  app.add_option_function<std::string>(
         flag,
         [&value, name = long_form(flag), low](const std::string& text) {
           value = whole_number(name, text, low);
         },
         help)
      ->type_name("INT");
}

}  // namespace

void Arguments::option(const std::string& flag, int& value, int low, const std::string& help) {
  add_whole_number(implementation_->app, flag, value, low, help);
}

void Arguments::option(const std::string& flag, std::optional<int>& value, int low,
                       const std::string& help) {
  add_whole_number(implementation_->app, flag, value, low, help);
}

void Arguments::choice(const std::string& flag, std::optional<std::string>& value,
                       std::vector<std::string> choices, const std::string& help) {
  const std::string name = long_form(flag);
  std::string all;
  for (const auto& choice : choices) all += (all.empty() ? "" : ", ") + choice;
  implementation_->app
      .add_option_function<std::string>(
          flag,
          [&value, name, all, choices = std::move(choices)](const std::string& text) {
            if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
              throw UsageError(name + " is '" + text + "'; allowed: " + all);
            }
            value = text;
          },
          help + " (" + all + ")")
      ->type_name("NAME");
}

void Arguments::flag(const std::string& flag, bool& value, const std::string& help) {
  implementation_->app.add_flag(flag, value, help);
}

void Arguments::formerly(const std::string& former, const std::string& now) {
  implementation_->former.push_back({now, former, now});
}

void Arguments::formerly(const std::string& flag, const std::string& former,
                         const std::string& now) {
  implementation_->former.push_back({flag, former, now, true});
}

std::vector<std::string> Arguments::renamed(std::vector<std::string> typed) const {
  /// Whether the word is this flag, alone or with its value behind "=".
  const auto is = [](const std::string& word, const std::string& flag) {
    return word.starts_with(flag) && (word.size() == flag.size() || word[flag.size()] == '=');
  };
  for (const auto& former : implementation_->former) {
    bool now_typed = false;
    bool former_typed = false;
    for (std::size_t i = 0; i < typed.size() && typed[i] != "--"; ++i) {
      std::string& word = typed[i];
      if (former.value) {
        if (word == former.flag + "=" + former.name) {
          word = former.flag + "=" + former.now;
        } else if (i > 0 && typed[i - 1] == former.flag && word == former.name) {
          word = former.now;
        } else {
          continue;
        }
      } else {
        now_typed = now_typed || is(word, former.now);
        if (!is(word, former.name)) continue;
        word.replace(0, former.name.size(), former.now);
      }
      former_typed = true;
    }
    if (!former_typed) continue;
    if (now_typed) {
      throw UsageError(former.name + " is the former name of " + former.now +
                       "; allowed: one of the two");
    }
    std::cerr << (former.value ? former.flag + " " : "") << former.name << " is now " << former.now
              << '\n';
  }
  return typed;
}

void Arguments::add_section(const std::string& section, const std::string& prefix, Visit visit,
                            std::function<void()> check) {
  auto& added = implementation_->sections.emplace_back(
      Implementation::Section{section, std::move(visit), std::move(check), {}});
  FlagDeclarer declarer(*this, implementation_->app, "Options of [" + section + "]",
                        prefix.empty() ? "" : prefix + "_", added.entries);
  added.visit(declarer);
}

void Arguments::resolve(const std::optional<std::string>& config,
                        std::span<const std::string_view> known_sections) {
  std::optional<OptionFile> file;
  if (config) {
    file.emplace(*config);
    file->require_sections(known_sections);
  }
  for (auto& section : implementation_->sections) {
    if (file) {
      file->apply(section.name, section.visit);
      for (auto& [option, entry] : section.entries) entry.in_file = file->has(section.name, option);
    }
    TextApplier applier(section.entries);
    section.visit(applier);
    section.check();
  }
  if (!file) return;
  for (const auto& warning : file->warnings()) std::cerr << warning << '\n';
}

std::vector<std::string_view> Arguments::sections() const {
  std::vector<std::string_view> names;
  for (const auto& section : implementation_->sections) names.emplace_back(section.name);
  return names;
}

bool Arguments::given(const std::string& section, const std::string& name) const {
  for (const auto& candidate : implementation_->sections) {
    if (candidate.name != section) continue;
    for (const auto& [option, entry] : candidate.entries) {
      if ((entry.text || entry.in_file) && (name.empty() || name == option)) return true;
    }
  }
  return false;
}

std::string_view verb_in(std::span<const Verb> verbs, int argc, const char* const* argv) {
  for (const auto& verb : verbs) {
    const auto [first, second] = words_of(verb);
    if (argc >= 2 && first == argv[1] && (second.empty() || (argc >= 3 && second == argv[2]))) {
      return verb.name;
    }
  }
  return {};
}

std::optional<ParsedCommand> parse(std::span<const Verb> verbs, int argc, const char* const* argv) {
  CLI::App app(
      "Image-based memory for robot navigation from omnidirectional images: remembers what places "
      "look like, and knows from that where the robot is and which way it faces.",
      "panonav");
  app.set_version_flag("--version", "panonav " PANONAV_VERSION, "Print the version and stop");
  app.set_help_flag("-h,--help", "Print this help and stop");
  app.get_formatter()->column_width(32);
  app.get_formatter()->label("SUBCOMMAND", "VERB");
  app.footer(
      "panonav VERB --help shows a verb's options with an example.\n"
      "Exit codes: 0 done, 1 no answer (lost), 2 bad input, 3 fault of the program.");

  if (argc >= 2 && argv[1][0] != '-' && verb_in(verbs, argc, argv).empty()) {
    const std::string longer = verbs_beginning_with(verbs, argv[1]);
    if (longer.empty()) throw UsageError(unknown_verb(verbs, argv[1]));
    if (argc < 3) {
      throw UsageError("'" + std::string(argv[1]) + "' wants a second word: " + longer);
    }
    if (argv[2][0] != '-') {
      throw UsageError("'" + std::string(argv[1]) + " " + argv[2] +
                       "' is no verb; allowed: " + longer);
    }
  }

  struct Declared {
    CLI::App* app;
    CommonArguments common;
    std::shared_ptr<Arguments> arguments;
    Run run;
  };
  std::deque<Declared> declared;
  std::map<std::string_view, CLI::App*> first_words;
  for (const auto& verb : verbs) {
    const auto [first, second] = words_of(verb);
    CLI::App* parent = &app;
    if (!second.empty()) {
      parent = first_words[first];
      if (parent == nullptr) {
        parent = app.add_subcommand(std::string(first),
                                    "Verbs of two words: " + verbs_beginning_with(verbs, first));
        parent->group("Verbs")->require_subcommand(1);
        first_words[first] = parent;
      }
    }
    CLI::App* sub = parent->add_subcommand(std::string(second.empty() ? first : second),
                                           std::string(verb.summary));
    sub->group("Verbs");
    auto& entry = declared.emplace_back();
    entry.app = sub;
    Arguments::Parser parser{*sub};
    entry.arguments = std::make_shared<Arguments>(parser);
    entry.run = verb.declare(*entry.arguments);
    sub->add_flag("--json", entry.common.json, "Results as JSON on standard output");
    sub->add_flag("--former-keys", entry.common.former_keys,
                  "With --json: keys that have a new name have their former one, for programs that "
                  "were written for the last version");
    entry.arguments->option("--threads", entry.common.threads, 0,
                            "Threads to use; 0 takes one per core (default 0)");
    sub->add_option("--config", entry.common.config,
                    "TOML file with a table for each group of options; flags win over it")
        ->type_name("FILE");
    std::string footer(verb.details);
    if (!footer.empty()) footer += "\n\n";
    sub->footer(footer + "Example:\n" + std::string(verb.example));
  }

  std::vector<std::string> typed(argv, argv + argc);
  const auto asked = std::ranges::find(verbs, verb_in(verbs, argc, argv), &Verb::name);
  if (asked != verbs.end()) {
    typed = declared[static_cast<std::size_t>(asked - verbs.begin())].arguments->renamed(typed);
  }
  std::vector<const char*> words;
  for (const auto& word : typed) words.push_back(word.c_str());
  try {
    app.parse(argc, words.data());
  } catch (const CLI::Success& success) {  // --help, --version
    app.exit(success, std::cout, std::cout);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw UsageError(one_line(error, app));
  }
  // One file may serve several verbs, so the sections of all of them are allowed in it.
  std::vector<std::string_view> sections;
  for (const auto& entry : declared) {
    const auto more = entry.arguments->sections();
    sections.insert(sections.end(), more.begin(), more.end());
  }
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (!declared[i].app->parsed()) continue;
    const auto& entry = declared[i];
    entry.arguments->resolve(entry.common.config, sections);
    return ParsedCommand{verbs[i].name, entry.common,
                         [arguments = entry.arguments, run = entry.run](Session& session) {
                           return run(session);  // with its arguments still alive
                         }};
  }
  throw UsageError("a verb is missing");
}

}  // namespace panonav::command
