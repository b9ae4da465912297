#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// The point where the line of sight in one direction crosses the recorded path.
struct RouteCrossing {
  float along = -1.0F;      ///< index of the line, with its fraction; below 0: none
  float distance_m = 0.0F;  ///< from the viewpoint, positive ahead of it and negative behind
  float along_by_x = 0.0F;  ///< change of `along` with the viewpoint, per metre
  float along_by_y = 0.0F;  ///< the same along y
};

/// A direction in the plane, of unit length.
struct Direction2 {
  double x = 1.0;  ///< along the x axis
  double y = 0.0;  ///< along the y axis
};

/// Returns `count` directions, equally spaced from the x axis counter-clockwise.
[[nodiscard]] std::vector<Direction2> equal_directions(std::size_t count);

/// Finds for each of `directions`, which must be those of `equal_directions`, where the line of
/// sight through `viewpoint` crosses the path next to it [Y03 eq. 5, for paths of any shape]. The
/// image recorded at a crossing shows the line of sight; at the nearest crossing the fewest objects
/// are in between. `path`: poses of the lines from `first` on. Throws nothing. Cost:
/// O(path + directions).
void find_crossings(std::span<const Pose2> path, std::size_t first, Point2 viewpoint,
                    std::span<const Direction2> directions, std::span<RouteCrossing> crossings);

/// Successive lines of a route that are in reach of a position.
struct LineWindow {
  std::size_t begin = 0;  ///< number of the first line
  std::size_t end = 0;    ///< number of the line after the last one
  double reach_m = 0.0;   ///< no line is farther away
};

/// A path in a grid of cells, so that a line of sight is compared with the segments near it only.
/// Immutable; several threads may use one.
class PathIndex {
 public:
  /// Copies the positions of a path. Memory: some 100 bytes a pose. Throws nothing.
  explicit PathIndex(std::span<const Pose2> path);

  /// Returns the poses nearer than `reach_m` around the one nearest to the position, without a gap
  /// along the path; nullopt if there are fewer than two. Cost: O(path / 16).
  [[nodiscard]] std::optional<LineWindow> find_window(Point2 position, double reach_m) const;

  /// Finds the crossings with the lines of a window as the function `find_crossings`; where two
  /// segments meet, the derivatives may be those of the other one. Throws nothing. Cost: for each
  /// direction the cells up to the nearest crossing.
  void find_crossings(const LineWindow& window, Point2 viewpoint,
                      std::span<const Direction2> directions,
                      std::span<RouteCrossing> crossings) const;

 private:
  static constexpr std::size_t poses_per_block = 16;
  /// Bounds of successive poses, or of the whole path.
  struct Box {
    Point2 low;
    Point2 high;
    void add(Point2 point);
    [[nodiscard]] double min_distance(Point2 position) const;
    [[nodiscard]] double max_distance(Point2 position) const;
  };
  /// Column and row of a cell.
  struct Cell {
    int x = 0;
    int y = 0;
  };
  struct Nearest;
  [[nodiscard]] std::size_t find_nearest(Point2 position) const;
  [[nodiscard]] Cell find_cell(Point2 position) const;
  void set_cells();
  template <class Visit>
  void visit_cells_of_segment(std::size_t segment, const Visit& visit) const;
  void search_along(const LineWindow& window, Point2 viewpoint, Direction2 direction, double sign,
                    Nearest& nearest) const;

  std::vector<Point2> points_;
  std::vector<Box> blocks_;
  Box bounds_;
  double cell_m_ = 1.0;
  int columns_ = 1;
  int rows_ = 1;
  std::vector<std::uint32_t> cell_begin_;  // of each cell in `segments_`, and the end
  std::vector<std::uint32_t> segments_;
};

}  // namespace panonav
