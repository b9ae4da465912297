#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verb.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

/// Included by each verb's file, which defines the function NAME_verb; CMake puts it into the
/// list of all verbs.
namespace panonav::command {

/// Registers the components of this build (recordings, fleet, ...) with the library; called once,
/// before a verb runs.
void register_components();

/// Returns every verb of this build, in the order of the overview.
[[nodiscard]] std::vector<Verb> all_verbs();
[[nodiscard]] std::vector<std::string> verb_names();
/// Returns the verb that the words name. Throws UsageError if there is none or if words remain.
[[nodiscard]] const Verb& find_named_verb(std::span<const Verb> verbs,
                                          const std::vector<std::string>& words);

/// Prints the text, or {"text": ...} with --json.
ExitCode print_text(const std::string& text, Session& session);

}  // namespace panonav::command
