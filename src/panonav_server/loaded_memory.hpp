#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
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
  /// Begins with the memory as it is now.
  explicit MemoryWatch(std::filesystem::path memory);
  /// True if the memory was changed since the last call. A server that cannot be reached may have
  /// changed it once it is back.
  [[nodiscard]] bool has_changed();

 private:
  /// Times and sizes of a file as it was last written, and of its log, of an SQLite file.
  using FileState = std::array<std::pair<std::filesystem::file_time_type, std::uintmax_t>, 2>;
  [[nodiscard]] static FileState read_state(const std::filesystem::path& path);

  std::filesystem::path memory_;
  FileState state_;
  std::shared_ptr<const MemoryScheme> scheme_;  // null: a file
  std::function<bool()> poll_changes_;          // empty while what keeps the memory is away
};

/// A memory as it was read: held, or searched where it lies.
struct LoadedMemory {
  LoadedMemory(const std::filesystem::path& memory, const LocalisationServerOptions& options);

  /// Returns the picture of a view, `nullopt` where it has none. Opens the file again where its
  /// server was away.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> thumbnail(const std::string& view);

  std::filesystem::path path;
  MemoryFile file;  // of the thread that speaks HTTP, once it is there
  PlaceRecogniser recogniser;
};

}  // namespace panonav::server
