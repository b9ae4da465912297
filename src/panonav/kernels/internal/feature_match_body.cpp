#include "panonav/kernels/internal/bodies.hpp"

// Loops without branches, which the compiler vectorises for each instruction set.

namespace panonav::kernels {

template <Instructions set>
void FeatureMatchBody<set>::nearest_descriptors(const uint64_t* a, size_t a_count,
                                                const uint64_t* b, size_t b_count,
                                                uint16_t* nearest_of_a, uint16_t* nearest_of_b) {
  // Distance above number: the smallest is the nearest, and the first of equal ones.
  constexpr uint32_t none = ~0U;
  uint32_t best_of_a[max_descriptors];
  for (size_t i = 0; i < a_count; ++i) best_of_a[i] = none;
  for (size_t j = 0; j < b_count; ++j) {
    uint32_t best = none;
    for (size_t i = 0; i < a_count; ++i) {
      int sum = 0;
      for (size_t w = 0; w < 4; ++w) sum += __builtin_popcountll(a[4 * i + w] ^ b[4 * j + w]);
      const uint32_t distance = static_cast<uint32_t>(sum) << 16U;
      const uint32_t here = distance | static_cast<uint32_t>(i);
      const uint32_t there = distance | static_cast<uint32_t>(j);
      best = here < best ? here : best;
      best_of_a[i] = there < best_of_a[i] ? there : best_of_a[i];
    }
    if (a_count > 0) nearest_of_b[j] = static_cast<uint16_t>(best);
  }
  for (size_t i = 0; i < a_count && b_count > 0; ++i) {
    nearest_of_a[i] = static_cast<uint16_t>(best_of_a[i]);
  }
}

template <Instructions set>
void FeatureMatchBody<set>::count_explained(const BearingLane* lanes, size_t lane_count,
                                            const float* directions, size_t direction_count,
                                            float square_tolerance, int32_t* counts) {
  for (size_t d = 0; d < direction_count; ++d) {
    const float cosine = directions[2 * d];
    const float sine = directions[2 * d + 1];
    int32_t total[BearingLane::size] = {};
    for (size_t l = 0; l < lane_count; ++l) {
      const BearingLane& lane = lanes[l];
      for (int i = 0; i < BearingLane::size; ++i) {
        // Of the angles between the direction of motion and both bearings.
        const float of_query = lane.query_sine[i] * cosine - lane.query_cosine[i] * sine;
        const float of_reference =
            lane.reference_sine[i] * cosine - lane.reference_cosine[i] * sine;
        const float off =
            lane.query_tangent[i] * of_reference - lane.reference_tangent[i] * of_query;
        const float by_reference =
            (lane.reference_tangent[i] * lane.reference_tangent[i] + of_reference * of_reference) *
            (1.0F + lane.query_tangent[i] * lane.query_tangent[i]);
        const float by_query =
            (lane.query_tangent[i] * lane.query_tangent[i] + of_query * of_query) *
            (1.0F + lane.reference_tangent[i] * lane.reference_tangent[i]);
        const float scale = by_reference > by_query ? by_reference : by_query;
        const float smaller = of_query < of_reference ? of_query : of_reference;
        const int32_t in_plane = off * off <= square_tolerance * scale ? 1 : 0;
        const int32_t far_enough = smaller >= lane.min_sine[i] ? 1 : 0;
        total[i] += in_plane & far_enough;
      }
    }
    int32_t sum = 0;
    for (int i = 0; i < BearingLane::size; ++i) sum += total[i];
    counts[d] = sum;
  }
}

template struct FeatureMatchBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
