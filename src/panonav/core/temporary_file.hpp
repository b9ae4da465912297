#pragma once

#include <filesystem>

namespace panonav {

/// Throws FileError if `path` is, also through links, an SQLite file, such as a visual memory,
/// which no output file should replace. Cost: reads the first 16 bytes.
void require_no_database(const std::filesystem::path& path);

/// A new empty file that will be renamed to `target`, in the same folder: ".NAME.tmp", which
/// replaces the abandoned file of a dead process, or ".NAME.<16 random digits>.tmp" while another
/// process uses that name. The file is locked during the object's lifetime, so that no process
/// takes it for abandoned, and the destructor removes it unless `keep` was called. The constructor
/// throws FileError if the file cannot be written or `target` is a database.
class TemporaryFile {
 public:
  /// Creates the file, with permissions 0666 reduced by the process's umask.
  explicit TemporaryFile(const std::filesystem::path& target);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Path of the new file, for renaming it to its target.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// File descriptor, open for reading and writing at the beginning.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// Prevents the removal of the file; call it after renaming.
  void keep() noexcept { kept_ = true; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool kept_ = false;
};

}  // namespace panonav
