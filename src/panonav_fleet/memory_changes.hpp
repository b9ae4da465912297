#pragma once

#include <chrono>
#include <compare>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace panonav::fleet {

/// A square of 10 m of a memory's map: column and row count from the origin; (0, 0) is between the
/// origin and (10 m, 10 m).
struct MemoryArea {
  double column = 0.0;  ///< whole number, along x
  double row = 0.0;     ///< whole number, along y
  friend auto operator<=>(const MemoryArea&, const MemoryArea&) = default;
};
/// Side of an area.
inline constexpr double memory_area_side_m = 10.0;

/// Returns the area of a position.
[[nodiscard]] MemoryArea to_memory_area(double x_m, double y_m);

/// A change that somebody made in a memory on a server.
struct MemoryChange {
  /// Areas in which views were added, removed or changed; empty: something else changed, such as
  /// views without a position, or many areas.
  std::vector<MemoryArea> areas;
  friend bool operator==(const MemoryChange&, const MemoryChange&) = default;
};

/// Waits for changes that anybody makes to a memory on a server. Holds a connection of its own.
class MemoryChanges {
 public:
  /// Begins to listen: no later change is missed. Throws FileError as `MemoryFile::open`, and for
  /// the path of a memory file.
  explicit MemoryChanges(const std::filesystem::path& memory);
  ~MemoryChanges();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryChanges(MemoryChanges&&) noexcept;
  MemoryChanges& operator=(MemoryChanges&&) noexcept;

  /// Returns the next change, as soon as its transaction is on the server's disk; empty when there
  /// was none within `timeout`. Throws FileError when the connection is lost: changes may then be
  /// missed.
  [[nodiscard]] std::optional<MemoryChange> wait(std::chrono::milliseconds timeout);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet
