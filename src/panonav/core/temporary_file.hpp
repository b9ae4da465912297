#pragma once

#include <filesystem>

namespace panonav {

/// A new empty file for what is to become `target`, in the same folder: ".NAME.tmp", after removing
/// the one that a dead process left, or ".NAME.<16 random digits>.tmp" while a process uses that
/// name. It is locked as long as its maker lives, so that nobody takes it for a left one, and goes
/// with the object unless `keep` was called. Throws FileError on `target`.
class TemporaryFile {
 public:
  /// Creates the file at once, with the permissions that the process's umask leaves.
  explicit TemporaryFile(const std::filesystem::path& target);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Where the new file is, for renaming it to its target.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Open for reading and writing, at the beginning.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// The file has got its own name, or is no longer wanted under this one.
  void keep() noexcept { kept_ = true; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool kept_ = false;
};

}  // namespace panonav
