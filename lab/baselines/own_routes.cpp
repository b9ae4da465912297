// This library's route memories as route methods, and its chain with the layout of van Dijk et al.

#include <cmath>
#include <optional>

#include "lab/baselines/route_rivals.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/path_follower.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/chain_follower.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::lab {

namespace {

class ChainMethod final : public RouteMethod {
 public:
  ChainMethod(std::string name, const SnapshotShape& shape, bool is_horizon)
      : name_(std::move(name)), shape_(shape), is_horizon_(is_horizon) {}

  [[nodiscard]] std::string name() const override { return name_; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    ChainRecorder recorder(shape_, {}, route_odometry);
    for (const RoutePicture& picture : pictures) recorder.add(view(picture), picture.moved);
    const SnapshotChain chain = recorder.finish();
    // Scales that the published layout does not have are not counted.
    const double snapshot_bytes =
        static_cast<double>(is_horizon_ ? shape_.coefficients() : shape_.bytes());
    bytes_ = static_cast<double>(chain.pack().size()) -
             static_cast<double>(chain.snapshots()) *
                 (static_cast<double>(shape_.bytes()) - snapshot_bytes);
    follower_.emplace(chain, ChainDirection::forward);
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const ChainDecision decision = follower_.value().decide(view(picture), picture.moved);
    return {.turn_rad = decision.turn_rad,
            .advance_m = decision.advance_m,
            .has_arrived = decision.state == ChainState::arrived,
            .is_lost = decision.state == ChainState::lost};
  }

  [[nodiscard]] double bytes() const override { return bytes_; }
  [[nodiscard]] bool reports_arrival() const override { return true; }

 private:
  // Views have the mean and the gain that the command gives them, in any light.
  [[nodiscard]] HomingView view(const RoutePicture& picture) const {
    const FourierSignature signature =
        compute_signature(preprocess(picture.panorama, {}), shape_.components);
    return is_horizon_ ? horizon_view(signature) : homing_view(signature);
  }

  std::string name_;
  SnapshotShape shape_;
  bool is_horizon_;
  double bytes_ = 0.0;
  std::optional<ChainFollower> follower_;
};

class PanoramaMethod final : public RouteMethod {
 public:
  [[nodiscard]] std::string name() const override { return "route panorama"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    RoutePanorama route(pictures.front().panorama.columns());
    Pose2 pose;
    for (const RoutePicture& picture : pictures) {
      if (!route.empty()) pose = pose * picture.moved;
      static_cast<void>(route.append(pose, std::span<const float>(line(picture))));
    }
    constexpr double pose_bytes = 6.0;  // two bytes each for step, direction and heading
    bytes_ = static_cast<double>(route.size()) * (route.columns() + pose_bytes);
    tracker_.emplace(route);
    tracker_->set_pose({});
    const std::vector<Point2> path = positions_of(route.poses());
    follower_.emplace(path, PathFollowerOptions{.look_ahead_m = 0.6, .arrived_m = 0.2});
    lines_off_ = 0;
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const auto fix = tracker_.value().track(line(picture), picture.moved);
    lines_off_ = fix ? 0 : lines_off_ + 1;
    const Pose2 here = tracker_->pose().value_or(Pose2{});
    const auto target = follower_->next_target(here.position());
    constexpr int max_lines_off = 100;
    if (!target) return {.advance_m = 0.0, .has_arrived = true};
    if (lines_off_ > max_lines_off) return {.advance_m = 0.0, .is_lost = true};
    const Point2 ahead = inverse(here) * *target;
    return {.turn_rad = std::atan2(ahead.y_m, ahead.x_m),
            .advance_m = std::min(0.3, std::hypot(ahead.x_m, ahead.y_m))};
  }

  [[nodiscard]] double bytes() const override { return bytes_; }
  [[nodiscard]] bool reports_arrival() const override { return true; }

 private:
  static std::vector<float> line(const RoutePicture& picture) {
    return horizon_scanline(picture.panorama, {.columns = picture.panorama.columns()});
  }

  double bytes_ = 0.0;
  int lines_off_ = 0;
  std::optional<RouteTracker> tracker_;
  std::optional<PathFollower> follower_;
};

}  // namespace

std::unique_ptr<RouteMethod> make_snapshot_chain() {
  return std::make_unique<ChainMethod>("snapshot chain", SnapshotShape{}, false);
}
std::unique_ptr<RouteMethod> make_horizon_chain() {
  return std::make_unique<ChainMethod>("17-byte horizon",
                                       SnapshotShape{.rows = 1, .components = 9, .bits = 8}, true);
}
std::unique_ptr<RouteMethod> make_route_panorama() {
  return std::make_unique<PanoramaMethod>();
}

}  // namespace panonav::lab
