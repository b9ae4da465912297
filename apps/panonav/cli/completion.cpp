#include <algorithm>
#include <array>

#include "cli/option_values.hpp"
#include "cli/texts.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

namespace {

bool accepts_files(const ArgumentInfo& argument) {
  constexpr std::array<std::string_view, 2> names{"FILE", "FOLDER"};
  constexpr std::array<std::string_view, 5> no_files{"VIEW", "NEW_NAME", "VERB", "SHELL", "PAPER"};
  return argument.positional() ? std::ranges::find(no_files, argument.name) == no_files.end()
                               : std::ranges::find(names, argument.value) != names.end();
}

std::string join_words(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Lists the flags of a verb, in all their forms.
std::string list_flags(const Description& description) {
  std::string text;
  for (const auto& argument : description.arguments) {
    if (argument.positional()) continue;
    if (!argument.short_form.empty()) text += argument.short_form + " ";
    text += argument.name + " ";
  }
  text.pop_back();
  return text;
}

/// Returns the values that may be proposed for the positionals of a verb, besides files.
std::vector<std::string> list_proposals(const Description& description) {
  std::vector<std::string> words;
  for (const auto& argument : description.arguments) {
    if (argument.positional()) {
      words.insert(words.end(), argument.choices.begin(), argument.choices.end());
    }
  }
  return words;
}

bool has_file_positionals(const Description& description) {
  return std::ranges::any_of(description.arguments, [](const ArgumentInfo& argument) {
    return argument.positional() && accepts_files(argument);
  });
}

/// Returns the first words of all verbs and their aliases, each word once.
std::vector<std::string> list_first_words(std::span<const Description> verbs) {
  std::vector<std::string> words;
  for (const auto& [verb, arguments] : verbs) {
    const std::string first(verb.name.substr(0, verb.name.find(' ')));
    if (std::ranges::find(words, first) == words.end()) words.push_back(first);
    if (!verb.alias.empty()) words.emplace_back(verb.alias);
  }
  return words;
}

/// Returns the second words of two-word verbs by first word: {"route", {"record", "follow"}}.
std::vector<std::pair<std::string, std::vector<std::string>>> list_second_words(
    std::span<const Description> verbs) {
  std::vector<std::pair<std::string, std::vector<std::string>>> found;
  for (const auto& [verb, arguments] : verbs) {
    const std::size_t blank = verb.name.find(' ');
    if (blank == std::string_view::npos) continue;
    const std::string first(verb.name.substr(0, blank));
    if (found.empty() || found.back().first != first) found.push_back({first, {}});
    found.back().second.emplace_back(verb.name.substr(blank + 1));
  }
  return found;
}

/// True if the word alone is a verb, too.
bool is_verb(std::span<const Description> verbs, std::string_view word) {
  return std::ranges::any_of(verbs, [word](const auto& d) { return d.verb.name == word; });
}

/// `'localise'|'localize'`: a pattern of `case`.
std::string case_pattern(const Verb& verb) {
  std::string text = "'";
  text.append(verb.name).append("'");
  if (!verb.alias.empty()) text.append("|'").append(verb.alias).append("'");
  return text;
}

std::string make_bash_script(std::span<const Description> verbs) {
  std::string script =
      "# Completion of panonav for bash; made by: panonav completion bash\n"
      "_panonav() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local verb=${COMP_WORDS[1]} flags='' words='' files='' values='' first=2\n"
      "  COMPREPLY=()\n"
      "  if ((COMP_CWORD == 1)); then\n"
      "    COMPREPLY=($(compgen -W '" +
      join_words(list_first_words(verbs)) +
      " --help --version' -- \"$current\"))\n    return\n  fi\n";
  for (const auto& [first, seconds] : list_second_words(verbs)) {
    if (is_verb(verbs, first)) {
      for (const std::string& second : seconds) {
        script += "  [[ $verb == " + first +
                  " && $COMP_CWORD -gt 2 && ${COMP_WORDS[2]} == " + second + " ]] && verb='" +
                  first + " " + second + "'\n";
      }
      continue;
    }
    script += "  if [[ $verb == " + first +
              " ]]; then\n"
              "    if ((COMP_CWORD == 2)); then\n"
              "      COMPREPLY=($(compgen -W '" +
              join_words(seconds) +
              "' -- \"$current\"))\n      return\n    fi\n"
              "    verb=\"$verb ${COMP_WORDS[2]}\"\n  fi\n";
  }
  script += "  case $verb in\n";
  for (const auto& description : verbs) {
    script +=
        "  " + case_pattern(description.verb) + ")\n    flags='" + list_flags(description) + "'\n";
    const auto words = list_proposals(description);
    if (!words.empty()) script += "    words='" + join_words(words) + "'\n";
    if (has_file_positionals(description)) script += "    files=1\n";
    std::string cases;
    for (const auto& argument : description.arguments) {
      if (argument.positional() || argument.value.empty()) continue;
      cases += "    " + (argument.short_form.empty() ? "" : argument.short_form + "|") +
               argument.name + ") values=1 words='" + join_words(argument.choices) +
               "' files=" + (accepts_files(argument) ? "1" : "") + " ;;\n";
    }
    script += "    case $before in\n" + cases + "    esac\n    ;;\n";
  }
  return script +
         "  esac\n"
         "  [[ $current == -* && -z $values ]] && words=$flags files=''\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  [[ -n $files ]] && compopt -o default 2>/dev/null\n"
         "  return 0\n"
         "}\n"
         "complete -F _panonav panonav";
}

/// Escapes a text for single quotes of zsh; characters of `special` also get a backslash.
std::string quote_for_zsh(std::string_view text, std::string_view special) {
  std::string result;
  for (const char c : text) {
    if (special.find(c) != std::string_view::npos) result += '\\';
    result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return result;
}

/// Returns ":FILE:_files" for each word of the argument's value, or its choices.
std::string format_zsh_values(const ArgumentInfo& argument) {
  std::string text;
  std::string_view left = argument.positional() ? argument.name : argument.value;
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(' '), left.size());
    std::string action = accepts_files(argument) ? "_files" : " ";
    if (!argument.choices.empty()) {
      // Proposes files and the choices if files are accepted, otherwise only the choices.
      const bool files = accepts_files(argument);
      action = files ? "{_alternative \"names\\:name\\:(" : "(";
      action += join_words(argument.choices);
      action += files ? ")\" \"files\\:file\\:_files\"}" : ")";
    }
    text.append(":").append(left.substr(0, end)).append(":").append(action);
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return text;
}

/// Returns the summary of the verb with this name or alias; for the first word of two-word verbs a
/// general text.
std::string find_summary(std::string_view word, std::span<const Description> verbs) {
  const auto found = std::ranges::find_if(verbs, [word](const Description& description) {
    return description.verb.name == word || description.verb.alias == word;
  });
  return std::string(found == verbs.end() ? "Verbs of two words" : found->verb.summary);
}

/// Returns the commands that propose the first words of the verbs, group by group.
std::string make_zsh_verb_proposals(std::span<const Description> verbs) {
  std::string script;
  for (const auto& [group, title] : verb_groups()) {
    std::vector<Description> members;
    for (const auto& description : verbs) {
      if (description.verb.group == group) members.push_back(description);
    }
    if (members.empty()) continue;
    script += "    verbs=(\n";
    for (const auto& word : list_first_words(members)) {
      script += "      '" + word + ":" + quote_for_zsh(find_summary(word, members), "") + "'\n";
    }
    std::string tag(title.substr(0, title.find(' ')));
    script += "    )\n    _describe -t verbs-" + tag + " '" + std::string(title) + "' verbs\n";
  }
  return script;
}

std::string make_zsh_script(std::span<const Description> verbs) {
  std::string script =
      "#compdef panonav\n"
      "# Completion of panonav for zsh; made by: panonav completion zsh\n"
      "_panonav() {\n"
      "  local verb=$words[2]\n"
      "  local -a verbs\n"
      "  if (( CURRENT == 2 )); then\n" +
      make_zsh_verb_proposals(verbs) + "    return\n  fi\n";
  for (const auto& [first, seconds] : list_second_words(verbs)) {
    if (is_verb(verbs, first)) {
      for (const std::string& second : seconds) {
        script += "  if [[ $verb == " + first + " && $words[3] == " + second +
                  " ]] && (( CURRENT > 3 )); then\n    verb='" + first + " " + second +
                  "'\n    shift words\n    (( CURRENT-- ))\n  fi\n";
      }
      continue;
    }
    script += "  if [[ $verb == " + first +
              " ]]; then\n"
              "    if (( CURRENT == 3 )); then\n      compadd " +
              join_words(seconds) +
              "\n      return\n    fi\n"
              "    verb=\"$verb $words[3]\"\n    shift words\n    (( CURRENT-- ))\n  fi\n";
  }
  script += "  shift words\n  (( CURRENT-- ))\n  case $verb in\n";
  for (const auto& description : verbs) {
    script += "  " + case_pattern(description.verb) + ")\n    _arguments";
    for (const auto& argument : description.arguments) {
      if (argument.positional()) {
        script += " \\\n      '" + std::string(argument.repeated ? "*" : "") +
                  format_zsh_values(argument) + "'";
        continue;
      }
      for (const auto& form : {argument.short_form, argument.name}) {
        if (form.empty()) continue;
        const bool attached = !argument.value.empty() && form.starts_with("--") &&
                              argument.value.find(' ') == std::string::npos;
        script += " \\\n      '" + form + (attached ? "=" : "") + "[" +
                  quote_for_zsh(format_help_line(argument), "[]:\\") + "]" +
                  format_zsh_values(argument) + "'";
      }
    }
    script += "\n    ;;\n";
  }
  return script +
         "  esac\n}\n"
         "if [[ $funcstack[1] == _panonav ]]; then _panonav \"$@\"; else compdef _panonav panonav; "
         "fi";
}

/// Text within single quotes of fish.
std::string quote_for_fish(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') result += '\\';
    result += c;
  }
  return result + "'";
}

std::string make_fish_script(std::span<const Description> verbs) {
  std::string script =
      "# Completion of panonav for fish; made by: panonav completion fish\n"
      "function __panonav_verb\n"
      "  set -l words (commandline -opc)\n"
      "  test (count $words) -gt 1; or return 1\n"
      "  string match -q -- \"$argv[1]\" \"$words[2]\"; or return 1\n"
      "  test (count $argv) -eq 1; or string match -q -- \"$argv[2]\" \"$words[3]\"\n"
      "end\n"
      "complete -c panonav -f\n";
  for (const auto& word : list_first_words(verbs)) {
    script += "complete -c panonav -n __fish_use_subcommand -a " + word + " -d " +
              quote_for_fish(find_summary(word, verbs)) + "\n";
  }
  for (const auto& [first, seconds] : list_second_words(verbs)) {
    script += "complete -c panonav -n '__panonav_verb " + first +
              "; and test (count (commandline -opc)) -eq 2' -a " +
              quote_for_fish(join_words(seconds)) + "\n";
  }
  for (const auto& description : verbs) {
    for (const auto name : {description.verb.name, description.verb.alias}) {
      if (name.empty()) continue;
      const std::string start = "complete -c panonav -n '__panonav_verb " + std::string(name) + "'";
      const auto words = list_proposals(description);
      if (!words.empty()) script += start + " -a " + quote_for_fish(join_words(words)) + "\n";
      if (has_file_positionals(description)) script += start + " -F\n";
      for (const auto& argument : description.arguments) {
        if (argument.positional()) continue;
        script += start + " -l " + argument.name.substr(2);
        if (!argument.short_form.empty()) script += " -s " + argument.short_form.substr(1);
        if (!argument.value.empty()) script += accepts_files(argument) ? " -r -F" : " -x";
        if (!argument.choices.empty())
          script += " -a " + quote_for_fish(join_words(argument.choices));
        script += " -d " + quote_for_fish(argument.help) + "\n";
      }
    }
  }
  script.pop_back();  // whoever prints it ends the line
  return script;
}

struct Shell {
  std::string_view name;
  std::string (*script)(std::span<const Description>);
};
constexpr std::array<Shell, 3> shells{{
    {"bash", make_bash_script},
    {"zsh", make_zsh_script},
    {"fish", make_fish_script},
}};

}  // namespace

std::vector<std::string> completion_shells() {
  std::vector<std::string> names;
  for (const auto& shell : shells) names.emplace_back(shell.name);
  return names;
}

std::string completion_script(std::span<const Description> verbs, std::string_view name) {
  const auto* const shell = std::ranges::find(shells, name, &Shell::name);
  if (shell == shells.end()) {
    throw UsageError("SHELL is '" + std::string(name) +
                     "'; allowed: " + join_texts(completion_shells()));
  }
  return shell->script(verbs);
}

}  // namespace panonav::command
