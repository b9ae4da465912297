#pragma once

#include <span>
#include <string>

namespace panonav::command {

/// A value of the command line that may be the path of a file or folder.
struct NamedValue {
  std::string name;  ///< name of the argument: "--tum" or "MEMORY"
  std::string value;
  bool is_output = false;  ///< the verb writes it
};

/// Throws UsageError if an output would overwrite an input: a file that another argument names
/// (same device and inode, also through links), a file in a named folder, a file that a named TOML
/// file mentions, or a log of a memory file. Also throws if two outputs are the same file. Cost:
/// one stat call per file of the named folders, only if an output exists already.
void require_separate_outputs(std::span<const NamedValue> values);

}  // namespace panonav::command
