#include "panonav/core/temporary_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <random>
#include <string>
#include <string_view>
#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

std::string random_digits() {
  std::random_device device;
  std::string text;
  for (int i = 0; i < 16; ++i) text += "0123456789abcdef"[device() & 15U];
  return text;
}

int create_exclusively(const fs::path& path) {
  return ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

// Locks the file; false if another process holds the lock, or `path` no longer names this file: a
// finished process renames its file before it unlocks it.
bool lock_if_current(int descriptor, const fs::path& path) {
  struct stat file {};
  struct stat named {};
  return ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && ::fstat(descriptor, &file) == 0 &&
         ::lstat(path.c_str(), &named) == 0 && file.st_ino == named.st_ino &&
         file.st_dev == named.st_dev && S_ISREG(file.st_mode) && file.st_uid == ::geteuid();
}

void remove_if_abandoned(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  if (lock_if_current(descriptor, path)) ::unlink(path.c_str());
  ::close(descriptor);
}

}  // namespace

void require_no_database(const fs::path& path) {
  // First 16 bytes of every SQLite 3 file (sqlite.org/fileformat), including the final zero.
  constexpr std::string_view magic("SQLite format 3\0", 16);
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  struct stat status {};
  std::array<char, magic.size()> begin{};
  const bool is_database =
      ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
      ::pread(descriptor, begin.data(), begin.size(), 0) == static_cast<ssize_t>(begin.size()) &&
      std::string_view(begin.data(), begin.size()) == magic;
  ::close(descriptor);
  if (is_database) {
    throw FileError(path.string(),
                    "is a memory or another SQLite file, which is not replaced; allowed: another "
                    "name, or remove that file first");
  }
}

TemporaryFile::TemporaryFile(const fs::path& target) {
  require_no_database(target);
  // Names may have 255 bytes.
  constexpr std::size_t max_name_bytes = 200;
  const std::string stem = "." + target.filename().string().substr(0, max_name_bytes) + ".";
  path_ = target.parent_path() / (stem + "tmp");
  descriptor_ = create_exclusively(path_);
  if (descriptor_ < 0 && errno == EEXIST) {
    remove_if_abandoned(path_);
    descriptor_ = create_exclusively(path_);
  }
  if (descriptor_ >= 0 && lock_if_current(descriptor_, path_)) return;
  // The name is in use, or the file system has no locks.
  if (descriptor_ >= 0) ::close(descriptor_);
  path_ = target.parent_path() / (stem + random_digits() + ".tmp");
  descriptor_ = create_exclusively(path_);
  if (descriptor_ < 0) {
    throw FileError(target.string(),
                    "cannot be written: " + std::generic_category().message(errno));
  }
}

TemporaryFile::~TemporaryFile() {
  if (!kept_) ::unlink(path_.c_str());
  ::close(descriptor_);
}

}  // namespace panonav
