#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace panonav::ros2 {

/// Arguments that `ros2 run` and launch files pass to the executable of a node.
struct RosArguments {
  struct Parameter {
    std::string name;                 ///< of nested maps "outer.inner"
    std::vector<std::string> values;  ///< one; of a sequence its entries
    std::string where;                ///< the file, or "-p", for messages
  };
  std::vector<std::string> words;  ///< those that are not for ROS
  /// New names of topics, and of `__node` and `__ns`.
  std::map<std::string, std::string> remappings;
  std::vector<Parameter> parameters;  ///< each name once, with the value that applies
};

/// Separates the words between `--ros-args` and `--` (or the end) from the others: `-r FROM:=TO`,
/// `-p NAME:=VALUE`, `--params-file FILE`, with their long forms. A later parameter replaces an
/// earlier one; in a file the node's own replaces that for all nodes. Options for log files and
/// enclaves are ignored. `node` and `name_space` are the names before remapping. Throws
/// ContractError on a word that is none of these, FileError on a file that is missing, larger than
/// 1 MB or no parameter file.
[[nodiscard]] RosArguments read_ros_arguments(std::span<const std::string> words,
                                              const std::string& node,
                                              const std::string& name_space);

/// Returns the two sides of FROM:=TO. Throws ContractError.
[[nodiscard]] std::pair<std::string, std::string> parse_remapping(const std::string& text);

}  // namespace panonav::ros2
