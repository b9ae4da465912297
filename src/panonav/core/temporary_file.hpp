#pragma once

#include <filesystem>

namespace panonav {

/// Throws FileError where `path` is, also through links, an SQLite file, such as a memory: it is
/// never what an output was meant to replace. Costs a look at the file's first bytes.
void require_no_database(const std::filesystem::path& path);

/// A new empty file that is to become `target`, in the same folder: ".NAME.tmp", which replaces the
/// one of a dead process, or ".NAME.<16 random digits>.tmp" while another process uses that name.
/// It is locked as long as the object lives, so that no process takes it for an abandoned one, and
/// is removed with the object unless `keep` was called. Throws FileError on `target`, also as
/// `require_no_database` does.
class TemporaryFile {
 public:
  /// Creates the file at once, with the permissions that the process's umask leaves.
  explicit TemporaryFile(const std::filesystem::path& target);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Path of the new file, for renaming it to its target.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Open for reading and writing, at the beginning.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// Keeps the file, as after it was renamed.
  void keep() noexcept { kept_ = true; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool kept_ = false;
};

}  // namespace panonav
