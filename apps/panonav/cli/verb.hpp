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
  no_answer = 1,  ///< lost, no path; for a data set only if nothing at all was answered
  bad_input = 2,  ///< one line on standard error says what is wrong
  fault = 3,      ///< the program itself failed; never meant to happen
};

/// The work of a verb, once its arguments are known. Throws panonav::Error on bad input. The
/// `Arguments` that it was declared with are still there when it runs.
using Run = std::function<ExitCode(Session&)>;

/// One verb of the command line. Its help, its manual page and the completion of shells are made
/// from this and from the arguments that it declares (cli/texts.hpp).
struct Verb {
  std::string_view name;     ///< one word, or two with a blank between: "route record"
  std::string_view summary;  ///< one plain line
  std::string_view details;  ///< what a user must know beyond the options; lines are joined
  std::string_view example;  ///< command lines that work as they stand, the most useful ones first
  Run (*declare)(Arguments&);
  std::string_view alias = {};  ///< another spelling that is taken
  /// Translates arguments of another convention (ROS) to those of the command line; null: there is
  /// none.
  std::vector<std::string> (*translate)(std::span<const std::string> words,
                                        std::span<const ArgumentInfo> infos) = nullptr;
};

}  // namespace panonav::command
