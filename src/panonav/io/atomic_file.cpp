#include "panonav/io/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

std::string last_error_text() {
  return std::generic_category().message(errno);
}

// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const noexcept { return number_; }

 private:
  int number_;
};

void write_all(int descriptor, std::span<const std::uint8_t> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw FileError(path.string(), "cannot be written: " + last_error_text());
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

// Returns the file that a symbolic link points to in the end; `path` itself if it is no link.
fs::path resolve_links(const fs::path& path) {
  std::error_code code;
  if (!fs::is_symlink(fs::symlink_status(path, code))) return path;
  const fs::path target = fs::weakly_canonical(path, code);
  if (code) throw FileError(path.string(), "cannot be written: " + code.message());
  return target;
}

}  // namespace

void write_file(const fs::path& path, std::span<const std::uint8_t> bytes) {
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    throw FileError(path.string(), "cannot be written: it is a folder");
  }
  if (exists && !S_ISREG(status.st_mode)) {
    Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (file.number() < 0)
      throw FileError(path.string(), "cannot be written: " + last_error_text());
    write_all(file.number(), bytes, path);
    return;
  }

  const fs::path target = resolve_links(path);
  TemporaryFile file(target);
  if (exists && ::fchmod(file.descriptor(), status.st_mode & 07777) != 0) {
    throw FileError(path.string(), "cannot be written: " + last_error_text());
  }
  write_all(file.descriptor(), bytes, path);
  if (::fsync(file.descriptor()) != 0 || ::rename(file.path().c_str(), target.c_str()) != 0) {
    throw FileError(path.string(), "cannot be written: " + last_error_text());
  }
  file.keep();
}

void write_file(const fs::path& path, std::string_view text) {
  write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::vector<std::uint8_t> read_file(const fs::path& path, std::size_t limit_bytes) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) throw FileError(path.string(), "cannot be read: " + last_error_text());
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) {
    throw FileError(path.string(), "cannot be read: " + last_error_text());
  }
  if (S_ISDIR(status.st_mode)) throw FileError(path.string(), "is a folder; allowed: a file");

  // The size that the system reports is only a first guess, because pipes have none and files may
  // grow.
  std::vector<std::uint8_t> bytes;
  std::size_t filled = 0;
  const auto guess = static_cast<std::size_t>(status.st_size > 0 ? status.st_size : 0);
  while (true) {
    if (filled > limit_bytes || guess > limit_bytes) {
      throw FileError(path.string(), "is " + std::to_string(std::max(filled, guess)) +
                                         " bytes or more; allowed: up to " +
                                         std::to_string(limit_bytes) + " bytes");
    }
    if (filled == bytes.size()) bytes.resize(std::max(guess + 1, 2 * filled + 4096));
    const ssize_t got = ::read(file.number(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0) {
      if (errno == EINTR) continue;
      throw FileError(path.string(), "cannot be read: " + last_error_text());
    }
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

}  // namespace panonav
