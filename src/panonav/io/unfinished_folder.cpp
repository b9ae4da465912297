#include "panonav/io/unfinished_folder.hpp"

#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

fs::path resolve_free_target(const fs::path& target) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(target, error)) &&
      (!fs::is_directory(target, error) || !fs::is_empty(target, error))) {
    throw FileError(target.string(), "already exists and is not empty; allowed: a new folder");
  }
  fs::path resolved = fs::weakly_canonical(fs::absolute(target), error);
  if (error) throw FileError(target.string(), "cannot be created: " + error.message());
  return resolved.has_filename() ? resolved : resolved.parent_path();
}

}  // namespace

UnfinishedFolder::UnfinishedFolder(const fs::path& target) : target_(resolve_free_target(target)) {
  std::error_code error;
  for (fs::path parent = target_.parent_path(); !parent.empty() && !fs::exists(parent, error);
       parent = parent.parent_path()) {
    new_parents_.push_back(parent);
  }
  fs::create_directories(target_.parent_path(), error);
  if (error) throw FileError(target.string(), "cannot be created: " + error.message());
  mark_.emplace(target_);
  path_ = mark_->path().string() + ".d";
  fs::remove_all(path_, error);  // left by a killed process; no living one uses it
  if (!fs::create_directory(path_, error)) {
    throw FileError(target.string(), "cannot be created: " + error.message());
  }
}

UnfinishedFolder::~UnfinishedFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  mark_.reset();
  for (const fs::path& parent : new_parents_) fs::remove(parent, ignored);  // only if empty
}

void UnfinishedFolder::finish() {
  std::error_code error;
  fs::rename(path_, target_, error);
  if (error) throw FileError(target_.string(), "cannot be created: " + error.message());
}

}  // namespace panonav
