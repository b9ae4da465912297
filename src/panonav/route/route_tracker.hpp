#pragma once

#include <optional>
#include <span>

#include "panonav/core/options.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Options for the search for the robot and for the acceptance of fits.
struct RouteTrackerOptions {
  double search_step_m = 0.2;      ///< distance between tested positions along the path
  double search_lateral_m = 0.25;  ///< distance between tested positions to either side
  int search_sides = 2;            ///< number of tested positions to either side
  int max_candidates = 6;          ///< number of best positions from which a search fits
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

/// Follows a robot along a route panorama: odometry predicts the pose, and each line corrects it.
/// Without a prediction, or if it fails, the whole route is searched. Deterministic; a copy
/// continues like the original.
class RouteTracker {
 public:
  /// Learns from lines left out of the route, and from lines of no place (negatives and shuffled
  /// ones):
  /// - the smallest correlation: above the 95 % quantile of lines of no place by a third of the
  ///   distance to the 5 % quantile of the lines;
  /// - the smallest detail correlation: that 1 % of lines of no place exceed, at the finest scale
  ///   at which most lines exceed it;
  /// - the variance of errors beyond the noise, so that 95 % of the fits that start `surprise_m`
  ///   beside the truth lie within the ellipse; that of positions between two lines for few fits.
  ///
  /// Throws OptionError, and ContractError on a route of fewer than two lines. Cost: 80 searches.
  explicit RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options = {},
                        const RouteFitOptions& fit = {});

  /// Locates the robot by a line. `step`: its motion since the last line, in the frame of the robot
  /// at that line [Y03 section 4.1]. nullopt if the line does not match the route, or if it matches
  /// at an unexpected place, which is accepted once two successive lines agree on it; the pose is
  /// then predicted by odometry alone. Throws ContractError on a wrong length.
  std::optional<RouteFix> track(std::span<const float> line, const Pose2& step);

  /// Locates the robot by the line alone. Cost: some 10 microseconds for each position tried.
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
  /// Smallest correlation of an accepted fit: learnt, or that of the options.
  [[nodiscard]] double min_correlation() const noexcept { return min_correlation_; }
  /// Smallest detail correlation of an accepted fit; -1: not tested.
  [[nodiscard]] double min_detail_correlation() const noexcept { return min_detail_; }
  /// The route as prepared for fits.
  [[nodiscard]] const RouteLines& lines() const noexcept { return lines_; }

 private:
  /// Half of the lines as a route, and lines of the other half.
  struct TestRoute;
  /// Sets the limits of accepted fits; leaves them if there are too few fits.
  void learn_limits(const TestRoute& test);
  /// True if lines of sight cross the path in at least half of all directions. Otherwise few
  /// directions decide, and any line fits somewhere far from the path.
  [[nodiscard]] bool has_enough_columns(const RouteFix& fix) const;
  [[nodiscard]] bool is_match(const RouteFix& fix) const;
  void learn_model_errors(const TestRoute& test);
  [[nodiscard]] std::optional<RouteFix> find_best_on_route(std::span<const float> line) const;
  [[nodiscard]] std::optional<RouteFix> recover(std::span<const float> line,
                                                const Pose2& predicted) const;
  [[nodiscard]] RouteFix add_route_position(RouteFix fix, RouteFix::Origin origin) const;

  RouteTrackerOptions options_;
  double metre_;  // `RouteFitOptions::metre`
  RouteLines lines_;
  double min_correlation_ = 0.0;
  double min_detail_ = -1.0;
  std::size_t detail_scale_ = 0;      // in `RouteFix::detail_scales_deg`
  double model_variance_m2_ = 0.0;    // of x and of y, beyond the noise of the lines
  double model_variance_rad2_ = 0.0;  // of the heading, likewise
  std::optional<Pose2> pose_;
  std::optional<double> along_m_;     // of the latest fix; its pass is kept at crossings
  std::optional<Pose2> unconfirmed_;  // unexpected pose by the last line
  bool is_followed_ = false;          // a line has located the robot
};

}  // namespace panonav
