#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Returns the floor of a view, each of which has its own frame of positions. The name of a view
/// begins with the folder of its floor: "floor=ground/view_3.png" is on the floor "ground". All
/// other views are on the floor without a name (empty).
[[nodiscard]] std::string_view floor_of(std::string_view view_name) noexcept;

/// True if two views of the memory are on one floor.
[[nodiscard]] bool are_on_one_floor(const VisualMemory& memory, ViewId a, ViewId b);

/// Returns the name of a view on this floor: `name` itself if `floor` is empty. Throws
/// ContractError as `require_floor`.
[[nodiscard]] std::string make_name_on_floor(std::string_view floor, std::string_view name);

/// Returns the name with a prefix that keeps the floor: "floor=ground/red/view_3.png".
[[nodiscard]] std::string add_prefix_on_floor(std::string_view prefix, std::string_view name);

/// Throws ContractError unless `floor` can be the name of a floor: at most 200 bytes, no slash and
/// no control characters; empty is allowed.
void require_floor(std::string_view floor);

/// Returns the floors of the views, each once, ascending; only the empty one if none has a name.
[[nodiscard]] std::vector<std::string> list_floors(const VisualMemory& memory);

/// A position in the frame of a floor.
struct FloorPosition {
  Point2 point;            ///< in the floor's frame
  std::string_view floor;  ///< belongs to the name of the view
  friend bool operator==(const FloorPosition&, const FloorPosition&) = default;
};
/// Computes the distance; infinite between two floors.
[[nodiscard]] double distance(const FloorPosition& a, const FloorPosition& b) noexcept;
/// Returns position and floor of a view; nullopt if it has no position.
[[nodiscard]] std::optional<FloorPosition> find_position(const ReferenceInfo& info) noexcept;

/// Lays floors apart in one plane, for methods that compare positions of all views: views on two
/// floors are farther from each other there than any two on one floor that are related. Positions
/// on the floor without a name are the same in the plane.
class FloorPlane {
 public:
  /// Returns the position in the plane. A floor that is new gets the next place.
  [[nodiscard]] Point2 to_plane(const FloorPosition& position);
  /// Returns the position on its floor; its `floor` belongs to *this.
  [[nodiscard]] FloorPosition to_floor(Point2 in_plane) const;
  /// False if all positions are on the floor without a name, and so the same in the plane.
  [[nodiscard]] bool has_named_floor() const noexcept { return floors_.size() > 1; }

 private:
  std::vector<std::string> floors_{""};
};
/// Returns the plane in which the posed views of the memory were laid in ascending order.
[[nodiscard]] FloorPlane make_floor_plane(const VisualMemory& memory);

}  // namespace panonav
