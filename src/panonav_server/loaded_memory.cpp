#include "panonav_server/loaded_memory.hpp"

#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav::server {

MemoryWatch::MemoryWatch(std::filesystem::path memory)
    : memory_(std::move(memory)),
      state_(read_state(memory_)),
      scheme_(find_memory_scheme(memory_)),
      poll_changes_(scheme_ ? scheme_->listen(memory_) : nullptr) {}

MemoryWatch::FileState MemoryWatch::read_state(const std::filesystem::path& path) {
  FileState state;
  const std::array files{path, std::filesystem::path(path.native() + "-wal")};
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::error_code missing;
    const auto size = std::filesystem::file_size(files[i], missing);
    if (missing || size == 0) continue;  // who opens a file makes it an empty log
    const auto written = std::filesystem::last_write_time(files[i], missing);
    if (!missing) state[i] = {written, size};
  }
  return state;
}

bool MemoryWatch::has_changed() {
  if (!scheme_) {
    const FileState before = std::exchange(state_, read_state(memory_));
    return state_ != before;
  }
  try {
    const bool was_away = !poll_changes_;
    if (was_away) poll_changes_ = scheme_->listen(memory_);
    return poll_changes_() || was_away;
  } catch (const FileError&) {
    poll_changes_ = nullptr;
    return false;
  }
}

LoadedMemory::LoadedMemory(const std::filesystem::path& memory,
                           const LocalisationServerOptions& options)
    : path(memory),
      file(MemoryFile::open(path, Access::read_only)),
      recogniser(path, {.localiser = options.localiser, .max_held_views = options.max_held_views}) {
}

std::optional<std::vector<std::uint8_t>> LoadedMemory::thumbnail(const std::string& view) {
  const auto read = [&]() -> std::optional<std::vector<std::uint8_t>> {
    const auto id = view.empty() ? std::nullopt : file.find(view);
    return id ? file.thumbnail(*id) : std::nullopt;
  };
  try {
    return read();
  } catch (const FileError&) {
    if (recogniser.is_held()) throw;
  }
  file = MemoryFile::open(path, Access::read_only);
  return read();
}

}  // namespace panonav::server
