#include "panonav/kernels/internal/vector.hpp"

// Loops without branches, which the compiler vectorises for each instruction set.

namespace panonav::kernels {

namespace {

inline void find_nearest_one_by_one(const uint64_t* a, size_t a_count, const uint64_t* b,
                                    size_t b_count, uint16_t* nearest_of_a,
                                    uint16_t* nearest_of_b) {
  // Packs the distance in the high and the index in the low bits: the minimum is the nearest
  // descriptor, and the first of equal ones.
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

/// Compares each descriptor of `b` with one descriptor of `a` in each group of a register.
template <class Vector>
void find_nearest_by_vectors(const uint64_t* a, size_t a_count, const uint64_t* b, size_t b_count,
                             uint16_t* nearest_of_a, uint16_t* nearest_of_b) {
  using Register = typename Vector::Register;
  constexpr size_t lanes = sizeof(Register) / sizeof(uint64_t);
  static_assert(max_descriptors % lanes == 0);
  constexpr uint8_t bit_counts[16] = {0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4};
  // Packs distance and index. Descriptors that fill up the last register have an index above all.
  constexpr uint64_t none = 0xFFFFFFFFU;
  uint64_t words[4][max_descriptors];
  uint64_t indices[max_descriptors];
  uint64_t best_of_a[max_descriptors];
  const size_t padded = (a_count + lanes - 1) / lanes * lanes;
  for (size_t i = 0; i < padded; ++i) {
    for (size_t w = 0; w < 4; ++w) words[w][i] = i < a_count ? a[4 * i + w] : 0;
    indices[i] = i < a_count ? i : none;
    best_of_a[i] = none;
  }
  for (size_t j = 0; j < b_count; ++j) {
    const Register index = Vector::broadcast(j);
    Register best = Vector::broadcast(none);
    for (size_t i = 0; i < padded; i += lanes) {
      Register counts = {};
      for (size_t w = 0; w < 4; ++w) {
        const Register differing = Vector::load(words[w] + i) ^ Vector::broadcast(b[4 * j + w]);
        counts = counts + Vector::lookup(bit_counts, differing) +
                 Vector::lookup_upper(bit_counts, differing);
      }
      const Register distance = Vector::sad(counts, Register{}) << 16;
      best = Vector::smaller(best, distance | Vector::load(indices + i));
      const Register of_a = Vector::smaller(Vector::load(best_of_a + i), distance | index);
      __builtin_memcpy(best_of_a + i, &of_a, sizeof of_a);
    }
    uint64_t of_lanes[lanes];
    __builtin_memcpy(of_lanes, &best, sizeof best);
    uint64_t smallest = none;
    for (const uint64_t one : of_lanes) smallest = one < smallest ? one : smallest;
    if (a_count > 0) nearest_of_b[j] = static_cast<uint16_t>(smallest);
  }
  for (size_t i = 0; i < a_count && b_count > 0; ++i) {
    nearest_of_a[i] = static_cast<uint16_t>(best_of_a[i]);
  }
}

}  // namespace

template <Instructions set>
void FeatureMatchBody<set>::nearest_descriptors(const uint64_t* a, size_t a_count,
                                                const uint64_t* b, size_t b_count,
                                                uint16_t* nearest_of_a, uint16_t* nearest_of_b) {
  using Vector = ByteVector<set>;
  if constexpr (requires(typename Vector::Register x) { Vector::smaller(x, x); }) {
    find_nearest_by_vectors<Vector>(a, a_count, b, b_count, nearest_of_a, nearest_of_b);
  } else {
    find_nearest_one_by_one(a, a_count, b, b_count, nearest_of_a, nearest_of_b);
  }
}

namespace {

/// Sum of products of two histograms; below 2^15, since each is at most 15 * 15.
inline int32_t multiply_histograms(const uint8_t* a, const uint8_t* b) {
  uint16_t sum = 0;
  for (size_t k = 0; k < histogram_dimensions; ++k) {
    sum = static_cast<uint16_t>(sum + static_cast<uint16_t>(a[k] * b[k]));
  }
  return sum;
}

}  // namespace

namespace {

/// Distance in the high and index in the low half: the minimum is the nearest histogram, and the
/// first of equal ones.
constexpr uint32_t no_histogram = ~0U;

inline void find_nearest_histograms_one_by_one(const uint8_t* a, size_t a_count, const uint8_t* b,
                                               size_t b_count, uint32_t* best_of_a,
                                               uint32_t* best_of_b) {
  int32_t squares_of_a[max_histograms];
  for (size_t i = 0; i < a_count; ++i) {
    const uint8_t* const histogram = a + i * histogram_dimensions;
    squares_of_a[i] = multiply_histograms(histogram, histogram);
  }
  for (size_t j = 0; j < b_count; ++j) {
    const uint8_t* const histogram = b + j * histogram_dimensions;
    const int32_t square_of_b = multiply_histograms(histogram, histogram);
    for (size_t i = 0; i < a_count; ++i) {
      const int32_t product = multiply_histograms(a + i * histogram_dimensions, histogram);
      const auto distance = static_cast<uint32_t>(squares_of_a[i] + square_of_b - 2 * product)
                            << 16U;
      const uint32_t here = distance | static_cast<uint32_t>(i);
      const uint32_t there = distance | static_cast<uint32_t>(j);
      best_of_b[j] = here < best_of_b[j] ? here : best_of_b[j];
      best_of_a[i] = there < best_of_a[i] ? there : best_of_a[i];
    }
  }
}

/// Compares each histogram of `b` with one of `a` in each number of 32 bits of a register. `a` has
/// at most `block` histograms, the first of which has the index `first`.
template <class Vector, size_t block>
void find_nearest_histograms_by_vectors(const uint8_t* a, size_t a_count, size_t first,
                                        const uint8_t* b, size_t b_count, uint32_t* best_of_a,
                                        uint32_t* best_of_b) {
  using Register = typename Vector::Register;
  constexpr size_t lanes = sizeof(Register) / sizeof(uint32_t);
  constexpr size_t words = histogram_dimensions / 4;
  static_assert(block % lanes == 0);
  uint32_t values[words][block];  // four values of each histogram
  uint32_t squares[block];
  uint32_t indices[block];  // those that only fill up the last register are above all others
  uint32_t best[block];
  const size_t padded = (a_count + lanes - 1) / lanes * lanes;
  for (size_t i = 0; i < padded; ++i) {
    const uint8_t* const histogram = a + (i < a_count ? i : 0) * histogram_dimensions;
    for (size_t w = 0; w < words; ++w) __builtin_memcpy(&values[w][i], histogram + 4 * w, 4);
    squares[i] = static_cast<uint32_t>(multiply_histograms(histogram, histogram));
    indices[i] = i < a_count ? static_cast<uint32_t>(first + i) : no_histogram;
    best[i] = no_histogram;
  }
  const auto in_each_number = [](uint64_t number) {
    return Vector::broadcast(number | number << 32U);
  };
  for (size_t j = 0; j < b_count; ++j) {
    const uint8_t* const histogram = b + j * histogram_dimensions;
    Register values_of_b[words];
    for (size_t w = 0; w < words; ++w) {
      uint32_t four;
      __builtin_memcpy(&four, histogram + 4 * w, sizeof four);
      values_of_b[w] = in_each_number(four);
    }
    const Register square =
        in_each_number(static_cast<uint64_t>(multiply_histograms(histogram, histogram)));
    const Register index = in_each_number(j);
    Register nearest = in_each_number(no_histogram);
    for (size_t i = 0; i < padded; i += lanes) {
      Register product = {};
      for (size_t w = 0; w < words; ++w) {
        product = Vector::add_products(product, Vector::load(values[w] + i), values_of_b[w]);
      }
      // No number of 32 bits becomes negative or exceeds 16 bits, so that those of 64 serve.
      const Register distance = (Vector::load(squares + i) + square - product - product) << 16;
      nearest = Vector::smaller(nearest, distance | Vector::load(indices + i));
      const Register of_a = Vector::smaller(Vector::load(best + i), distance | index);
      __builtin_memcpy(best + i, &of_a, sizeof of_a);
    }
    uint32_t of_lanes[lanes];
    __builtin_memcpy(of_lanes, &nearest, sizeof nearest);
    for (const uint32_t one : of_lanes) best_of_b[j] = one < best_of_b[j] ? one : best_of_b[j];
  }
  for (size_t i = 0; i < a_count; ++i) best_of_a[i] = best[i];
}

}  // namespace

template <Instructions set>
void FeatureMatchBody<set>::nearest_histograms(const uint8_t* a, size_t a_count, const uint8_t* b,
                                               size_t b_count, uint16_t* nearest_of_a,
                                               int32_t* distances_of_a, uint16_t* nearest_of_b) {
  using Vector = ByteVector<set>;
  uint32_t best_of_a[max_histograms];
  uint32_t best_of_b[max_histograms];
  for (size_t i = 0; i < a_count; ++i) best_of_a[i] = no_histogram;
  for (size_t j = 0; j < b_count; ++j) best_of_b[j] = no_histogram;
  if constexpr (requires(typename Vector::Register x) {
                  Vector::smaller(x, x);
                  Vector::add_products(x, x, x);
                }) {
    constexpr size_t block = 256;  // 32 kB of values stay in the first cache
    for (size_t first = 0; first < a_count; first += block) {
      const size_t left = a_count - first;
      find_nearest_histograms_by_vectors<Vector, block>(a + first * histogram_dimensions,
                                                        left < block ? left : block, first, b,
                                                        b_count, best_of_a + first, best_of_b);
    }
  } else {
    find_nearest_histograms_one_by_one(a, a_count, b, b_count, best_of_a, best_of_b);
  }
  for (size_t i = 0; i < a_count; ++i) {
    distances_of_a[i] = b_count > 0 ? static_cast<int32_t>(best_of_a[i] >> 16U) : 0x7FFFFFFF;
    if (b_count > 0) nearest_of_a[i] = static_cast<uint16_t>(best_of_a[i]);
  }
  for (size_t j = 0; j < b_count && a_count > 0; ++j) {
    nearest_of_b[j] = static_cast<uint16_t>(best_of_b[j]);
  }
}

namespace {

/// Sines and cosines of the azimuths of matches in the frame halfway between both views. If the
/// query's azimuth is clockwise of the reference's, both vectors are reversed, so that a direction
/// of motion must have a sine of at least `min_sine` to both bearings; `min_sine` is above 1 if no
/// motion can explain the match.
struct HalfwayBearings {
  float query_sine[max_descriptors], query_cosine[max_descriptors];
  float reference_sine[max_descriptors], reference_cosine[max_descriptors];
  float min_sine[max_descriptors];
};

/// Sets the first `count` of `halfway` from the matches from `first` on.
inline void turn_to_halfway(const MatchedBearings& matched, const MatchedBearings::Turn& turn,
                            const MotionHypotheses& hypotheses, size_t first, size_t count,
                            HalfwayBearings& halfway) {
  for (size_t i = 0; i < count; ++i) {
    const size_t at = first + i;
    const float within = matched.cosine[at] * turn.cosine - matched.sine[at] * turn.sine;
    // Parallax, counter-clockwise from the reference's bearing to the query's.
    const float parallax = matched.sine[at] * turn.cosine + matched.cosine[at] * turn.sine;
    const float size = parallax < 0.0F ? -parallax : parallax;
    const float sign = parallax < 0.0F ? -1.0F : 1.0F;
    halfway.query_sine[i] = sign * (matched.query_sine[at] * turn.half_cosine +
                                    matched.query_cosine[at] * turn.half_sine);
    halfway.query_cosine[i] = sign * (matched.query_cosine[at] * turn.half_cosine -
                                      matched.query_sine[at] * turn.half_sine);
    halfway.reference_sine[i] = sign * (matched.reference_sine[at] * turn.half_cosine -
                                        matched.reference_cosine[at] * turn.half_sine);
    halfway.reference_cosine[i] = sign * (matched.reference_cosine[at] * turn.half_cosine +
                                          matched.reference_sine[at] * turn.half_sine);
    const float limit =
        (size * hypotheses.tolerance_cosine - hypotheses.tolerance_sine) / hypotheses.max_ratio;
    const float needed = size <= hypotheses.tolerance_sine ? -2.0F : limit;
    halfway.min_sine[i] = within > 0.0F ? needed : 2.0F;
  }
}

}  // namespace

template <Instructions set>
void FeatureMatchBody<set>::count_explained(const MatchedBearings& matched,
                                            const MatchedBearings::Turn& turn,
                                            const MotionHypotheses& hypotheses, int32_t* counts) {
  const float square_tolerance = hypotheses.tolerance_sine * hypotheses.tolerance_sine;
  int32_t along[motion_axes] = {};
  int32_t against[motion_axes] = {};
  HalfwayBearings halfway;
  for (size_t first = 0; first < matched.count; first += max_descriptors) {
    const size_t left = matched.count - first;
    const size_t count = left < max_descriptors ? left : max_descriptors;
    turn_to_halfway(matched, turn, hypotheses, first, count, halfway);
    for (size_t i = 0; i < count; ++i) {
      const float query_tangent = matched.query_tangent[first + i];
      const float reference_tangent = matched.reference_tangent[first + i];
      const float query_square = query_tangent * query_tangent;
      const float reference_square = reference_tangent * reference_tangent;
      for (size_t d = 0; d < motion_axes; ++d) {
        // Sines of the angles between the direction of motion and both bearings.
        const float of_query = halfway.query_sine[i] * hypotheses.cosine[d] -
                               halfway.query_cosine[i] * hypotheses.sine[d];
        const float of_reference = halfway.reference_sine[i] * hypotheses.cosine[d] -
                                   halfway.reference_cosine[i] * hypotheses.sine[d];
        const float off = query_tangent * of_reference - reference_tangent * of_query;
        const float by_reference =
            (reference_square + of_reference * of_reference) * (1.0F + query_square);
        const float by_query = (query_square + of_query * of_query) * (1.0F + reference_square);
        const float scale = by_reference > by_query ? by_reference : by_query;
        const float smaller = of_query < of_reference ? of_query : of_reference;
        const float larger = of_query < of_reference ? of_reference : of_query;
        const int32_t in_plane = off * off <= square_tolerance * scale ? 1 : 0;
        along[d] += in_plane & (smaller >= halfway.min_sine[i] ? 1 : 0);
        against[d] += in_plane & (-larger >= halfway.min_sine[i] ? 1 : 0);
      }
    }
  }
  for (size_t d = 0; d < motion_axes; ++d) {
    counts[d] = along[d];
    counts[d + motion_axes] = against[d];
  }
}

template struct FeatureMatchBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
