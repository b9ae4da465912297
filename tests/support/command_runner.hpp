#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <source_location>
#include <string>
#include <string_view>
#include <vector>

#include "support/skips.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {

/// Exit code and output of a run of the command.
struct CommandResult {
  int exit_code = -1;  ///< -1: ended by a signal
  int signal = 0;
  std::string out;
  std::string err;
};

struct CommandOptions {
  std::optional<std::uint64_t>
      file_size_limit_bytes;         ///< a full disk, as far as a process can tell
  std::optional<int> kill_after_ms;  ///< SIGKILL, as when the battery dies
};

/// Runs the built command with standard output and standard error in pipes.
[[nodiscard]] CommandResult run_panonav(const std::vector<std::string>& arguments,
                                        const CommandOptions& options = {});

/// Runs, expects exit code 2 and exactly one line on standard error, and gives that line.
[[nodiscard]] std::string refusal(const std::vector<std::string>& arguments,
                                  const CommandOptions& options = {});

/// As `refusal`, and expects `part` in that line.
void expect_refusal(const std::vector<std::string>& arguments, std::string_view part,
                    const std::source_location& caller = std::source_location::current());

/// Runs, expects the exit code and gives what the command printed, one JSON value.
[[nodiscard]] nlohmann::json answer_of(const std::vector<std::string>& arguments,
                                       int exit_code = 0);
/// The same with an object on each line.
[[nodiscard]] std::vector<nlohmann::json> answers_of(const std::vector<std::string>& arguments,
                                                     int exit_code = 0);

/// Runs and expects exit code 0.
void run_well(const std::vector<std::string>& arguments);

[[nodiscard]] std::vector<std::string> lines(const std::string& text);
/// Returns the parts of the text between blanks, such as the words of a verb of two.
[[nodiscard]] std::vector<std::string> words_of(const std::string& text);
[[nodiscard]] std::set<std::string> keys_of(const nlohmann::json& object);
/// The arguments and more.
[[nodiscard]] std::vector<std::string> with(std::vector<std::string> arguments,
                                            const std::vector<std::string>& more);

}  // namespace panonav::testing
