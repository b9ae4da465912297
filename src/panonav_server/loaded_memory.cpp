#include "panonav_server/loaded_memory.hpp"

#include <system_error>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_server/metrics.hpp"

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
    if (missing || size == 0) continue;  // opening a file can create an empty log
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
      is_on_server(is_server_address(memory)),
      recogniser(path, {.localiser = options.localiser, .max_held_views = options.max_held_views}),
      file_(MemoryFile::open(path, Access::read_only)) {
  shape = file_.header().shape;
  unit = read_length_unit(file_);
}

std::optional<std::vector<std::uint8_t>> LoadedMemory::thumbnail(const std::string& view) {
  const std::lock_guard lock(mutex_);
  const auto read = [&]() -> std::optional<std::vector<std::uint8_t>> {
    const auto id = view.empty() ? std::nullopt : file_.find(view);
    return id ? file_.thumbnail(*id) : std::nullopt;
  };
  try {
    return read();
  } catch (const FileError&) {
    if (!is_on_server) throw;
  }
  file_ = MemoryFile::open(path, Access::read_only);
  return read();
}

std::string describe_memories(const std::map<std::string, Served>& served) {
  std::string text = describe_metric("panonav_memory_views", "gauge", "Views of a memory.");
  for (const auto& [name, one] : served) {
    text += "panonav_memory_views{memory=\"" + name + "\"} " +
            std::to_string(one.loaded->recogniser.size()) + "\n";
  }
  const auto add_search_metric = [&](const std::string& name, const std::string& type,
                                     const std::string& help, const auto& value) {
    std::string lines;
    for (const auto& [memory, one] : served) {
      if (one.loaded->recogniser.is_memory_held()) continue;
      lines += name + "{memory=\"" + memory + "\"} " + value(one.loaded->recogniser) + "\n";
    }
    if (!lines.empty()) text += describe_metric(name, type, help) + lines;
  };
  add_search_metric("panonav_sketch_bytes", "gauge", "Bytes of sketches of a memory.",
                    [](const PlaceRecogniser& of) { return std::to_string(of.index_bytes()); });
  add_search_metric(
      "panonav_searches_total", "counter", "Exact searches in a memory on its server.",
      [](const PlaceRecogniser& of) { return std::to_string(of.search_counters().searches); });
  add_search_metric(
      "panonav_search_views_read_total", "counter", "Views that searches read in full.",
      [](const PlaceRecogniser& of) { return std::to_string(of.search_counters().views_read); });
  add_search_metric(
      "panonav_search_seconds_total", "counter", "Time that searches took.",
      [](const PlaceRecogniser& of) { return to_text(of.search_counters().seconds); });
  text += describe_metric("panonav_memory_reloads_total", "counter",
                          "Times that a changed memory file was read again, by result.");
  for (const auto& [name, one] : served) {
    const std::string memory = "panonav_memory_reloads_total{memory=\"" + name + "\",result=\"";
    text += memory + "done\"} " + std::to_string(one.reloads) + "\n";
    text += memory + "failed\"} " + std::to_string(one.failed_reloads) + "\n";
  }
  return text;
}

}  // namespace panonav::server
