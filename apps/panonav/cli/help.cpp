#include <algorithm>
#include <array>

#include "cli/option_values.hpp"
#include "cli/texts.hpp"

namespace panonav::command {

namespace {

/// Formats an argument with its help to the right, or below it if the argument is long.
std::string format_row(const std::string& left, std::string_view right, std::size_t column) {
  std::string line = "  " + left;
  if (line.size() + 2 > column) {
    line += "\n";
    line.append(column, ' ');
  } else {
    line.resize(column, ' ');
  }
  return line + wrap_text(right, column, column) + "\n";
}

/// Returns the first `count` lines of the examples.
std::string select_first_examples(std::string_view text, std::size_t count) {
  std::size_t end = 0;
  while (count-- > 0 && end < text.size())
    end = std::min(text.find('\n', end), text.size() - 1) + 1;
  std::string kept(text.substr(0, end));
  while (!kept.empty() && kept.back() == '\n') kept.pop_back();
  return kept + "\n";
}

}  // namespace

std::vector<Description> describe(std::span<const Verb> verbs) {
  std::vector<Description> descriptions;
  for (const auto& verb : verbs) descriptions.push_back(describe(verb));
  return descriptions;
}

std::span<const GroupTitle> verb_groups() {
  static constexpr std::array<GroupTitle, 7> groups{{
      {VerbGroup::first_steps, "First steps"},
      {VerbGroup::memory, "Memory"},
      {VerbGroup::localisation, "Localisation and tracking"},
      {VerbGroup::maps_and_routes, "Maps and routes"},
      {VerbGroup::several_robots, "Several robots"},
      {VerbGroup::tools, "Tools"},
      {VerbGroup::experiments, "Experiments"},
  }};
  return groups;
}

std::span<const ExitMeaning> exit_meanings() {
  static constexpr std::array<ExitMeaning, 4> meanings{{
      {ExitCode::done, "done"},
      {ExitCode::no_answer, "no answer, for example because the robot is lost"},
      {ExitCode::bad_input, "invalid input; one line on standard error explains the fault"},
      {ExitCode::fault, "internal error of the program"},
  }};
  return meanings;
}

std::string wrap_text(std::string_view text, std::size_t indent, std::size_t column) {
  constexpr std::size_t width = 80;
  std::string lines;
  bool is_line_start = true;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(" \n"), text.size());
    const auto word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    if (!is_line_start && column + 1 + word.size() > width) {
      lines += '\n';
      lines.append(indent, ' ');
      column = indent;
      is_line_start = true;
    }
    lines.append(is_line_start ? "" : " ").append(word);
    column += word.size() + (is_line_start ? 0 : 1);
    is_line_start = false;
  }
  return lines;
}

std::string format_help_line(const ArgumentInfo& argument) {
  std::string notes;
  const auto note = [&notes](const std::string& text) {
    if (!text.empty()) notes += (notes.empty() ? "" : "; ") + text;
  };
  if (argument.required && !argument.positional()) note("required");
  if (!argument.default_value.empty()) note("default " + argument.default_value);
  note(argument.range);
  const std::string choices = join_texts(argument.choices);
  if (!argument.positional() && !choices.empty()) note("one of " + choices);
  return argument.help + (notes.empty() ? "" : " (" + notes + ")");
}

std::string format_flags_and_value(const ArgumentInfo& argument) {
  return (argument.short_form.empty() ? "" : argument.short_form + ", ") + argument.name +
         (argument.value.empty() ? "" : " " + argument.value);
}

std::string usage(const Description& description) {
  std::string text = "[OPTIONS]";
  for (const auto& argument : description.arguments) {
    if (argument.positional() || !argument.required) continue;
    text += " " + (argument.short_form.empty() ? argument.name : argument.short_form) + " " +
            argument.value;
  }
  for (const auto& argument : description.arguments) {
    if (!argument.positional()) continue;
    const std::string word = argument.name + (argument.repeated ? "..." : "");
    text += argument.required ? " " + word : " [" + word + "]";
  }
  return text;
}

std::string get_group_title(const ArgumentInfo& argument) {
  if (argument.of_every_verb) return "Options of every verb";
  return argument.section.empty() ? "Options" : "Options of [" + argument.section + "]";
}

std::string format_help(const Description& description, bool all) {
  const auto& [verb, arguments] = description;
  const std::string name(verb.name);
  std::string text = wrap_text(std::string(verb.summary) + ".", 0, 0) + "\n\n";
  text += "Usage: panonav " + name + " " + usage(description) + "\n";
  if (!verb.alias.empty()) text += "Other spelling: panonav " + std::string(verb.alias) + "\n";
  text += "\nExamples:\n" + select_first_examples(verb.example, all ? arguments.size() + 100 : 2);
  std::string title;
  std::size_t hidden = 0;
  for (const bool positional : {true, false}) {
    for (const auto& argument : arguments) {
      if (argument.positional() != positional) continue;
      if (!all && !argument.is_in_short_help) {
        ++hidden;
        continue;
      }
      // The short help has one list of options.
      const std::string group = positional ? "Arguments"
                                : all      ? get_group_title(argument)
                                           : "Options";
      if (group != title) text += "\n" + group + ":\n";
      title = group;
      text += format_row(format_flags_and_value(argument), format_help_line(argument), 28);
    }
  }
  if (!verb.details.empty()) text.append("\n").append(wrap_text(verb.details, 0, 0)).append("\n");
  if (hidden > 0) {
    text += "\nThis verb has " + std::to_string(hidden) + " more options; to list them: panonav " +
            name + " --help-all\n";
  }
  text.pop_back();  // whoever prints it ends the line
  return text;
}

std::string overview(std::span<const Verb> verbs) {
  std::string text = wrap_text(
                         "Image-based memory for robot navigation. panonav stores omnidirectional "
                         "images of places in a memory. It compares new images with this memory to "
                         "find the robot's position and heading.",
                         0, 0) +
                     "\n\nUsage: panonav VERB [OPTIONS] ARGUMENTS\n";
  for (const auto& [group, title] : verb_groups()) {
    std::string rows;
    for (const auto& verb : verbs) {
      if (verb.group == group) rows += format_row(std::string(verb.name), verb.summary, 16);
    }
    if (!rows.empty()) text.append("\n").append(title).append(":\n").append(rows);
  }
  text += "\n";
  text += wrap_text(
      "If a verb has a memory and an input, the memory comes first: panonav localise MEMORY INPUT. "
      "panonav help VERB explains a verb. panonav VERB --help-all lists all its options. panonav "
      "--version prints the version.",
      0, 0);
  text += "\n\nExit codes:\n";
  for (const auto& [code, meaning] : exit_meanings()) {
    text += format_row(std::to_string(static_cast<int>(code)), meaning, 5);
  }
  text.pop_back();
  return text;
}

}  // namespace panonav::command
