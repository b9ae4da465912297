#include "cli/outputs.hpp"

#include <sys/stat.h>

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "cli/arguments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// Device and inode, which are the same for all names of a file.
using FileId = std::pair<dev_t, ino_t>;

struct FoundFile {
  FileId id;
  mode_t mode = 0;
};

/// Returns id and type of the file; nullopt if there is none.
std::optional<FoundFile> find_file(const fs::path& path) {
  struct stat status {};
  if (path.empty() || ::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FoundFile{{status.st_dev, status.st_ino}, status.st_mode};
}

bool is_file(const fs::path& path, const FileId& id) {
  const auto found = find_file(path);
  return found && found->id == id;
}

/// True if the file is in the folder or one below it. Follows links, but visits each folder once.
bool is_in_folder(const fs::path& folder, const FileId& id, std::set<FileId>& visited) {
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const auto found = find_file(entry->path());
    if (!found) continue;
    if (found->id == id) return true;
    if (S_ISDIR(found->mode) && visited.insert(found->id).second &&
        is_in_folder(entry->path(), id, visited)) {
      return true;
    }
  }
  return false;
}

/// True if the TOML file at `path` contains the file's path in quotation marks, as a camera file
/// names its mask.
bool is_named_by_toml(const fs::path& path, const FileId& id) {
  constexpr std::size_t max_bytes = 1U << 20U;
  std::string text;
  try {
    const auto bytes = read_file(path, max_bytes);
    text.assign(bytes.begin(), bytes.end());
  } catch (const FileError&) {
    return false;  // the reader of the file reports the error
  }
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\"'\n", begin), text.size());
    if (begin < end && is_file(path.parent_path() / text.substr(begin, end - begin), id)) {
      return true;
    }
    begin = end + 1;
  }
  return false;
}

bool refers_to_file(const std::string& value, const FileId& id, bool is_page) {
  // Also checks the part after '=', as serve takes "NAME=MEMORY".
  for (const std::string& path : {value, value.substr(value.find('=') + 1)}) {
    const auto found = find_file(path);
    if (!found) continue;
    if (found->id == id) return true;
    if (S_ISDIR(found->mode)) {
      if (is_page) continue;  // recordings contain no index.html
      std::set<FileId> visited{found->id};
      if (is_in_folder(path, id, visited)) return true;
      continue;
    }
    for (const char* suffix : {"-wal", "-shm", "-journal"}) {
      if (is_file(path + suffix, id)) return true;
    }
    if (path.ends_with(".toml") && is_named_by_toml(path, id)) return true;
  }
  return false;
}

/// Returns when the regular file was last written; nullopt if there is none.
std::optional<fs::file_time_type> find_write_time(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  const auto written = fs::last_write_time(path, error);
  return error ? std::nullopt : std::optional(written);
}

}  // namespace

EarlierOutputs require_separate_outputs(std::span<const NamedValue> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!values[i].is_output) continue;
    fs::path path = values[i].value;
    auto found = find_file(path);
    // A report replaces only the page in its folder; other verbs require an empty folder.
    const bool is_page = found && S_ISDIR(found->mode);
    if (is_page) found = find_file(path /= "index.html");
    const bool exists = found && S_ISREG(found->mode);
    if (found && !exists) continue;  // a pipe or device is not overwritten
    for (std::size_t j = 0; j < values.size(); ++j) {
      const NamedValue& other = values[j];
      const bool is_same_name =
          j < i && other.is_output &&
          fs::path(other.value).lexically_normal() == fs::path(values[i].value).lexically_normal();
      const bool is_same_file = exists && i != j &&
                                (other.is_output ? is_file(other.value, found->id)
                                                 : refers_to_file(other.value, found->id, is_page));
      if (is_same_name || is_same_file) {
        throw UsageError(values[i].name + " is " + path.string() + ", which " + other.name + " " +
                         other.value + (other.is_output ? " writes" : " reads") +
                         "; allowed: another file");
      }
    }
  }
  EarlierOutputs earlier;
  for (const NamedValue& one : values) {
    if (one.is_output) earlier.add(one.value);
  }
  return earlier;
}

void EarlierOutputs::add(const fs::path& output) {
  for (const fs::path& file : {output, output / "index.html", output / "gallery.html"}) {
    if (const auto written = find_write_time(file)) files_.push_back({file.string(), *written});
  }
}

std::vector<std::string> EarlierOutputs::list_replaced() const {
  std::vector<std::string> replaced;
  for (const auto& [path, written] : files_) {
    const auto now = find_write_time(path);
    if (now && *now != written) replaced.push_back(path);
  }
  return replaced;
}

}  // namespace panonav::command
