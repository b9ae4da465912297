#include "lab/m04/support.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav_simulation/make_each.hpp"

namespace panonav::lab {

const std::array<ViewCondition, 3>& view_conditions() {
  static const std::array<ViewCondition, 3> conditions{
      ViewCondition{"as_memorised", "as memorised", {}},
      ViewCondition{"hidden", "10 % of the azimuths hidden", {.occluded_fraction = 0.1}},
      ViewCondition{"noisy", "noise of 5 % of full scale", {.read_noise = 0.05}}};
  return conditions;
}

std::vector<simulation::PlacedView> capture_queries(const simulation::PlaceRecording& place,
                                                    const ViewCondition& condition,
                                                    Executor& executor) {
  if (condition.id == view_conditions().front().id) return place.queries;
  return simulation::recapture_queries(place, condition.sensor, place.seed * 100003U + 50000U,
                                       executor);
}

std::vector<FourierSignature> compute_signatures(const std::vector<simulation::PlacedView>& views,
                                                 int components, Executor& executor) {
  return simulation::make_each(executor, views.size(), [&](std::size_t i) {
    return compute_signature(views[i].panorama, components);
  });
}

std::vector<double> dissimilarity_by_component(const FourierSignature& a,
                                               const FourierSignature& b) {
  require(a.shape() == b.shape(), "components of a signature", b.components(),
          "the shape of the other one");
  std::vector<double> sums(static_cast<std::size_t>(a.components()));
  const auto rows = static_cast<std::size_t>(a.rows());
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const auto here = a.magnitudes().subspan(k * rows, rows);
    const auto there = b.magnitudes().subspan(k * rows, rows);
    for (std::size_t y = 0; y < rows; ++y) {
      sums[k] += std::abs(static_cast<double>(here[y]) - there[y]);
    }
  }
  return sums;
}

std::size_t find_smallest(std::span<const double> values) {
  return static_cast<std::size_t>(std::ranges::min_element(values) - values.begin());
}

VisualMemory make_memory(const std::vector<simulation::PlacedView>& views,
                         const std::vector<FourierSignature>& signatures) {
  require(!signatures.empty() && signatures.size() == views.size(), "number of signatures",
          static_cast<double>(signatures.size()), ">= 1, that of the views");
  float largest = 1e-6F;
  for (const auto& signature : signatures) {
    for (const float magnitude : signature.magnitudes()) largest = std::max(largest, magnitude);
  }
  VisualMemory memory(signatures.front().shape(), largest, signatures.front().elevations());
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    const Pose2& pose = views[i].pose;
    memory.append(signatures[i], {.name = "view " + std::to_string(i),
                                  .pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad},
                                  .stamp_s = std::nullopt});
  }
  return memory;
}

}  // namespace panonav::lab
