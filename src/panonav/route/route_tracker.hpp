#pragma once

#include <optional>
#include <span>

#include "panonav/core/options.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Where a tracker looks for the robot, and when it believes what it finds.
struct RouteTrackerOptions {
  double search_step_m = 0.2;      ///< between the places along the path that a search tries
  double search_lateral_m = 0.25;  ///< and to either side of it
  int search_sides = 2;            ///< so many times to either side
  int max_candidates = 6;          ///< places that a search fits
  double recovery_m = 0.5;         ///< by which a prediction may be off
  /// A robot that was followed until now and seems to be farther than this from where odometry puts
  /// it is believed to be there once the next line agrees.
  double surprise_m = 0.15;
  /// Correlation from which on a fit is believed; 0: learnt from the route itself.
  double min_correlation = 0.0;
  friend bool operator==(const RouteTrackerOptions&, const RouteTrackerOptions&) = default;
};
void visit_options(RouteTrackerOptions& options, OptionVisitor& visitor);

/// Follows a robot along a route panorama: odometry predicts, the line decides. Without a
/// prediction, or where it does not hold, the whole route is searched. Deterministic; a copy goes
/// on as the original.
class RouteTracker {
 public:
  /// Learns from the route which correlation a fit must have: lines fitted into the route made of
  /// every second of the others tell what right fits have, mirrored lines, which show a place that
  /// there is not, what wrong ones have; the limit lies a third of the way from the latter's 95 %
  /// quantile to the former's 5 % quantile. Throws OptionError, and ContractError on a route of
  /// fewer than two lines. Cost: 40 searches.
  explicit RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options = {},
                        const RouteFitOptions& fit = {});

  /// `step`: how the robot moved since the last line, in the frame it had then [Y03 section 4.1].
  /// Empty: not on this route, as far as the line tells, or at a surprising place of it, which is
  /// believed once two lines one after the other agree on it; the odometry is then carried on.
  /// Throws ContractError on a wrong length.
  std::optional<RouteFix> track(std::span<const float> line, const Pose2& step);

  /// From the line alone. Cost: some 10 microseconds for each place tried.
  [[nodiscard]] std::optional<RouteFix> search(std::span<const float> line) const;

  /// Forgets where the robot is.
  void reset() noexcept {
    pose_.reset();
    elsewhere_.reset();
    followed_ = false;
  }
  /// Takes it from elsewhere.
  void set_pose(const Pose2& pose) noexcept {
    pose_ = pose;
    elsewhere_.reset();
    followed_ = false;
  }
  /// Where the robot is believed to be, odometry included; empty: unknown.
  [[nodiscard]] const std::optional<Pose2>& pose() const noexcept { return pose_; }
  /// The least correlation of a fit that is believed: learnt, or as given.
  [[nodiscard]] double min_correlation() const noexcept { return min_correlation_; }
  /// The route as fits compare it.
  [[nodiscard]] const RouteLines& lines() const noexcept { return lines_; }

 private:
  [[nodiscard]] double learnt_correlation(const RoutePanorama& route,
                                          const RouteFitOptions& options) const;
  [[nodiscard]] std::optional<RouteFix> best_anywhere(std::span<const float> line) const;
  [[nodiscard]] std::optional<RouteFix> recover(std::span<const float> line,
                                                const Pose2& predicted) const;
  [[nodiscard]] RouteFix placed(RouteFix fix, RouteFix::Origin origin) const;

  RouteTrackerOptions options_;
  RouteLines lines_;
  double min_correlation_ = 0.0;
  std::optional<Pose2> pose_;
  std::optional<Pose2> elsewhere_;  // where the last line would have put the robot
  bool followed_ = false;           // a line has told where the robot is
};

}  // namespace panonav
