#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_scheme.hpp"
#include "panonav_server/localisation_server.hpp"

namespace panonav::server {

/// Notices when a memory was changed.
class MemoryWatch {
 public:
  /// Begins with the present state of the memory.
  explicit MemoryWatch(std::filesystem::path memory);
  /// True if the memory was changed since the last call. Of a server that could not be reached,
  /// also true once it is back.
  [[nodiscard]] bool has_changed();

 private:
  /// Times of change and sizes of an SQLite file and of its log.
  using FileState = std::array<std::pair<std::filesystem::file_time_type, std::uintmax_t>, 2>;
  [[nodiscard]] static FileState read_state(const std::filesystem::path& path);

  std::filesystem::path memory_;
  FileState state_;
  std::shared_ptr<const MemoryScheme> scheme_;  // null: a file
  std::function<bool()> poll_changes_;          // empty while what keeps the memory is away
};

/// A loaded memory: held, or searched on its server.
struct LoadedMemory {
  LoadedMemory(const std::filesystem::path& memory, const LocalisationServerOptions& options);

  /// Returns the picture of a view, `nullopt` if it has none. Opens the memory again if its server
  /// was away. Any thread may call.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> thumbnail(const std::string& view);

  std::filesystem::path path;
  bool is_on_server;
  SignatureShape shape;
  PlaceRecogniser recogniser;

 private:
  std::mutex mutex_;  // of the file
  MemoryFile file_;
};

/// A memory that is served; what was loaded is swapped when the file changes.
struct Served {
  ServedMemory memory;
  std::optional<MemoryWatch> watch;
  std::shared_ptr<LoadedMemory> loaded;
  bool is_lost = false;  ///< it was noted that the memory cannot be read
  /// When a request failed the last time because the memory could not be read.
  std::chrono::steady_clock::time_point failed{};
  std::uint64_t known = 0;
  std::uint64_t unknown = 0;
  std::uint64_t reloads = 0;
  std::uint64_t failed_reloads = 0;
};

/// Returns the metrics of memories, by their names: views, reloads, and searches of those that are
/// searched on their server.
[[nodiscard]] std::string describe_memories(const std::map<std::string, Served>& served);

}  // namespace panonav::server
