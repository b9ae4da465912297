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
    std::string name;                 ///< nested maps as "outer.inner"
    std::vector<std::string> values;  ///< one value, or the entries of a sequence
    std::string where;                ///< file name or "-p", for messages
  };
  std::vector<std::string> words;  ///< all arguments that are not for ROS
  /// New names of topics; also of `__node` and `__ns`.
  std::map<std::string, std::string> remappings;
  std::vector<Parameter> parameters;  ///< each name once, with its final value
};

/// Separates the words between `--ros-args` and `--` (or the end) from the others: `-r FROM:=TO`,
/// `-p NAME:=VALUE`, `--params-file FILE`, with their long forms. A later parameter replaces an
/// earlier one of the same name; in a file, a parameter of the node replaces one for all nodes.
/// Options for log files and enclaves are ignored. `node` and `name_space` are the names before
/// remapping. Throws ContractError on any other word, and FileError on a file that is missing,
/// larger than 1 MB or not a parameter file.
[[nodiscard]] RosArguments read_ros_arguments(std::span<const std::string> words,
                                              const std::string& node,
                                              const std::string& name_space);

/// Returns the two sides of FROM:=TO. Throws ContractError.
[[nodiscard]] std::pair<std::string, std::string> parse_remapping(const std::string& text);

}  // namespace panonav::ros2
