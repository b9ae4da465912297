#pragma once

#include <memory>
#include <span>

#include "corridor_walks.hpp"

namespace panonav::bench {

/// Another Monte-Carlo localisation: 2D laser scans in a grid map.
class ScanFilter {
 public:
  virtual ~ScanFilter() = default;
  virtual void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad) = 0;
  /// The scan that belongs to the next update, brought into the filter's own form.
  virtual void take(const RangeScan& scan) = 0;
  /// One update with everything the filter does: prediction and, when a scan was taken since the
  /// last one, weights, and resampling where due.
  virtual void update(const Pose2& step) = 0;
  [[nodiscard]] virtual Pose2 mean() const = 0;
};

/// MRPT's CMonteCarloLocalization2D with a constant number of particles and the likelihood field of
/// `beams` of a scan's ranges. The grid map of 5 cm is made of the corridor's scans at their true
/// poses. Systematic resampling below half the effective sample size. Null where MRPT is not
/// installed.
[[nodiscard]] std::unique_ptr<ScanFilter> make_mrpt_filter(const Corridor& corridor, int particles,
                                                           int beams);

}  // namespace panonav::bench
