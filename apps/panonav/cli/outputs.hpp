#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace panonav::command {

/// A value of the command line that may be the path of a file or folder.
struct NamedValue {
  std::string name;  ///< name of the argument: "--tum" or "MEMORY"
  std::string value;
  bool is_output = false;  ///< the verb writes it
};

/// The outputs of a verb that exist before it runs: files, and the pages in folders.
class EarlierOutputs {
 public:
  void add(const std::filesystem::path& output);
  /// Returns those that have been written since `add`. Cost: one stat call per output.
  [[nodiscard]] std::vector<std::string> list_replaced() const;

 private:
  struct File {
    std::string path;
    std::filesystem::file_time_type written;
  };
  std::vector<File> files_;
};

/// Throws UsageError if an output would overwrite an input: a file that another argument names
/// (same device and inode, also through links), a file in a named folder, a file that a named TOML
/// file mentions, or a log of a memory file. Also throws if two outputs are the same file. Returns
/// the outputs that exist. Cost: one stat call per file of the named folders, only if an output
/// exists already.
[[nodiscard]] EarlierOutputs require_separate_outputs(std::span<const NamedValue> values);

}  // namespace panonav::command
