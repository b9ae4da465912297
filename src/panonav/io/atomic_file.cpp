#include "panonav/io/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

std::string cause() {
  return std::generic_category().message(errno);
}

// A file descriptor that is closed on every way out.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const noexcept { return number_; }
  [[nodiscard]] bool close() {
    const int number = number_;
    number_ = -1;
    return ::close(number) == 0;
  }

 private:
  int number_;
};

// Removes the temporary file unless it has got its name.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path) : path_(std::move(path)) {}
  ~TemporaryFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  void keep() { path_.clear(); }

 private:
  fs::path path_;
};

void write_all(int descriptor, std::span<const std::uint8_t> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw FileError(path.string(), "cannot be written: " + cause());
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

// Where the bytes must end up: behind all symbolic links.
fs::path behind_links(const fs::path& path) {
  std::error_code code;
  if (!fs::is_symlink(fs::symlink_status(path, code))) return path;
  const fs::path target = fs::weakly_canonical(path, code);
  if (code) throw FileError(path.string(), "cannot be written: " + code.message());
  return target;
}

fs::path temporary_name(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  std::string name(1, '.');
  name += path.filename().string() + "." + std::to_string(::getpid()) + "." +
          std::to_string(counter++) + ".tmp";
  return path.parent_path() / name;
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
    if (file.number() < 0) throw FileError(path.string(), "cannot be written: " + cause());
    write_all(file.number(), bytes, path);
    return;
  }

  const fs::path target = behind_links(path);
  const fs::path temporary = temporary_name(target);
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) throw FileError(path.string(), "cannot be written: " + cause());
  TemporaryFile guard(temporary);
  if (exists && ::fchmod(file.number(), status.st_mode & 07777) != 0) {
    throw FileError(path.string(), "cannot be written: " + cause());
  }
  write_all(file.number(), bytes, path);
  if (::fsync(file.number()) != 0 || !file.close() ||
      ::rename(temporary.c_str(), target.c_str()) != 0) {
    throw FileError(path.string(), "cannot be written: " + cause());
  }
  guard.keep();
}

void write_file(const fs::path& path, std::string_view text) {
  write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

std::vector<std::uint8_t> read_file(const fs::path& path, std::size_t limit_bytes) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) throw FileError(path.string(), "cannot be read: " + cause());
  struct stat status {};
  if (::fstat(file.number(), &status) != 0) {
    throw FileError(path.string(), "cannot be read: " + cause());
  }
  if (S_ISDIR(status.st_mode)) throw FileError(path.string(), "is a folder; allowed: a file");

  // The size that the system reports is a first guess only: pipes have none and files may grow.
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
      throw FileError(path.string(), "cannot be read: " + cause());
    }
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

}  // namespace panonav
