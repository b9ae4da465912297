#pragma once

#include <span>
#include <string>

namespace panonav::command {

/// A value of the command line that may be the path of a file or folder.
struct NamedValue {
  std::string name;  ///< of the argument: "--tum" or "MEMORY"
  std::string value;
  bool is_output = false;  ///< the verb writes it
};

/// Throws UsageError if an output would replace a file that another value names: the same file
/// (device and inode, also through links), a file in a named folder, one that a TOML file names,
/// or a log of a memory file. Also throws if two outputs are the same file. Cost: a look at each
/// file of the folders, only if an output exists already.
void require_separate_outputs(std::span<const NamedValue> values);

}  // namespace panonav::command
