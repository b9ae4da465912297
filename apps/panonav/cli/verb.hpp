#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::command {

class Arguments;
struct ArgumentInfo;
class Session;

/// The exit codes of the program.
enum class ExitCode : int {
  done = 0,
  no_answer = 1,  ///< lost or no path; for a data set only if no image had an answer
  bad_input = 2,  ///< one line on standard error explains the error
  fault = 3,      ///< internal error of the program
};

/// Runs a verb after its arguments were parsed. Throws panonav::Error on bad input. The `Arguments`
/// with which it was declared outlive the call.
using Run = std::function<ExitCode(Session&)>;

/// The groups of verbs in help, manual page and completion, in this order.
enum class VerbGroup {
  first_steps,
  memory,
  localisation,
  maps_and_routes,
  several_robots,
  tools,
  experiments,
};

/// One verb of the command line. Help, manual page and shell completion are made from this and from
/// the arguments that the verb declares (cli/texts.hpp).
struct Verb {
  std::string_view name;  ///< one word, or two with a blank between: "route record"
  VerbGroup group;
  std::string_view summary;  ///< one plain line of at most 64 characters
  std::string_view details;  ///< what a user must know besides the options; lines are joined
  std::string_view example;  ///< complete command lines, the most useful ones first
  Run (*declare)(Arguments&);
  std::string_view alias = {};  ///< another accepted spelling of the name
  /// Translates arguments of another convention (ROS) to those of the command line; null: not
  /// needed.
  std::vector<std::string> (*translate)(std::span<const std::string> words,
                                        std::span<const ArgumentInfo> infos) = nullptr;
};

}  // namespace panonav::command
