#pragma once

#include <chrono>
#include <compare>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace panonav::fleet {

/// A square of 10 m of the floor of a memory; area (0, 0) is between the origin and (10 m, 10 m).
struct MemoryArea {
  double column = 0.0;  ///< whole number, along x
  double row = 0.0;     ///< whole number, along y
  friend auto operator<=>(const MemoryArea&, const MemoryArea&) = default;
};
/// Side of an area.
inline constexpr double memory_area_side_m = 10.0;

/// Returns the area of a position.
[[nodiscard]] MemoryArea to_memory_area(double x_m, double y_m);

/// A change that any client made in a memory on a server.
struct MemoryChange {
  /// Areas in which views were added, removed or changed. Empty: many areas, or another change,
  /// such as one of views without a position.
  std::vector<MemoryArea> areas;
  friend bool operator==(const MemoryChange&, const MemoryChange&) = default;
};

/// Waits for changes that any client makes to a memory on a server, through its own connection.
class MemoryChanges {
 public:
  /// Starts to listen; every later change is reported. Throws FileError as `MemoryFile::open`, and
  /// for the path of a memory file.
  explicit MemoryChanges(const std::filesystem::path& memory);
  ~MemoryChanges();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryChanges(MemoryChanges&&) noexcept;
  MemoryChanges& operator=(MemoryChanges&&) noexcept;

  /// Returns the next change once its transaction is on the server's disk; nullopt if there was
  /// none within `timeout`. Throws FileError if the connection is lost, because changes may then be
  /// missed.
  [[nodiscard]] std::optional<MemoryChange> wait(std::chrono::milliseconds timeout);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet
