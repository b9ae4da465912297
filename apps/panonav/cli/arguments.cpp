#include "cli/arguments.hpp"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "cli/json.hpp"
#include "cli/option_values.hpp"
#include "cli/outputs.hpp"
#include "cli/texts.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/option_file.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::command {

struct Arguments::Implementation {
  struct Section {
    std::string name;
    Visit visit;
    std::function<void()> check;
    OptionEntries entries;
    std::string prefix;  ///< of the flags
  };
  struct Refusal {
    std::vector<std::string> options;
    std::function<bool()> used;
    std::string why;
  };
  std::vector<ArgumentInfo> infos = {};
  std::vector<ValueSetter> value_setters = {};  ///< one for each of the infos
  std::deque<Section> sections = {};            ///< a deque, as value_setters refer to its elements
  std::vector<Refusal> refusals = {};
  std::set<std::string, std::less<>> typed = {};  ///< flags
  /// Values typed for the flags of `allow_in_config_files`; nullopt: not set.
  std::map<std::string, std::optional<std::string>, std::less<>> plain = {};
  std::set<std::string, std::less<>> outputs = {};  ///< names of arguments that the verb writes
  std::vector<NamedValue> values = {};  ///< all values that were set, with their arguments

  void set_value(std::size_t number, std::span<const std::string> words) {
    value_setters[number](words);
    const std::string& name = infos[number].name;
    for (const auto& word : words) values.push_back({name, word, outputs.contains(name)});
  }
};

namespace {

/// Converts `--cell-size-m` to `cell_size_m`.
std::string to_member_name(std::string_view flag) {
  std::string name(flag.substr(2));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

template <class Number>
Number parse_whole_number(const std::string& flag, const std::string& text, Number low) {
  Number value = 0;
  if (!read_number(text, value) || value < low) {
    throw UsageError(flag + " is '" + text + "'; allowed: whole numbers from " +
                     std::to_string(low));
  }
  return value;
}

/// Returns the long form of a declared flag: "--out" for "-o,--out FILE".
std::string long_flag(const std::string& declared) {
  const std::string forms = declared.substr(0, declared.find(' '));
  return forms.substr(forms.rfind(',') + 1);
}

bool is_memory_file(const std::string& word) {
  std::error_code ignored;
  return is_server_address(word) ||
         (word.ends_with(".panonav") && !std::filesystem::is_directory(word, ignored));
}

}  // namespace

Arguments::Arguments() : implementation_(std::make_unique<Implementation>()) {}
Arguments::~Arguments() = default;

ArgumentInfo& Arguments::add(const std::string& declared, const std::string& value,
                             const std::string& help, ValueSetter value_setter) {
  ArgumentInfo info;
  info.name = long_flag(declared);
  const std::size_t comma = declared.find(',');
  if (comma < declared.find(' ')) info.short_form = declared.substr(0, comma);
  const std::size_t blank = declared.find(' ');
  info.value = blank == std::string::npos ? value : declared.substr(blank + 1);
  info.help = help;
  implementation_->value_setters.push_back(std::move(value_setter));
  return implementation_->infos.emplace_back(std::move(info));
}

void Arguments::positional(const std::string& name, std::string& value, const std::string& help,
                           std::vector<std::string> choices) {
  auto& info = add(name, "", help, [&value](auto words) { value = words.front(); });
  info.required = true;
  info.choices = std::move(choices);
}

void Arguments::positionals(const std::string& name, std::vector<std::string>& values,
                            const std::string& help) {
  optional_positionals(name, values, help);
  implementation_->infos.back().required = true;
}

void Arguments::optional_positionals(const std::string& name, std::vector<std::string>& values,
                                     const std::string& help, std::vector<std::string> choices) {
  auto& info =
      add(name, "", help, [&values](auto words) { values.assign(words.begin(), words.end()); });
  info.repeated = true;
  info.choices = std::move(choices);
}

void Arguments::option(const std::string& flag, std::string& value, const std::string& help) {
  add(flag, "TEXT", help, [&value](auto words) { value = words.front(); }).default_value = value;
}

void Arguments::required_option(const std::string& flag, std::string& value,
                                const std::string& help) {
  add(flag, "FILE", help, [&value](auto words) { value = words.front(); }).required = true;
}

void Arguments::option(const std::string& flag, std::optional<std::string>& value,
                       const std::string& help) {
  add(flag, "TEXT", help, [&value](auto words) { value = words.front(); });
}

void Arguments::option(const std::string& flag, std::optional<std::uint64_t>& value,
                       const std::string& help) {
  add(flag, "INT", help, [&value, name = long_flag(flag)](auto words) {
    value = parse_whole_number<std::uint64_t>(name, words.front(), 0);
  }).range = "from 0";
}

void Arguments::option(const std::string& flag, std::optional<double>& value,
                       const std::string& help) {
  add(flag, "NUMBER", help,
      [&value, name = long_flag(flag)](auto words) { value = parse_number(name, words.front()); });
}

void Arguments::option(const std::string& flag, std::optional<std::pair<double, double>>& value,
                       const std::string& help) {
  option(flag, "LOW HIGH", value, help);
}

void Arguments::option(const std::string& flag, const std::string& words,
                       std::optional<std::pair<double, double>>& value, const std::string& help) {
  add(flag, words, help, [&value, name = long_flag(flag)](auto typed) {
    value = {parse_number(name, typed[0]), parse_number(name, typed[1])};
  });
}

void Arguments::option(const std::string& flag, const std::string& words,
                       std::optional<std::pair<std::string, std::string>>& value,
                       const std::string& help) {
  add(flag, words, help, [&value](auto typed) { value = {typed[0], typed[1]}; });
}

void Arguments::option(const std::string& flag, const std::string& words,
                       std::optional<std::vector<std::string>>& value, const std::string& help) {
  add(flag, words, help,
      [&value](auto typed) { value.emplace(std::begin(typed), std::end(typed)); });
}

void Arguments::option(const std::string& flag, int& value, int low, const std::string& help) {
  auto& info = add(flag, "INT", help, [&value, low, name = long_flag(flag)](auto words) {
    value = parse_whole_number(name, words.front(), low);
  });
  info.default_value = std::to_string(value);
  info.range = "from " + std::to_string(low);
}

void Arguments::option(const std::string& flag, std::optional<int>& value, int low,
                       const std::string& help) {
  add(flag, "INT", help, [&value, low, name = long_flag(flag)](auto words) {
    value = parse_whole_number(name, words.front(), low);
  }).range = "from " + std::to_string(low);
}

void Arguments::choice(const std::string& flag, std::optional<std::string>& value,
                       std::vector<std::string> choices, const std::string& help) {
  auto& info = add(flag, "NAME", help, [&value, name = long_flag(flag), choices](auto words) {
    const std::string& text = words.front();
    if (std::ranges::find(choices, text) == choices.end()) {
      throw UsageError(name + " is '" + text + "'; allowed: " + join_texts(choices));
    }
    value = text;
  });
  info.choices = std::move(choices);
}

void Arguments::flag(const std::string& flag, bool& value, const std::string& help) {
  add(flag, "", help, [&value](auto) { value = true; });
}

void Arguments::add_section(const std::string& section, const std::string& prefix, Visit visit,
                            std::function<void()> check) {
  const std::string before = prefix.empty() ? "" : prefix + "_";
  auto& added = implementation_->sections.emplace_back(
      Implementation::Section{section, std::move(visit), std::move(check), {}, before});
  OptionLister lister([&](const ListedOption& option) {
    auto& text = added.entries[std::string(option.info.name)].text;
    std::string help(option.info.help);
    // Capitalises the first letter, unless the first word is a symbol of one letter or has
    // capitals.
    if (help.size() > 1 && help[1] >= 'a' && help[1] <= 'z' && help[0] >= 'a' && help[0] <= 'z') {
      help[0] = static_cast<char>(help[0] - 'a' + 'A');
    }
    const std::string flag = to_flag(before + std::string(option.info.name));
    auto& info =
        add(flag, std::string(option.type), help, [&text](auto words) { text = words.front(); });
    info.default_value = option.value;
    info.range = option.range;
    info.choices.assign(option.choices.begin(), option.choices.end());
    info.section = section;
    info.is_in_short_help = false;
  });
  added.visit(lister);
}

void Arguments::allow_in_config_files(const std::string& section,
                                      std::initializer_list<std::string_view> flags) {
  for (const auto flag : flags) {
    std::ranges::find(implementation_->infos, flag, &ArgumentInfo::name)->section = section;
    implementation_->plain.emplace(flag, std::nullopt);
  }
}

void Arguments::set_in_short_help(std::initializer_list<std::string_view> flags,
                                  bool is_in_short_help) {
  for (const auto flag : flags) {
    const auto found = std::ranges::find(implementation_->infos, flag, &ArgumentInfo::name);
    if (found == implementation_->infos.end()) {
      throw std::logic_error(std::string(flag) + " is not declared");
    }
    found->is_in_short_help = is_in_short_help;
  }
}

void Arguments::declare_outputs(std::initializer_list<std::string_view> names) {
  for (const auto name : names) {
    if (std::ranges::find(infos(), name, &ArgumentInfo::name) == infos().end()) {
      throw std::logic_error(std::string(name) + " is not declared");
    }
    implementation_->outputs.emplace(name);
  }
}

std::string_view Arguments::interruption_text() const {
  if (!interruption_text_.empty() && (!writes_ || writes_())) return interruption_text_;
  const bool has_output = std::ranges::any_of(implementation_->values, &NamedValue::is_output);
  return has_output ? "No output was written. To start over, run the same command again." : "";
}

std::string Arguments::explain_unknown_flag(const std::string& typed) const {
  std::vector<std::string_view> names;
  for (const auto& info : infos()) {
    const bool is_shown = info.is_in_short_help || !info.section.empty();
    if (is_shown && !info.positional()) names.emplace_back(info.name);
  }
  return "no such option: " + typed + suggest_name(typed, names);
}

void Arguments::read(std::span<const std::string> words, std::string_view verb,
                     bool allow_missing) {
  const auto& infos = implementation_->infos;
  const auto find = [&infos](std::string_view name) {
    return std::ranges::find_if(infos, [&](const ArgumentInfo& info) {
      return !info.positional() && (info.name == name || info.short_form == name);
    });
  };
  std::vector<std::string> positional_words;
  std::vector<std::string> option_words;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--") {
      positional_words.insert(positional_words.end(),
                              words.begin() + static_cast<std::ptrdiff_t>(i) + 1, words.end());
      break;
    }
    if (!looks_like_flag(word)) {
      positional_words.push_back(word);
      continue;
    }
    // "--out=FILE" and "-oFILE" contain their value.
    const bool is_long = word.starts_with("--");
    const std::string name = word.substr(0, is_long ? word.find('=') : 2);
    const auto found = find(name);
    if (found == infos.end()) throw UsageError(explain_unknown_flag(is_long ? name : word));
    const std::size_t first = i;
    std::vector<std::string> values;
    if (name.size() < word.size()) values.push_back(word.substr(name.size() + (is_long ? 1 : 0)));
    const auto value_count = static_cast<std::size_t>(
        found->value.empty() ? 0 : 1 + std::ranges::count(found->value, ' '));
    if (values.size() > value_count) throw UsageError(found->name + " takes no value");
    while (values.size() < value_count) {
      if (i + 1 == words.size() || find(words[i + 1]) != infos.end()) {
        throw UsageError(found->name + " needs a value: " + found->value);
      }
      values.push_back(words[++i]);
    }
    option_words.insert(option_words.end(), words.begin() + static_cast<std::ptrdiff_t>(first),
                        words.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    const auto number = static_cast<std::size_t>(found - infos.begin());
    const bool is_first = implementation_->typed.insert(found->name).second;
    if (!is_first && value_count > 0) throw UsageError(found->name + " is given twice");
    implementation_->set_value(number, values);
    const auto plain = implementation_->plain.find(found->name);
    if (plain != implementation_->plain.end()) plain->second = values.front();
  }
  require_memory_in_its_place(positional_words, option_words, verb);
  read_positionals(positional_words, allow_missing);
  for (std::size_t i = 0; i < infos.size() && !allow_missing; ++i) {
    if (infos[i].required && !infos[i].positional() &&
        !implementation_->typed.contains(infos[i].name)) {
      throw UsageError(infos[i].name + " is required");
    }
  }
}

std::vector<std::size_t> Arguments::find_positionals() const {
  std::vector<std::size_t> positionals;
  for (std::size_t i = 0; i < infos().size(); ++i) {
    if (infos()[i].positional()) positionals.push_back(i);
  }
  return positionals;
}

void Arguments::require_memory_in_its_place(std::span<const std::string> words,
                                            std::span<const std::string> option_words,
                                            std::string_view verb) const {
  const auto positionals = find_positionals();
  for (std::size_t i = 0; i < std::min(positionals.size(), words.size()); ++i) {
    if (infos()[positionals[i]].name != "MEMORY" || infos()[positionals[i]].repeated ||
        words[i].ends_with(".panonav") || is_server_address(words[i])) {
      continue;
    }
    const auto other = std::ranges::find_if(words, is_memory_file);
    const auto memory_index = static_cast<std::size_t>(other - words.begin());
    if (other == words.end()) continue;
    std::vector<std::string> swapped(words.begin(), words.end());
    std::swap(swapped[i], swapped[memory_index]);
    std::string command = "panonav " + std::string(verb);
    for (const auto& word : swapped) command.append(" ").append(quote_for_shell(word));
    for (const auto& word : option_words) command.append(" ").append(quote_for_shell(word));
    throw UsageError("MEMORY is '" + words[i] + "' and " +
                     infos()[positionals[std::min(memory_index, positionals.size() - 1)]].name +
                     " is '" + *other + "': the arguments are in the wrong order (did you mean '" +
                     command + "'?)");
  }
}

void Arguments::read_positionals(std::span<const std::string> words, bool allow_missing) {
  const auto& infos = implementation_->infos;
  std::size_t next = 0;
  for (const std::size_t i : find_positionals()) {
    if (next == words.size()) {
      if (infos[i].required && !allow_missing) throw UsageError(infos[i].name + " is required");
      continue;
    }
    const std::size_t count = infos[i].repeated ? words.size() - next : 1;
    implementation_->set_value(i, words.subspan(next, count));
    next += count;
  }
  if (next < words.size()) {
    throw UsageError("'" + words[next] + "' is an extra argument");
  }
}

EarlierOutputs Arguments::resolve(const std::optional<std::string>& config,
                                  const std::function<std::vector<std::string>()>& all_sections) {
  std::optional<OptionFile> file;
  if (config) {
    file.emplace(*config);
    const auto own = sections();
    const auto others = all_sections();
    const std::vector<std::string_view> own_views(own.begin(), own.end());
    const std::vector<std::string_view> other_views(others.begin(), others.end());
    file->require_sections(own_views, other_views);
  }
  for (std::size_t i = 0; file && i < implementation_->infos.size(); ++i) {
    const ArgumentInfo& info = implementation_->infos[i];
    const auto plain = implementation_->plain.find(info.name);
    if (plain == implementation_->plain.end()) continue;
    const auto text = file->take_text(info.section, to_member_name(info.name));
    if (text && !implementation_->typed.contains(info.name)) {
      implementation_->set_value(i, std::span(&*text, 1));
      plain->second = text;
    }
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
  for (const auto& [options, used, why] : implementation_->refusals) {
    if (!used()) reject_options(options, why);
  }
  return require_separate_outputs(implementation_->values);
}

void Arguments::reject_options_unless(std::vector<std::string> options, std::function<bool()> used,
                                      std::string why) {
  implementation_->refusals.push_back({std::move(options), std::move(used), std::move(why)});
}

void Arguments::reject_options(std::span<const std::string> options, const std::string& why) const {
  const auto refuse = [&](const std::string& flag) {
    throw UsageError(flag + " has no effect " + why + "; leave it out");
  };
  for (const std::string& option : options) {
    if (implementation_->typed.contains(option)) refuse(option);
    for (const auto& section : implementation_->sections) {
      if ("[" + section.name + "]" != option) continue;
      for (const auto& [name, entry] : section.entries) {
        if (entry.text) refuse(to_flag(section.prefix + name));
      }
    }
  }
}

void Arguments::require_equal(const std::string& section, const Visit& typed, const Visit& stored,
                              const std::string& message_end) const {
  std::vector<std::pair<std::string, std::string>> typed_values;
  OptionLister list_typed([&](const ListedOption& option) {
    typed_values.emplace_back(option.info.name, option.value);
  });
  typed(list_typed);
  std::size_t next = 0;
  OptionLister list_stored([&](const ListedOption& option) {
    const auto& [name, value] = typed_values[next++];
    if (value == option.value || !is_set(section, name)) return;
    const auto declared =
        std::ranges::find(implementation_->sections, section, &Implementation::Section::name);
    throw ContractError(to_flag(declared->prefix + name), value, option.value + message_end);
  });
  stored(list_stored);
}

std::vector<std::string> Arguments::sections() const {
  std::vector<std::string> names;
  for (const auto& section : implementation_->sections) names.push_back(section.name);
  return names;
}

const std::vector<ArgumentInfo>& Arguments::infos() const {
  return implementation_->infos;
}

bool Arguments::is_set(const std::string& section, const std::string& name) const {
  for (const auto& candidate : implementation_->sections) {
    if (candidate.name != section) continue;
    for (const auto& [option, entry] : candidate.entries) {
      if ((entry.text || entry.in_file) && (name.empty() || name == option)) return true;
    }
  }
  return false;
}

std::string Arguments::config_template(std::string_view verb) const {
  std::string text = "# Options of panonav " + std::string(verb) +
                     ", for --config FILE. Options on the command line have priority.\n# A line "
                     "'# NAME = VALUE' shows a default; to change it, remove '# ' and replace the "
                     "value.\n";
  for (const auto& section : implementation_->sections) {
    text += "\n[" + section.name + "]\n";
    OptionLister lister([&](const ListedOption& option) {
      const std::string name(option.info.name);
      const std::string range = option.choices.empty() ? option.range : join_texts(option.choices);
      text += "# " + std::string(option.info.help) + (range.empty() ? "" : " (" + range + ")") +
              "\n" + (is_set(section.name, name) ? "" : "# ") + name + " = " +
              (option.type == "NAME" ? quote_for_toml(option.value) : option.value) + "\n";
    });
    section.visit(lister);
    for (const ArgumentInfo& info : implementation_->infos) {
      const auto plain = implementation_->plain.find(info.name);
      if (info.section != section.name || plain == implementation_->plain.end()) continue;
      text += "# " + info.help + "\n" + (plain->second ? "" : "# ") + to_member_name(info.name) +
              " = " + quote_for_toml(plain->second.value_or(info.default_value)) + "\n";
    }
  }
  if (implementation_->sections.empty()) text += "# A file cannot set options of this verb.\n";
  text.pop_back();  // whoever prints it ends the line
  return text;
}

}  // namespace panonav::command
