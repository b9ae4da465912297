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

#include "panonav/pipeline/memory_map.hpp"
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
  /// True if the memory was changed since the last call. For a memory on a server that could not be
  /// reached, also true once it can be reached again.
  [[nodiscard]] bool has_changed();

 private:
  /// Modification times and sizes of an SQLite file and of its write-ahead log.
  using FileState = std::array<std::pair<std::filesystem::file_time_type, std::uintmax_t>, 2>;
  [[nodiscard]] static FileState read_state(const std::filesystem::path& path);

  std::filesystem::path memory_;
  FileState state_;
  std::shared_ptr<const MemoryScheme> scheme_;  // null for a memory file
  std::function<bool()> poll_changes_;          // empty while the server cannot be reached
};

/// A loaded memory: held in this process, or searched on its server.
struct LoadedMemory {
  LoadedMemory(const std::filesystem::path& memory, const LocalisationServerOptions& options);

  /// Returns the thumbnail of a view; `nullopt` if it has none. Reopens the memory if its server
  /// could not be reached. Any thread may call.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> thumbnail(const std::string& view);

  std::filesystem::path path;
  bool is_on_server;
  SignatureShape shape;
  LengthUnit unit;  ///< of all positions
  PlaceRecogniser recogniser;

 private:
  std::mutex mutex_;  // guards `file_`
  MemoryFile file_;
};

/// A served memory; `loaded` is replaced when the file changes.
struct Served {
  ServedMemory memory;
  std::optional<MemoryWatch> watch;
  std::shared_ptr<LoadedMemory> loaded;
  bool is_lost = false;  ///< reported that it cannot be read
  /// Time at which a request last failed because the memory could not be read.
  std::chrono::steady_clock::time_point failed{};
  std::uint64_t known = 0;
  std::uint64_t unknown = 0;
  std::uint64_t reloads = 0;
  std::uint64_t failed_reloads = 0;
};

/// Returns the metrics of all memories as text, by their names: views, reloads, and counts of
/// searches on servers.
[[nodiscard]] std::string describe_memories(const std::map<std::string, Served>& served);

}  // namespace panonav::server
