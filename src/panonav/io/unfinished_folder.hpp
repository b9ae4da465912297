#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/temporary_file.hpp"

namespace panonav {

/// A folder that is filled under a temporary name and renamed when it is complete; otherwise it is
/// removed, with the parent folders that were made for it.
class UnfinishedFolder {
 public:
  /// Makes the folder under a temporary name, and its parent folders. Throws FileError if that
  /// fails, or if `target` exists and is not an empty folder.
  explicit UnfinishedFolder(const std::filesystem::path& target);
  ~UnfinishedFolder();
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  /// Returns the temporary path under which to fill the folder.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Appends the bytes to a file of the folder, which is made first if it is missing, with the
  /// folders above it; `name` is relative. Unlike `write_file`, does not wait for the disk, which
  /// `finish` does once for all files. Throws FileError.
  void append(const std::filesystem::path& name, std::span<const std::uint8_t> bytes) const;
  /// Waits until all files are on the disk and renames the folder to its final name. Throws
  /// FileError.
  void finish();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> new_parents_;  // made for the target, the deepest first
  std::optional<TemporaryFile> mark_;               // keeps its temporary name unique
};

}  // namespace panonav
