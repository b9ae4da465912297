#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/verb.hpp"

namespace panonav::command {

/// A verb with its arguments, from which all texts below are made.
struct Description {
  Verb verb;
  std::vector<ArgumentInfo> arguments;
};
[[nodiscard]] Description describe(const Verb& verb);
[[nodiscard]] std::vector<Description> describe(std::span<const Verb> verbs);

/// A group of verbs and its title, such as "Memory".
struct GroupTitle {
  VerbGroup group;
  std::string_view title;
};
/// Returns the groups in the order of the help.
[[nodiscard]] std::span<const GroupTitle> verb_groups();

/// An exit code and its meaning, for the overview and the manual.
struct ExitMeaning {
  ExitCode code;
  std::string_view meaning;
};
[[nodiscard]] std::span<const ExitMeaning> exit_meanings();

/// Returns the help of an argument with its default and range: "Highest speed (default 0.3; above 0
/// to 100)".
[[nodiscard]] std::string format_help_line(const ArgumentInfo& argument);
/// Returns the flags of an argument and the name of its value: "-o, --out FILE".
[[nodiscard]] std::string format_flags_and_value(const ArgumentInfo& argument);
/// Returns the usage line of a verb: "[OPTIONS] -o FILE IMAGE...".
[[nodiscard]] std::string usage(const Description& description);
/// Returns the title of the group of an argument in the long help and the manual: "Options of
/// [localiser]".
[[nodiscard]] std::string get_group_title(const ArgumentInfo& argument);
/// Wraps a text at 80 columns. The first line continues at `column`; the others begin with `indent`
/// blanks.
[[nodiscard]] std::string wrap_text(std::string_view text, std::size_t indent, std::size_t column);

/// Returns the text of `panonav VERB --help`, or of `--help-all`.
[[nodiscard]] std::string format_help(const Description& description, bool all);
/// Returns the text of `panonav --help`.
[[nodiscard]] std::string overview(std::span<const Verb> verbs);

/// Returns the names of the shells that have a completion script.
[[nodiscard]] std::vector<std::string> completion_shells();
[[nodiscard]] std::string completion_script(std::span<const Description> verbs,
                                            std::string_view shell);

/// Returns the name of a verb's manual page, such as "panonav-route-record". The pages below are
/// roff texts.
[[nodiscard]] std::string manual_name(const Verb& verb);
[[nodiscard]] std::string manual_page(const Description& description);
[[nodiscard]] std::string manual_overview(std::span<const Description> verbs);

}  // namespace panonav::command
