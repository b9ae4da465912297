#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace panonav::testing {

/// How a run of the command ended, and what it said.
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

[[nodiscard]] std::vector<std::string> lines(const std::string& text);

/// A new empty folder that is removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const& noexcept { return path_; }
  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

/// The folder of real recordings (environment variable PANONAV_DATA); empty when there is none.
[[nodiscard]] std::optional<std::filesystem::path> real_data(const std::string& folder);

}  // namespace panonav::testing
