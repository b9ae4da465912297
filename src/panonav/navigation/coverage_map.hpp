#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Observations of the floor by an exploring robot, in one frame.
struct FloorObservations {
  /// A straight line on the floor.
  struct Line {
    Point2 from;  ///< its start
    Point2 to;    ///< its end
  };
  /// A memorised view.
  struct View {
    Point2 position;        ///< position of the robot
    double radius_m = 0.0;  ///< radius of its catchment area
  };
  /// A position from which the robot recognised none of the views in whose catchment areas it was.
  struct Unrecognised {
    Point2 position;             ///< of the robot
    std::size_t view_count = 0;  ///< number of views at that time
  };
  std::vector<Line> driven;       ///< lines that the robot's centre drove
  std::vector<Line> open;         ///< lines along which ranges found no obstacle
  std::vector<Point2> obstacles;  ///< points of obstacles
  /// Positions at which the robot's centre cannot be, although it drove beside them.
  std::vector<Point2> impassable;
  std::vector<View> views;                 ///< memorised views
  std::vector<Unrecognised> unrecognised;  ///< ascending by `view_count`
  std::vector<Point2> given_up;            ///< positions that the robot could not reach
};

/// Options of a coverage map.
struct CoverageOptions {
  double radius_m = 0.5;        ///< catchment radius of a view that is not memorised yet, > 0
  double robot_radius_m = 0.2;  ///< >= 0
  double cell_m = 0.1;          ///< width of a cell, > 0
  /// Smallest uncovered area for which it is worth memorising a view, > 0.
  double min_area_m2 = 0.05;
  /// Distance from driven lines up to which the floor is assumed to be free unless an obstacle is
  /// known; for robots without ranges. 0: only floor that `open` lines show is to be covered.
  double assumed_open_m = 0.0;
};

/// Grid of the floor that an exploring robot knows: cells in which its centre cannot be, cells in
/// the catchment area of a view, and cells that remain to be covered. A cell is in a catchment area
/// if it is within its radius and no blocked cell is on the straight line to the view, so that the
/// robot can home from it, and if the robot did recognise a view near there. Immutable; the same
/// observations give the same grid.
class CoverageMap {
 public:
  /// A position for the next view.
  struct ViewPoint {
    Point2 position;           ///< centre of a cell
    double area_m2 = 0.0;      ///< uncovered area in its catchment area
    double path_m = 0.0;       ///< length of `path`
    std::vector<Point2> path;  ///< from the robot to `position`, through cells that are not blocked
  };

  /// Areas of the floor on which the robot has room.
  struct Areas {
    double floor_m2 = 0.0;    ///< floor that is known
    double covered_m2 = 0.0;  ///< part of it in the catchment area of a view
  };

  /// Cost: O(cells + length of all lines + area of all catchment areas); some milliseconds for
  /// 100 m2. Throws ContractError on options out of range.
  CoverageMap(const FloorObservations& floor, const CoverageOptions& options);

  /// True if the robot's centre cannot be there, as far as is known.
  [[nodiscard]] bool is_blocked(Point2 position) const noexcept;
  /// True if the position is in the catchment area of a view.
  [[nodiscard]] bool is_covered(Point2 position) const noexcept;
  /// True if the position is known to be floor, not blocked and not covered: a frontier.
  [[nodiscard]] bool is_frontier(Point2 position) const noexcept;
  /// True if no blocked cell is on the straight line.
  [[nodiscard]] bool is_open_between(Point2 from, Point2 to) const noexcept;

  /// Measures the areas. Cost: O(cells).
  [[nodiscard]] Areas measure_areas() const noexcept;
  /// Returns the frontier area in the catchment area of a view at `position`.
  [[nodiscard]] double compute_gain_m2(Point2 position) const;
  /// Finds the position with the largest frontier area for its path length. nullopt if no reachable
  /// position has `CoverageOptions::min_area_m2`, and a connected frontier that is worth the path:
  /// the floor is covered. `covered_share`: share of a frontier that views are expected to cover, 0
  /// .. 1; less than 1 where a part of them is no floor. Cost: O(cells).
  [[nodiscard]] std::optional<ViewPoint> find_view_point(Point2 robot,
                                                         double covered_share = 1.0) const;
  /// Finds the shortest path through cells that are not blocked; nullopt if there is none. `path`
  /// does not contain `from`.
  [[nodiscard]] std::optional<std::vector<Point2>> find_path(Point2 from, Point2 to) const;

 private:
  static constexpr std::uint8_t blocked_bit = 1;
  static constexpr std::uint8_t floor_bit = 2;
  static constexpr std::uint8_t covered_bit = 4;
  static constexpr std::uint8_t given_up_bit = 8;
  struct Paths;

  [[nodiscard]] std::optional<std::size_t> cell_at(Point2 position) const noexcept;
  [[nodiscard]] Point2 centre(std::size_t cell) const noexcept;
  [[nodiscard]] bool is_frontier(std::size_t cell) const noexcept;
  template <class Visit>
  void visit_disc(Point2 middle, double radius_m, const Visit& visit) const;
  template <class Visit>
  void visit_line(const FloorObservations::Line& line, const Visit& visit) const;
  template <class Visit>
  void visit_frontiers_beside(std::size_t cell, const Visit& visit) const;
  void set_bounds(const FloorObservations& floor);
  void mark_floor(const FloorObservations& floor);
  void mark_covered(const FloorObservations& floor);
  [[nodiscard]] std::optional<std::size_t> find_passable_cell_near(Point2 position) const;
  [[nodiscard]] Paths find_paths(Point2 from) const;
  [[nodiscard]] std::vector<Point2> trace_path(const Paths& paths, std::size_t end) const;
  [[nodiscard]] std::vector<double> weigh_cells() const;
  /// Returns the area of the connected frontier that each cell belongs to; 0 for other cells.
  [[nodiscard]] std::vector<double> measure_connected_frontiers() const;
  [[nodiscard]] std::vector<double> sum_in_squares(const std::vector<double>& weights) const;

  CoverageOptions options_;
  Point2 low_;
  std::size_t columns_ = 0;
  std::size_t rows_ = 0;
  std::vector<std::uint8_t> flags_;
};

}  // namespace panonav
