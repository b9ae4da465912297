#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Options for the search for the robot and for the acceptance of fits.
struct RouteTrackerOptions {
  double search_step_m = 0.2;      ///< distance between tested positions along the path
  double search_lateral_m = 0.25;  ///< distance between tested positions to either side
  int search_sides = 2;            ///< number of tested positions to either side
  int max_candidates = 4;          ///< number of best poses from which a search fits
  double recovery_m = 0.5;         ///< largest error of a predicted position
  /// Distance from the odometry's prediction beyond which a fix of a followed robot must be
  /// confirmed by the next line.
  double surprise_m = 0.15;
  /// Smallest correlation of an accepted fit; 0: learnt from the route itself, with the smallest
  /// detail correlation, which is otherwise not tested.
  double min_correlation = 0.0;
  friend bool operator==(const RouteTrackerOptions&, const RouteTrackerOptions&) = default;
};
void visit_options(RouteTrackerOptions& options, OptionVisitor& visitor);

/// Values that a tracker learns from a route: limits of accepted fits, and errors beyond the noise.
struct RouteLimits {
  double min_correlation = 0.0;  ///< smallest correlation of an accepted fit, 0 .. 1
  /// Smallest detail correlation of an accepted fit, below 1; -1: not tested.
  double min_detail_correlation = -1.0;
  std::size_t detail_scale = 0;      ///< of this, in `RouteFix::detail_scales_deg`
  double model_variance_m2 = 0.0;    ///< of x and of y, beyond the noise of the lines, >= 0
  double model_variance_rad2 = 0.0;  ///< of the heading, likewise
  friend bool operator==(const RouteLimits&, const RouteLimits&) = default;
};
/// True if all values are in their ranges.
[[nodiscard]] bool is_valid(const RouteLimits& limits);

/// Follows a robot along a route panorama: odometry predicts the pose, and each line corrects it.
/// Without a prediction, or if it fails, the whole route is searched. Deterministic; a copy
/// continues like the original.
class RouteTracker {
 public:
  /// Learns from lines left out of the route, and from negative and shuffled ones, of no place:
  /// - the smallest correlation: above the 95 % quantile for no place by a third of the
  ///   distance to the 5 % quantile of the lines;
  /// - the smallest detail correlation: that 1 % for no place exceed, at the finest scale
  ///   at which most lines exceed it;
  /// - the variance beyond the noise: 95 % of fits from `surprise_m` beside the truth are then in
  ///   the ellipse; for few fits that between two lines.
  ///
  /// `learnt`: of a tracker of this route and options; nothing is then learnt. Throws OptionError,
  /// ContractError on fewer than two lines or invalid limits. Cost: 80 searches.
  explicit RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options = {},
                        const RouteFitOptions& fit = {},
                        const std::optional<RouteLimits>& learnt = std::nullopt);

  /// Locates the robot by a line. `step`: its motion since the last line, in the frame of the robot
  /// at that line [Y03 section 4.1]. nullopt if the line does not match the route, or if it matches
  /// at an unexpected place, which is accepted once two successive lines agree on it; the pose is
  /// then predicted by odometry alone. Throws ContractError on a wrong length.
  std::optional<RouteFix> track(std::span<const float> line, const Pose2& step);

  /// Locates the robot by the line alone. nullopt if the line does not match the route, if it
  /// matches it elsewhere almost as well, or if a position past an end explains it better. Where
  /// such a position is near, the covariance contains both. Cost: some microseconds for each
  /// position tried.
  [[nodiscard]] std::optional<RouteFix> search(std::span<const float> line) const;

  /// Forgets where the robot is.
  void reset() noexcept {
    pose_.reset();
    along_m_.reset();
    unconfirmed_.reset();
    is_followed_ = false;
  }
  /// Sets the pose by another source.
  void set_pose(const Pose2& pose) noexcept {
    pose_ = pose;
    along_m_.reset();
    unconfirmed_.reset();
    is_followed_ = false;
  }
  /// The estimated pose, odometry included; nullopt: unknown.
  [[nodiscard]] const std::optional<Pose2>& pose() const noexcept { return pose_; }
  /// Learnt limits, or those of the options.
  [[nodiscard]] const RouteLimits& limits() const noexcept { return limits_; }
  /// The route as prepared for fits.
  [[nodiscard]] const RouteLines& lines() const noexcept { return lines_; }

 private:
  /// Some of the lines as a route, and lines between them.
  struct TestRoute;
  /// Error of a fit of such a line.
  struct FitError;
  /// Lists the views in which a search looks for a line.
  void list_search_views();
  /// Sets the limits; leaves those for which there are too few lines or fits.
  void learn(const RoutePanorama& route, const RouteFitOptions& fit);
  void learn_acceptance(const TestRoute& test);
  /// True if lines of sight cross the path in at least half of all directions. Otherwise few
  /// directions decide, and any line fits somewhere far from the path.
  [[nodiscard]] bool has_enough_columns(const RouteFix& fix) const;
  [[nodiscard]] bool is_match(const RouteFix& fix) const;
  /// True if one pose is near the first and the other near the last pose of the route, with the
  /// same heading: a round ends where it begins, though by odometry in two positions.
  [[nodiscard]] bool is_round_end(const Pose2& pose, const Pose2& other) const;
  [[nodiscard]] std::vector<FitError> measure_errors(const TestRoute& test) const;
  void learn_model_errors(const TestRoute& halved, const TestRoute& thinned);
  /// Returns the fits of the line, the best one first.
  [[nodiscard]] std::vector<RouteFix> find_on_route(std::span<const float> line) const;
  [[nodiscard]] std::optional<RouteFix> recover(std::span<const float> line,
                                                const Pose2& predicted) const;
  [[nodiscard]] RouteFix add_route_position(RouteFix fix, RouteFix::Origin origin) const;

  RouteTrackerOptions options_;
  double metre_;  // `RouteFitOptions::metre`
  RouteLines lines_;
  std::vector<RouteLines::CoarseView> search_views_;
  RouteLimits limits_;
  std::optional<Pose2> pose_;
  std::optional<double> along_m_;     // of the latest fix; its pass is kept at crossings
  std::optional<Pose2> unconfirmed_;  // unexpected pose by the last line
  bool is_followed_ = false;          // a line has located the robot
};

}  // namespace panonav
