#pragma once

#include <cstdint>
#include <optional>

#include "lab/runs/tracking_filter.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav::lab {

/// Settings of the filter as published [M03 section 4].
struct PublishedFilterSetting {
  OdometryNoise odometry{.drive = DriveKind::holonomic};  ///< true and assumed
  int particles = 5000;  ///< >= 1; the largest number of our filter, too
  /// If set, used instead of `particles`; the paper needs about 1 particle per reference.
  std::optional<double> particles_per_reference;
};

/// Tracks a run as published: each particle weighs as much as the similarity of the view to the
/// reference nearest to it ([M03] eq. 1, rescaled by [M04] eq. 3), the estimate is the mean of all
/// particles, the first heading is known, nothing is injected. The paper names no certainty:
/// `localised` if the particles' root mean square distance from their mean is at most the spacing
/// of the references. Same arguments, same bits.
[[nodiscard]] TrackedRun track_run_as_published(const TrackingPlace& place, const TrackingRun& run,
                                                const PublishedFilterSetting& setting,
                                                std::uint64_t seed);

}  // namespace panonav::lab
