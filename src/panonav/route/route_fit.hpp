#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/route/route_crossing.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Options of fitting a scanline into a route panorama.
struct RouteFitOptions {
  double coarse_deg = 8.0;  ///< standard deviation of the smoothing where a fit starts, in azimuth
  int levels = 3;           ///< from coarse to not smoothed at all
  int max_steps = 8;        ///< Gauss-Newton steps at each level
  double reach_m = 6.0;     ///< lines farther from the prediction are not looked at
  bool robust = true;       ///< changed parts of the scene count less
  friend bool operator==(const RouteFitOptions&, const RouteFitOptions&) = default;
};
void visit_options(RouteFitOptions& options, OptionVisitor& visitor);

/// Where a scanline was seen from, and how well it fits there.
struct RouteFix {
  /// How a tracker found it.
  enum class Origin {
    prediction,  ///< fitted from the odometry's prediction
    recovery,    ///< the prediction did not hold; found around it
    search,      ///< found on the whole route
  };
  Pose2 pose;  ///< in the route's frame
  /// Of x, y and heading in metres and radians, row-major, as far as the noise of the lines goes.
  std::array<double, 9> covariance{};
  /// Robust root mean square of the residuals over the standard deviation of what the route shows.
  double residual = 1.0;
  /// Of the scanline and what the route shows from there, -1 .. 1; changed parts have less weight
  /// here, too.
  double correlation = 0.0;
  int columns = 0;  ///< directions in which the line of sight crosses the path
  /// Standard deviation of what is seen from what is shown, 0 .. 1; robust, at least a grey level.
  double noise = 0.0;
  /// By column of the line: what the fit leaves there and a shift by a degree does not explain, 0
  /// .. 1; NaN where nothing is crossed. Edges in depth are off by that much between lines.
  std::vector<float> unexplained;
  Origin origin = Origin::prediction;  ///< set by `RouteTracker`, as the two below
  double along_m = 0.0;    ///< path length from the start to the point nearest to the robot
  double lateral_m = 0.0;  ///< from the path to the robot; positive to the left of the path
};

/// A route panorama made ready for fits: lines turned into the world's frame and smoothed.
/// Immutable; several threads may use one.
class RouteLines {
 public:
  /// Copies what it needs: 4 bytes a value and level. Throws OptionError, and ContractError on a
  /// route of fewer than two lines.
  explicit RouteLines(const RoutePanorama& route, const RouteFitOptions& options = {});

  /// The pose from which the path shows what `line` shows: least squares of all directions at once
  /// over x, y and heading, gain and offset of the light, from coarse to fine, starting at
  /// `predicted`. No contour is needed: the intensities themselves are fitted. Empty where the
  /// prediction is out of reach of the path or the line has no structure. A fit that starts far
  /// from the truth also ends somewhere: judge it by its correlation. Throws ContractError on a
  /// wrong length. Cost: some ten steps of O(columns + lines in reach).
  [[nodiscard]] std::optional<RouteFix> fit(std::span<const float> line,
                                            const Pose2& predicted) const;

  /// What a robot sees from `pose` by the route panorama [Y03 section 3], in its frame; NaN where
  /// no line of sight crosses the path.
  [[nodiscard]] std::vector<float> synthesise(const Pose2& pose) const;

  /// Where a line may have been seen from.
  struct Candidate {
    Pose2 pose;                ///< in the route's frame
    double correlation = 0.0;  ///< at the coarsest level
  };
  /// Correlation of the coarsest level of a line with what the route shows from `position`, at the
  /// heading where it is highest. Empty where the line of sight crosses the path in fewer than half
  /// of all directions. Throws ContractError unless `coarse_line` comes from `coarse`. Cost:
  /// O(lines in reach + columns) and some thousand multiplications.
  [[nodiscard]] std::optional<Candidate> candidate(std::span<const float> coarse_line,
                                                   Point2 position) const;
  /// `line` as `candidate` wants it.
  [[nodiscard]] std::vector<float> coarse(std::span<const float> line) const;

  /// Where each line was seen from, in the route's frame.
  [[nodiscard]] std::span<const Pose2> poses() const& noexcept { return poses_; }
  std::span<const Pose2> poses() const&& = delete;                 // would dangle
  [[nodiscard]] int columns() const noexcept { return columns_; }  ///< Values of a line.
  /// As they were given.
  [[nodiscard]] const RouteFitOptions& options() const noexcept { return options_; }

 private:
  struct Level {
    double sigma = 0.0;                  // of the smoothing, in columns
    std::size_t half_slope = 0;          // lines to either side between which the slope is taken
    std::size_t stride = 1;              // columns between those that count: smooth lines need few
    std::vector<Direction2> directions;  // of these
    std::vector<float> values;           // line by line, in the world's frame
  };
  // Lines first .. last are in reach.
  struct Window {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  struct Term;
  struct Linearised;
  struct Workspace;
  [[nodiscard]] bool descend(std::span<const Level> levels, std::span<const float> line,
                             const Window& near, Workspace& work, Pose2& pose) const;
  [[nodiscard]] std::optional<Window> window(Point2 position) const;
  // What the route shows in a column where a line of sight crosses the path.
  [[nodiscard]] float shown(const Level& level, float along, std::size_t column) const noexcept;
  [[nodiscard]] bool collect(const Level& level, std::span<const float> seen, const Pose2& pose,
                             const Window& window, std::vector<RouteCrossing>& crossings,
                             std::vector<Term>& terms) const;
  [[nodiscard]] static std::vector<float> shift_tolerant_residuals(const std::vector<Term>& terms,
                                                                   std::size_t columns, double gain,
                                                                   double offset, int shift);
  // The fix at a pose with its equations; empty where these determine no covariance.
  [[nodiscard]] std::optional<RouteFix> described(std::span<const float> line, const Pose2& pose,
                                                  const Linearised& normal, const Window& near,
                                                  Workspace& work) const;

  int columns_;
  RouteFitOptions options_;
  std::vector<Pose2> poses_;
  std::vector<Level> levels_;  // coarse first
};

}  // namespace panonav
