#include "panonav_ros2/ros_arguments.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::ros2 {

namespace {

using Parameters = std::vector<RosArguments::Parameter>;

constexpr std::size_t max_file_bytes = 1'000'000;
constexpr int max_depth = 16;
constexpr int max_nodes = 10'000;

std::pair<std::string, std::string> parse_sides(const std::string& text, const std::string& what,
                                                const std::string& allowed) {
  const std::size_t at = text.find(":=");
  if (at == 0 || at == std::string::npos || at + 2 == text.size()) {
    throw ContractError(what, "'" + to_readable_line(shorten_middle(text, 80)) + "'", allowed);
  }
  return {text.substr(0, at), text.substr(at + 2)};
}

void set_or_replace(Parameters& parameters, RosArguments::Parameter parameter) {
  const auto found = std::ranges::find(parameters, parameter.name, &RosArguments::Parameter::name);
  if (found == parameters.end()) {
    parameters.push_back(std::move(parameter));
  } else {
    *found = std::move(parameter);
  }
}

/// Returns a scalar as text; YAML's additional forms of true and false, which options do not have,
/// become "true" and "false".
std::string to_text_value(const YAML::Node& node, const std::string& name,
                          const std::string& where) {
  if (!node.IsScalar()) throw FileError(where, name + " has a value that is not a text or number");
  const auto text = node.as<std::string>();
  if (text == "True" || text == "TRUE") return "true";
  return text == "False" || text == "FALSE" ? "false" : text;
}

/// Sets parameters from a YAML value; nested maps give names with dots. `nodes_left` limits the
/// expansion of aliases. Throws YAML's exceptions.
void flatten_parameters(const YAML::Node& node, const std::string& name, const std::string& where,
                        int depth, int& nodes_left, Parameters& parameters) {
  if (depth > max_depth) throw FileError(where, name + " is nested too deeply");
  if (--nodes_left < 0) throw FileError(where, "has more than 10,000 parameters");
  if (node.IsMap()) {
    for (const auto& entry : node) {
      const auto inner = entry.first.as<std::string>();
      flatten_parameters(entry.second, name.empty() ? inner : name + "." + inner, where, depth + 1,
                         nodes_left, parameters);
    }
    return;
  }
  RosArguments::Parameter parameter{name, {}, where};
  if (node.IsSequence()) {
    for (const auto& each : node) parameter.values.push_back(to_text_value(each, name, where));
  } else {
    parameter.values.push_back(to_text_value(node, name, where));
  }
  set_or_replace(parameters, std::move(parameter));
}

/// Reads the parameters of one node from a file, which may contain those of many nodes. Keys are
/// node names, with or without namespace; "/**" means all nodes, "/**/name" all nodes of this name.
void read_parameter_file(const std::string& path, const std::string& node,
                         const std::string& name_space, Parameters& parameters) {
  const auto bytes = read_file(path, max_file_bytes);
  const std::string inside = name_space == "/" ? "" : name_space;
  try {
    const YAML::Node root = YAML::Load(std::string(bytes.begin(), bytes.end()));
    if (!root.IsMap()) throw FileError(path, "contains no map of nodes' names");
    const auto take = [&](const YAML::Node& of_node) {
      if (!of_node.IsMap() || !of_node["ros__parameters"] || !of_node["ros__parameters"].IsMap()) {
        throw FileError(path,
                        "has a node without a map ros__parameters; allowed: NODE: "
                        "{ros__parameters: {NAME: VALUE}}");
      }
      int nodes_left = max_nodes;
      flatten_parameters(of_node["ros__parameters"], "", path, 0, nodes_left, parameters);
    };
    const std::array<std::string, 4> from_wide_to_narrow{"/**", "/**/" + node, node,
                                                         inside + "/" + node};
    for (const std::string& key : from_wide_to_narrow) {
      if (key == node && !inside.empty()) continue;  // means the node in the root namespace
      if (root[key]) take(root[key]);
    }
    // Also accept the form NAMESPACE: {NODE: {ros__parameters: ...}}.
    if (!inside.empty() && root[inside] && root[inside].IsMap() && root[inside][node]) {
      take(root[inside][node]);
    }
  } catch (const YAML::Exception& error) {
    throw FileError(path, "is not a parameter file: " + to_readable_line(error.what()));
  }
}

/// A ROS option with its value, as typed after --ros-args.
struct RosOption {
  std::string flag;
  std::string value;
  [[nodiscard]] bool matches(std::initializer_list<std::string_view> forms) const {
    return std::ranges::find(forms, flag) != forms.end();
  }
};

/// Appends the arguments outside of `--ros-args ... --` to `others`, and returns the options
/// inside.
std::vector<RosOption> split_options(std::span<const std::string> words,
                                     std::vector<std::string>& others) {
  std::vector<RosOption> options;
  bool is_inside = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--ros-args") {
      is_inside = true;
    } else if (is_inside && word == "--") {
      is_inside = false;
    } else if (!is_inside) {
      others.push_back(word);
    } else if (!word.starts_with("--enable-") && !word.starts_with("--disable-")) {
      RosOption option{word, {}};
      if (!option.matches({"-r", "--remap", "-p", "--param", "--params-file", "--log-level",
                           "--log-config-file", "--log-file-name", "-e", "--enclave"})) {
        throw ContractError("word after --ros-args",
                            "'" + to_readable_line(shorten_middle(word, 80)) + "'",
                            "-r FROM:=TO, -p NAME:=VALUE, --params-file FILE");
      }
      if (++i == words.size()) throw ContractError("value of " + word, "missing", "one");
      option.value = words[i];
      options.push_back(std::move(option));
    }
  }
  return options;
}

/// Removes the prefix "NODE:" from a name. Returns false if it names another node.
bool is_for_node(std::string& name, const std::string& node) {
  const std::size_t colon = name.find(':');
  if (colon == std::string::npos) return true;
  const bool is_own = name.substr(0, colon) == node;
  name = name.substr(colon + 1);
  return is_own;
}

void read_parameter(const RosOption& option, const std::string& node, Parameters& parameters) {
  auto [name, value] = parse_sides(option.value, "parameter", "NAME:=VALUE, as use_sim_time:=true");
  if (!is_for_node(name, node)) return;
  try {
    int nodes_left = max_nodes;
    flatten_parameters(YAML::Load(value), name, option.flag, 0, nodes_left, parameters);
  } catch (const YAML::Exception& error) {
    throw ContractError("value of " + name, "'" + to_readable_line(shorten_middle(value, 80)) + "'",
                        std::string("YAML: ") + to_readable_line(error.what()));
  }
}

}  // namespace

std::pair<std::string, std::string> parse_remapping(const std::string& text) {
  return parse_sides(text, "remapping", "FROM:=TO, as image:=/camera/image");
}

RosArguments read_ros_arguments(std::span<const std::string> words, const std::string& node,
                                const std::string& name_space) {
  RosArguments read;
  const auto options = split_options(words, read.words);
  for (const RosOption& option : options) {
    if (!option.matches({"-r", "--remap"})) continue;
    auto [from, to] = parse_remapping(option.value);
    if (!is_for_node(from, node)) continue;
    read.remappings.insert_or_assign(from == "__name" ? "__node" : from, to);
  }
  const auto find_new_name = [&](const std::string& key, const std::string& initial) {
    const auto found = read.remappings.find(key);
    return found == read.remappings.end() ? initial : found->second;
  };
  const std::string own_node = find_new_name("__node", node);
  const std::string own_space = find_new_name("__ns", name_space);
  for (const RosOption& option : options) {
    if (option.matches({"--params-file"})) {
      read_parameter_file(option.value, own_node, own_space, read.parameters);
    } else if (option.matches({"-p", "--param"})) {
      read_parameter(option, own_node, read.parameters);
    }
  }
  return read;
}

}  // namespace panonav::ros2
