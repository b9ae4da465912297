#pragma once

#include <optional>
#include <span>

#include "panonav/core/options.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Where a tracker searches for the robot, and when it accepts a fit.
struct RouteTrackerOptions {
  double search_step_m = 0.2;      ///< between the positions along the path that a search tries
  double search_lateral_m = 0.25;  ///< between those to either side of it
  int search_sides = 2;            ///< positions to either side
  int max_candidates = 6;          ///< positions that a search fits
  double recovery_m = 0.5;         ///< largest error of a prediction
  /// Distance from the odometry's prediction beyond which a fix of a followed robot must be
  /// confirmed by the next line.
  double surprise_m = 0.15;
  /// Smallest correlation of an accepted fit; 0: learnt from the route itself.
  double min_correlation = 0.0;
  friend bool operator==(const RouteTrackerOptions&, const RouteTrackerOptions&) = default;
};
void visit_options(RouteTrackerOptions& options, OptionVisitor& visitor);

/// Follows a robot along a route panorama: odometry predicts, the line corrects. Without a
/// prediction, or where it fails, the whole route is searched. Deterministic; a copy continues as
/// the original.
class RouteTracker {
 public:
  /// Learns from the route which correlation a fit must have: right fits are those of lines into
  /// the route made of every second other line, wrong ones those of mirrored lines, which show a
  /// place that does not exist; the limit lies a third of the distance from the latter's 95 %
  /// quantile to the former's 5 % quantile. Throws OptionError, and ContractError on a route of
  /// fewer than two lines. Cost: 40 searches.
  explicit RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options = {},
                        const RouteFitOptions& fit = {});

  /// Locates the robot by a line; `step`: its motion since the last line, in the frame it had then
  /// [Y03 section 4.1]. nullopt: the line does not match this route, or at an unexpected place,
  /// which is accepted once two successive lines agree on it; the odometry is then integrated.
  /// Throws ContractError on a wrong length.
  std::optional<RouteFix> track(std::span<const float> line, const Pose2& step);

  /// Locates the robot by the line alone. Cost: some 10 microseconds for each position tried.
  [[nodiscard]] std::optional<RouteFix> search(std::span<const float> line) const;

  /// Forgets where the robot is.
  void reset() noexcept {
    pose_.reset();
    unconfirmed_.reset();
    is_followed_ = false;
  }
  /// Sets the pose by another source.
  void set_pose(const Pose2& pose) noexcept {
    pose_ = pose;
    unconfirmed_.reset();
    is_followed_ = false;
  }
  /// The estimated pose, odometry included; nullopt: unknown.
  [[nodiscard]] const std::optional<Pose2>& pose() const noexcept { return pose_; }
  /// Smallest correlation of an accepted fit: learnt, or that of the options.
  [[nodiscard]] double min_correlation() const noexcept { return min_correlation_; }
  /// The route as prepared for fits.
  [[nodiscard]] const RouteLines& lines() const noexcept { return lines_; }

 private:
  [[nodiscard]] double learn_min_correlation(const RoutePanorama& route,
                                             const RouteFitOptions& options) const;
  [[nodiscard]] std::optional<RouteFix> find_best_on_route(std::span<const float> line) const;
  [[nodiscard]] std::optional<RouteFix> recover(std::span<const float> line,
                                                const Pose2& predicted) const;
  [[nodiscard]] RouteFix with_route_position(RouteFix fix, RouteFix::Origin origin) const;

  RouteTrackerOptions options_;
  RouteLines lines_;
  double min_correlation_ = 0.0;
  std::optional<Pose2> pose_;
  std::optional<Pose2> unconfirmed_;  // unexpected pose by the last line
  bool is_followed_ = false;          // a line has located the robot
};

}  // namespace panonav
