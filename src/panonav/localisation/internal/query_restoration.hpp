#pragma once

#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/signature/local_features.hpp"

namespace panonav {

/// A query with the estimated effects of its camera removed: compared with the memory as if taken
/// by a level robot, and with a memory that is as blurred as the query.
struct RestoredQuery {
  PackedSignature signature;  ///< of the level view
  Tilt tilt{};                ///< that was removed from the query
  double blur_rad = 0.0;      ///< deviation of the Gaussian by which the memory is blurred (`blur`)
};

/// Estimates what may differ between the camera of the query and that of the memory: the tilt of
/// the robot, or the blur of an image out of focus. Returns each with which one of the best matches
/// becomes more similar than the best one is, in most of its columns; the one with the smaller
/// difference first. None if elevations are unknown. `query`: may already be restored by one of
/// them. `memory`: of `ranked`. Cost: 0.3 ms for each of five matches.
[[nodiscard]] std::vector<RestoredQuery> restore_query(const RestoredQuery& query,
                                                       const VisualMemory& memory,
                                                       std::span<const RankedMatch> ranked);

/// Returns the view as a camera out of focus sees it: convolved with a Gaussian of the deviation
/// `blur_rad` over azimuth and elevation. `band`: elevations of the rows. Cost: 0.05 ms for 80 x
/// 15.
[[nodiscard]] PackedSignature blur(const PackedSignature& view, double blur_rad,
                                   const ElevationBand& band);

/// Moves features to where a level robot would see them; drops those outside the view.
[[nodiscard]] LocalFeatures level_features(LocalFeatures features, const Tilt& tilt);

}  // namespace panonav
