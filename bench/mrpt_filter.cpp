#include "scan_filter.hpp"

#ifdef PANONAV_BENCH_MRPT

#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include <cmath>
#include <numbers>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav::bench {

namespace {

constexpr float longest_m = 20.0F;

// `beams` of the ranges, which MRPT wants from -pi on.
mrpt::obs::CObservation2DRangeScan::Ptr observation_of(const RangeScan& ranges, int beams) {
  auto scan = mrpt::obs::CObservation2DRangeScan::Create();
  const auto count = static_cast<std::size_t>(beams);
  scan->aperture = static_cast<float>(2.0 * std::numbers::pi * (beams - 1) / beams);
  scan->rightToLeft = true;
  scan->maxRange = longest_m;
  scan->resizeScan(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float range = ranges[(i * ranges.size() / count + ranges.size() / 2) % ranges.size()];
    const bool valid = range < longest_m;
    scan->setScanRange(i, valid ? range : longest_m);
    scan->setScanRangeValidity(i, valid);
  }
  // The first beam points backwards, whatever half of the aperture is.
  scan->sensorPose =
      mrpt::poses::CPose3D(0.0, 0.0, 0.0, 0.5 * scan->aperture - std::numbers::pi, 0.0, 0.0);
  return scan;
}

class MrptFilter final : public ScanFilter {
 public:
  MrptFilter(const Corridor& corridor, int particles, int beams)
      : beams_(beams), particles_(static_cast<std::size_t>(particles)), filter_(particles_) {
    const simulation::Scene& scene = corridor.place.scene;
    auto map = mrpt::maps::COccupancyGridMap2D::Create(
        static_cast<float>(scene.floor_low.x_m) - 1.0F,
        static_cast<float>(scene.floor_high.x_m) + 1.0F,
        static_cast<float>(scene.floor_low.y_m) - 1.0F,
        static_cast<float>(scene.floor_high.y_m) + 1.0F, 0.05F);
    map->insertionOptions.maxDistanceInsertion = longest_m;
    map->likelihoodOptions.LF_decimation = 1;
    map->likelihoodOptions.LF_maxRange = longest_m;
    for (std::size_t i = 0; i < corridor.map_scans.size(); ++i) {
      const RangeScan& scan = corridor.map_scans[i];
      const Pose2& pose = corridor.mapped_from[i];
      const mrpt::poses::CPose3D from(pose.x_m, pose.y_m, 0.0, pose.heading_rad, 0.0, 0.0);
      map->insertObservation(*observation_of(scan, static_cast<int>(scan.size())), from);
    }
    filter_.options.metricMap = map;
    algorithm_.m_options.adaptiveSampleSize = false;
    algorithm_.m_options.BETA = 0.5;
    algorithm_.m_options.sampleSize = static_cast<unsigned>(particles);
    algorithm_.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prSystematic;
    // Our own filter uses the same odometry.
    const OdometryNoise noise;
    motion_.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
    motion_.gaussianModel = {noise.translation_from_translation,
                             noise.translation_from_rotation,
                             noise.rotation_from_translation,
                             noise.rotation_from_rotation,
                             0.01,
                             0.005};
  }

  void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad) override {
    filter_.resetDeterministic({pose.x_m, pose.y_m, pose.heading_rad}, particles_);
    for (auto& particle : filter_.m_particles) {
      particle.d.x = random_.normal(pose.x_m, deviation_m);
      particle.d.y = random_.normal(pose.y_m, deviation_m);
      particle.d.phi = wrap_angle(random_.normal(pose.heading_rad, heading_deviation_rad));
    }
  }

  void take(const RangeScan& scan) override {
    frame_.clear();
    frame_.insert(observation_of(scan, beams_));
  }

  void update(const Pose2& step) override {
    mrpt::obs::CActionRobotMovement2D moved;
    moved.computeFromOdometry({step.x_m, step.y_m, step.heading_rad}, motion_);
    mrpt::obs::CActionCollection actions;
    actions.insert(moved);
    algorithm_.executeOn(filter_, &actions, frame_.size() > 0 ? &frame_ : nullptr);
    frame_.clear();
  }

  [[nodiscard]] Pose2 mean() const override {
    const auto pose = filter_.getMeanVal();
    return {pose.x(), pose.y(), pose.phi()};
  }

 private:
  int beams_;
  std::size_t particles_;
  mrpt::slam::CMonteCarloLocalization2D filter_;
  mrpt::bayes::CParticleFilter algorithm_;
  mrpt::obs::CActionRobotMovement2D::TMotionModelOptions motion_;
  mrpt::obs::CSensoryFrame frame_;
  Random random_{1};
};

}  // namespace

std::unique_ptr<ScanFilter> make_mrpt_filter(const Corridor& corridor, int particles, int beams) {
  return std::make_unique<MrptFilter>(corridor, particles, beams);
}

}  // namespace panonav::bench

#else

namespace panonav::bench {

std::unique_ptr<ScanFilter> make_mrpt_filter(const Corridor& /*corridor*/, int /*particles*/,
                                             int /*beams*/) {
  return nullptr;
}

}  // namespace panonav::bench

#endif
