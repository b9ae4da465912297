#pragma once

#include <filesystem>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"

namespace panonav {

/// A folder that gets its name when it is whole, and is gone if it never is.
class UnfinishedFolder {
 public:
  explicit UnfinishedFolder(const std::filesystem::path& wanted) : target_(behind_links(wanted)) {
    std::error_code error;
    std::filesystem::create_directories(target_.parent_path(), error);
    if (error) throw FileError(wanted.string(), "cannot be made: " + error.message());
    mark_.emplace(target_);
    path_ = mark_->path().string() + ".d";
    std::filesystem::remove_all(path_,
                                error);  // of a process that was killed: the mark's name was free
    if (!std::filesystem::create_directory(path_, error)) {
      throw FileError(wanted.string(), "cannot be made: " + error.message());
    }
  }
  ~UnfinishedFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  void finish() {
    std::error_code error;
    std::filesystem::rename(path_, target_, error);
    if (error) throw FileError(target_.string(), "cannot be made: " + error.message());
  }

 private:
  static std::filesystem::path behind_links(const std::filesystem::path& wanted) {
    std::error_code error;
    if (std::filesystem::exists(std::filesystem::symlink_status(wanted, error)) &&
        (!std::filesystem::is_directory(wanted, error) ||
         !std::filesystem::is_empty(wanted, error))) {
      throw FileError(wanted.string(), "is there already and not empty; allowed: a new folder");
    }
    std::filesystem::path target =
        std::filesystem::weakly_canonical(std::filesystem::absolute(wanted), error);
    if (error) throw FileError(wanted.string(), "cannot be made: " + error.message());
    return target.has_filename() ? target : target.parent_path();
  }

  std::filesystem::path target_;
  std::filesystem::path path_;
  std::optional<TemporaryFile> mark_;  // tells living processes apart
};

}  // namespace panonav
