#pragma once

#include <filesystem>
#include <optional>

#include "panonav/core/temporary_file.hpp"

namespace panonav {

/// A folder that gets its name when it is complete, and is removed if it never is.
class UnfinishedFolder {
 public:
  /// Makes the folder under a temporary name, and the folders that it lies in. Throws FileError
  /// when it cannot be made, and when something is at `target` but an empty folder.
  explicit UnfinishedFolder(const std::filesystem::path& target);
  ~UnfinishedFolder();
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  /// Returns the temporary name, under which the folder is filled.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Gives the folder its name. Throws FileError.
  void finish();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  std::optional<TemporaryFile> mark_;  // tells living processes apart
};

}  // namespace panonav
