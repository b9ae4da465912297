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

/// Options of the fit of a scanline into a route panorama.
struct RouteFitOptions {
  double coarse_deg = 8.0;  ///< standard deviation of the smoothing at the first level, in azimuth
  int levels = 3;           ///< number of levels from coarse to not smoothed
  int max_steps = 8;        ///< Gauss-Newton steps at each level
  double reach_m = 6.0;     ///< lines farther from the prediction are not compared
  bool robust = true;       ///< changed parts of the scene have less weight
  /// Length of a metre in the unit of the route's poses, by which options and constants in metres
  /// are multiplied. Other than 1 only for routes in view steps; > 0. Not an option of users.
  double metre = 1.0;
  friend bool operator==(const RouteFitOptions&, const RouteFitOptions&) = default;
};
void visit_options(RouteFitOptions& options, OptionVisitor& visitor);

/// An estimated pose of a scanline, and the quality of the fit there.
struct RouteFix {
  /// Source of the position in a tracker.
  enum class Origin {
    prediction,  ///< fitted from the odometry's prediction
    recovery,    ///< the prediction failed; found around it
    search,      ///< found on the whole route
  };
  Pose2 pose;  ///< in the route's frame
  /// Covariance of x, y and heading in metres and radians, row-major: of `RouteLines::fit` by the
  /// residuals, which are correlated from column to column; of `RouteTracker` with the errors
  /// learnt from the route.
  std::array<double, 9> covariance{};
  /// Robust root mean square of the residuals over the standard deviation of the expected line.
  double residual = 1.0;
  /// Correlation of the scanline and the expected line, -1 .. 1; changed parts have less weight.
  double correlation = 0.0;
  /// Standard deviations of the smoothing of `detail_correlations`.
  static constexpr std::array<double, 4> detail_scales_deg{1.0, 2.0, 4.0, 8.0};
  /// Correlation of the changes from column to column of both lines, smoothed at each scale,
  /// -1 .. 1. Lines of different places may be similar on the whole, as rooms are, but not in
  /// detail.
  std::array<double, detail_scales_deg.size()> detail_correlations{};
  int columns = 0;  ///< directions in which the line of sight crosses the path
  /// Robust standard deviation of the scanline from the expected line, 0 .. 1; at least a grey
  /// level.
  double noise = 0.0;
  /// Residual of each column, 0 .. 1, after allowing for a shift by one degree, as edges in depth
  /// are off by that much between lines; NaN where the line of sight does not cross the path.
  std::vector<float> unexplained;
  Origin origin = Origin::prediction;  ///< set by `RouteTracker`, as the two below
  double along_m = 0.0;    ///< path length from the start to the point nearest to the robot
  double lateral_m = 0.0;  ///< offset of the robot from the path; positive to the left of the path
};

/// A route panorama prepared for fits: lines in the world's frame, smoothed at each level. At both
/// ends it is extrapolated by half the distance of two lines, as each line stands for the half
/// before and after it: a robot at an end is never exactly on the path, and half of its lines of
/// sight would miss it by millimetres. Immutable; several threads may use one.
class RouteLines {
 public:
  /// Copies the route: 4 bytes a value and level. Throws OptionError, and ContractError on a
  /// route of fewer than two lines.
  explicit RouteLines(const RoutePanorama& route, const RouteFitOptions& options = {});

  /// Finds the pose from which the route would look like the line, by least squares over all
  /// directions. Unknowns are x, y and heading, gain and offset of the light; the fit is from
  /// coarse to fine, starting at `predicted`. The intensities themselves are fitted, so that no
  /// contour is needed. nullopt where the prediction is out of reach of the path or the line has no
  /// structure. A fit that starts far from the truth ends at a wrong pose, which its low
  /// correlation shows. Throws ContractError on a wrong length. Cost: some ten steps of O(columns +
  /// lines in reach).
  [[nodiscard]] std::optional<RouteFix> fit(std::span<const float> line,
                                            const Pose2& predicted) const;

  /// Returns the line that the route panorama predicts at `pose` [Y03 section 3], in the frame of
  /// that pose; NaN where no line of sight crosses the path.
  [[nodiscard]] std::vector<float> synthesise(const Pose2& pose) const;

  /// A candidate pose of a line.
  struct Candidate {
    Pose2 pose;                ///< in the route's frame
    double correlation = 0.0;  ///< at the coarsest level
  };
  /// A view that the route predicts at the coarsest level.
  struct CoarseView {
    Point2 position;  ///< in the route's frame
    /// Line in the world's frame; NaN where no line of sight crosses the path.
    std::vector<float> expected;
  };
  /// Returns the coarse view at a position; nullopt if the lines of sight cross the path in fewer
  /// than half of all directions. Cost: a few microseconds.
  [[nodiscard]] std::optional<CoarseView> make_coarse_view(Point2 position) const;
  /// Finds the headings at which the correlation of a line with a coarse view has a maximum; empty
  /// where the line has no structure. Throws ContractError unless `coarse_line` comes from
  /// `to_coarse_line`. Cost: some ten thousand multiplications.
  [[nodiscard]] static std::vector<Candidate> find_candidates(std::span<const float> coarse_line,
                                                              const CoarseView& view);
  /// Converts a line for `find_candidates`.
  [[nodiscard]] std::vector<float> to_coarse_line(std::span<const float> line) const;

  /// Fits the pose at the coarsest level alone; nullopt as for `fit`. Throws ContractError on a
  /// wrong length. Cost: a tenth of `fit`.
  [[nodiscard]] std::optional<Candidate> fit_coarsely(std::span<const float> line,
                                                      const Pose2& predicted) const;

  /// Compares two poses as explanations of a line by the robust losses of the columns in which the
  /// route predicts it from both: the sum of their differences over its standard deviation, which
  /// allows for their autocorrelation [Vuong, Econometrica 1989]. A standard normal variable if
  /// both explain the line equally well; positive if `pose` does so better; 0 without such columns.
  /// Throws ContractError on a wrong length. Cost: two times `synthesise`.
  [[nodiscard]] double compare_poses(std::span<const float> line, const Pose2& pose,
                                     const Pose2& other) const;

  /// A position past an end of the route.
  struct PastEnd {
    Point2 position;  ///< in the route's frame
    /// By how much a pose explains a line better than this position, as of `compare_poses`.
    double lead = 0.0;
  };
  /// Finds the position past an end of the route that competes most with a pose as the explanation
  /// of a line. Few lines of sight from there cross the path, so that a fit may end elsewhere. The
  /// view past an end is that from the end, after a step outward among things that are all equally
  /// far away; this distance follows from the change of the last lines before the end. Throws
  /// ContractError on a wrong length. Cost: a million multiplications.
  [[nodiscard]] PastEnd find_past_end(std::span<const float> line, const Pose2& pose) const;

  /// The pose from which each line was taken, in the route's frame.
  [[nodiscard]] std::span<const Pose2> poses() const& noexcept { return poses_; }
  std::span<const Pose2> poses() const&& = delete;                 // would dangle
  [[nodiscard]] int columns() const noexcept { return columns_; }  ///< Values of a line.
  /// Options as passed to the constructor.
  [[nodiscard]] const RouteFitOptions& options() const noexcept { return options_; }

 private:
  struct Level {
    double sigma = 0.0;                  // of the smoothing, in columns
    std::size_t half_slope = 0;          // lines to either side between which the slope is taken
    std::size_t stride = 1;              // step between compared columns: smooth lines need few
    std::vector<Direction2> directions;  // of these
    std::vector<float> values;           // line by line, in the world's frame, as in `path_`
  };
  struct Term;
  struct Linearised;
  class FitProblem;
  [[nodiscard]] std::optional<LineWindow> find_window(Point2 position) const;
  [[nodiscard]] std::vector<RouteCrossing> find_crossings_in(
      const LineWindow& window, Point2 viewpoint, std::span<const Direction2> directions) const;
  /// The value of the route in a column where a line of sight crosses the path.
  [[nodiscard]] float expected_value(const Level& level, float along,
                                     std::size_t column) const noexcept;
  [[nodiscard]] bool collect_terms(const Level& level, std::span<const float> line,
                                   const Pose2& pose, const LineWindow& window,
                                   std::vector<Term>& terms) const;
  [[nodiscard]] static std::array<double, RouteFix::detail_scales_deg.size()> correlate_details(
      const std::vector<Term>& terms, std::size_t columns);
  [[nodiscard]] static std::vector<float> shift_tolerant_residuals(const std::vector<Term>& terms,
                                                                   std::size_t columns, double gain,
                                                                   double offset, int shift);
  /// Returns the fix at a pose, with the covariance from its equations; nullopt if these are
  /// singular.
  [[nodiscard]] std::optional<RouteFix> make_fix(std::span<const float> line, const Pose2& pose,
                                                 const Linearised& fitted,
                                                 const LineWindow& window) const;
  /// Does the same with the lines and columns of a level.
  [[nodiscard]] std::vector<float> synthesise(const Level& level, const Pose2& pose) const;
  void check_line(std::span<const float> line) const;

  int columns_;
  RouteFitOptions options_;
  std::vector<Pose2> poses_;
  PathIndex path_;             // path through the poses, extended at both ends
  std::vector<Level> levels_;  // coarse first
};

}  // namespace panonav
