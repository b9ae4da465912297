#include "panonav/io/unfinished_folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

std::error_code last_error() {
  return {errno, std::generic_category()};
}

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

void UnfinishedFolder::append(const fs::path& name, std::span<const std::uint8_t> bytes) const {
  const fs::path path = path_ / name;
  std::error_code error;
  if (name.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const int file =
      error ? -1 : ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (!error && file < 0) error = last_error();
  while (!error && !bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      error = last_error();
    }
  }
  // Some file systems report only now that a file could not be written.
  if (file >= 0 && ::close(file) != 0 && !error) error = last_error();
  if (error) throw FileError((target_ / name).string(), "cannot be written: " + error.message());
}

void UnfinishedFolder::finish() {
  std::error_code error;
  const int folder = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0 || ::syncfs(folder) != 0) error = last_error();
  if (folder >= 0) ::close(folder);
  if (error) throw FileError(target_.string(), "cannot be written: " + error.message());
  fs::rename(path_, target_, error);
  if (error) throw FileError(target_.string(), "cannot be created: " + error.message());
}

}  // namespace panonav
