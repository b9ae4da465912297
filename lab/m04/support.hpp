#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Number of signature components in the papers.
inline constexpr int m04_components = 15;

/// Sensor with which the queries are taken.
struct ViewCondition {
  std::string id;
  std::string name;
  simulation::SensorOptions sensor;
};
/// Returns three conditions: as memorised, a tenth of all azimuths hidden by people, and a sensor
/// with much noise.
[[nodiscard]] const std::array<ViewCondition, 3>& view_conditions();

/// Takes the queries of the place again under `condition`; returns the recorded queries for the
/// first condition.
[[nodiscard]] std::vector<simulation::PlacedView> capture_queries(
    const simulation::PlaceRecording& place, const ViewCondition& condition, Executor& executor);

[[nodiscard]] std::vector<FourierSignature> compute_signatures(
    const std::vector<simulation::PlacedView>& views, int components, Executor& executor);

/// Returns the dissimilarity per component: the terms of [M04 eq. 6] without weights.
[[nodiscard]] std::vector<double> dissimilarity_by_component(const FourierSignature& a,
                                                             const FourierSignature& b);

/// Returns the index of the smallest value; the first one of equal values.
[[nodiscard]] std::size_t find_smallest(std::span<const double> values);

/// Makes a memory of posed views, in their order. The largest magnitude of all signatures is the
/// full scale of packing.
[[nodiscard]] VisualMemory make_memory(const std::vector<simulation::PlacedView>& views,
                                       const std::vector<FourierSignature>& signatures);

}  // namespace panonav::lab
