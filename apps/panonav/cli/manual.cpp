#include <algorithm>
#include <array>
#include <cctype>

#include "cli/texts.hpp"

namespace panonav::command {

namespace {

struct Meaning {
  std::string_view name;
  std::string_view meaning;
};

constexpr std::array<Meaning, 5> environment{{
    {"PANONAV_DATA", "Folder with the real recordings that panonav reproduce uses."},
    {"PANONAV_INSTRUCTIONS",
     "Instruction set of the processor: scalar, avx2, avx512 or neon. By default panonav selects "
     "the best one."},
    {"PANONAV_WEB_PAGE", "Folder with the files of the page that panonav export --web writes."},
    {"GAZEBO_MODEL_PATH, GZ_SIM_RESOURCE_PATH", "Folders with the models of Gazebo worlds."},
    {"NO_COLOR", "If this variable is set, output is not coloured."},
}};

constexpr std::array<Meaning, 4> files{{
    {"NAME.panonav",
     "A memory, stored as an SQLite database. While it is open for writing, it also consists of "
     "the files NAME.panonav-wal and NAME.panonav-shm in the same folder."},
    {"dataset.toml",
     "Describes the type of the images of a data set. It is in the folder of the data set."},
    {"camera.toml", "Calibration of a mirror camera, written by panonav calibrate."},
    {"FILE of --config", "Options in sections; panonav VERB --config-template prints an example."},
}};

/// Escapes a text so that roff shows it unchanged; newlines become blanks.
std::string escape_roff(std::string_view text) {
  std::string shown;
  for (const char c : text) {
    if (c == '\\') {
      shown += "\\e";
    } else if (c == '-') {
      shown += "\\-";
    } else if (c == '\n') {
      shown += ' ';
    } else {
      shown += c;
    }
  }
  return !shown.empty() && (shown.front() == '.' || shown.front() == '\'') ? "\\&" + shown : shown;
}

std::string format_entry(std::string_view term, std::string_view text) {
  return ".TP\n\\fB" + escape_roff(term) + "\\fR\n" + escape_roff(text) + "\n";
}

template <class Meanings>
std::string format_entries(std::string_view title, const Meanings& meanings) {
  std::string text = ".SH " + std::string(title) + "\n";
  for (const auto& [name, meaning] : meanings) text += format_entry(name, meaning);
  return text;
}

std::string format_exit_status() {
  std::string text = ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : exit_meanings()) {
    text += format_entry(std::to_string(static_cast<int>(code)), std::string(meaning) + ".");
  }
  return text;
}

std::string format_header(std::string_view page, std::string_view summary) {
  std::string upper(page);
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return ".TH \"" + escape_roff(upper) +
         "\" 1 \"\" \"panonav " PANONAV_VERSION "\" \"panonav manual\"\n.nh\n.ad l\n.SH NAME\n" +
         escape_roff(page) + " \\- " + escape_roff(summary) + "\n.SH SYNOPSIS\n";
}

}  // namespace

std::string manual_name(const Verb& verb) {
  std::string name = "panonav-" + std::string(verb.name);
  std::ranges::replace(name, ' ', '-');
  return name;
}

std::string manual_page(const Description& description) {
  const auto& [verb, arguments] = description;
  std::string text = format_header(manual_name(verb), verb.summary);
  for (const auto name : {verb.name, verb.alias}) {
    if (name.empty()) continue;
    text += (name == verb.name ? "" : ".br\n") + std::string("\\fBpanonav ") + escape_roff(name) +
            "\\fR " + escape_roff(usage(description)) + "\n";
  }
  text += ".SH DESCRIPTION\n" + escape_roff(verb.summary) + ".\n";
  if (!verb.details.empty()) text += escape_roff(verb.details) + "\n";
  std::string title = "Options";
  for (const bool positional : {true, false}) {
    if (!positional) text += ".SH OPTIONS\n";
    for (const auto& argument : arguments) {
      if (argument.positional() != positional) continue;
      const std::string group = positional ? "Arguments" : get_group_title(argument);
      if (group != title)
        text += (positional ? ".SH ARGUMENTS\n" : ".SS \"" + escape_roff(group) + "\"\n");
      title = group;
      text += format_entry(format_flags_and_value(argument), format_help_line(argument) + ".");
    }
  }
  text += ".SH EXAMPLES\n.nf\n";
  std::string_view left = verb.example;
  while (!left.empty()) {
    const std::size_t end = std::min(left.find('\n'), left.size());
    text += escape_roff(left.substr(0, end)) + "\n";
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return text + ".fi\n" + format_exit_status() + format_entries("ENVIRONMENT", environment) +
         format_entries("FILES", files) + ".SH SEE ALSO\n\\fBpanonav\\fR(1)";
}

std::string manual_overview(std::span<const Description> verbs) {
  std::string text = format_header("panonav", "image-based memory for robot navigation");
  text +=
      "\\fBpanonav\\fR \\fIVERB\\fR [OPTIONS] ARGUMENTS\n.SH DESCRIPTION\nPanonav stores "
      "omnidirectional images of places in a memory. It compares new images with this memory to "
      "find the position and heading of a robot.\nEach verb has its own manual page.\n.SH VERBS\n";
  for (const auto& [group, title] : verb_groups()) {
    std::string entries;
    for (const auto& [verb, arguments] : verbs) {
      if (verb.group == group) entries += format_entry(verb.name, std::string(verb.summary) + ".");
    }
    if (!entries.empty()) text.append(".SS \"").append(title).append("\"\n").append(entries);
  }
  text += ".SH OPTIONS\n";
  for (const auto& argument : verbs.front().arguments) {
    if (argument.of_every_verb)
      text += format_entry(format_flags_and_value(argument), format_help_line(argument) + ".");
  }
  text += format_exit_status() + format_entries("ENVIRONMENT", environment) +
          format_entries("FILES", files) + ".SH SEE ALSO\n";
  for (const auto& [verb, arguments] : verbs) {
    text += "\\fB" + escape_roff(manual_name(verb)) + "\\fR(1)" +
            (verb.name == verbs.back().verb.name ? "" : ",\n");
  }
  return text;
}

}  // namespace panonav::command
