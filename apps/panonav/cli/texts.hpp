#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/verb.hpp"

namespace panonav::command {

/// A verb with its arguments: the one description from which all texts below are made.
struct Description {
  Verb verb;
  std::vector<ArgumentInfo> arguments;
};
[[nodiscard]] Description describe(const Verb& verb);
[[nodiscard]] std::vector<Description> describe(std::span<const Verb> verbs);

/// Exit codes, for the overview and the manual.
struct ExitMeaning {
  ExitCode code;
  std::string_view meaning;
};
[[nodiscard]] std::span<const ExitMeaning> exit_meanings();

/// "Highest speed (default 0.3; > 0 and <= 100)".
[[nodiscard]] std::string format_help_line(const ArgumentInfo& argument);
/// "-o, --out FILE".
[[nodiscard]] std::string format_flags_and_value(const ArgumentInfo& argument);
/// "[OPTIONS] -o FILE IMAGE..."
[[nodiscard]] std::string usage(const Description& description);
/// The title above the arguments of its group in full texts: "Options of [localiser]".
[[nodiscard]] std::string get_group_title(const ArgumentInfo& argument);
/// Lines of at most 80 characters behind `indent` blanks; the first one begins at `column`.
[[nodiscard]] std::string wrap_text(std::string_view text, std::size_t indent, std::size_t column);

/// Returns the text of `panonav VERB --help`, or of `--help-all`.
[[nodiscard]] std::string format_help(const Description& description, bool all);
/// Returns the text of `panonav --help`.
[[nodiscard]] std::string overview(std::span<const Verb> verbs);

/// Shells that have a completion script.
[[nodiscard]] std::vector<std::string> completion_shells();
[[nodiscard]] std::string completion_script(std::span<const Description> verbs,
                                            std::string_view shell);

/// Manual pages as roff. The name of a verb's page is "panonav-route-record".
[[nodiscard]] std::string manual_name(const Verb& verb);
[[nodiscard]] std::string manual_page(const Description& description);
[[nodiscard]] std::string manual_overview(std::span<const Description> verbs);

}  // namespace panonav::command
