#include "panonav/kernels/internal/bodies.hpp"

// Loops without branches, which the compiler vectorises for each instruction set.

namespace panonav::kernels {
namespace {

// Adding and subtracting 1.5 * 2^23 rounds a float to an integer.
constexpr float rounder = 12582912.0F;

// Approximates exp(x) for x < 80, at least 2^min_exponent; relative error below 4e-6.
inline float approximate_exp(float x, float min_exponent) {
  const float product = x * 1.44269504088896F;
  const float y = product > min_exponent ? product : min_exponent;
  const float whole = (y + rounder) - rounder;
  const float f = (y - whole) * 0.693147180559945F;
  const float series =
      1.0F + f * (1.0F + f * (0.5F + f * (1.0F / 6 + f * (1.0F / 24 + f * (1.0F / 120)))));
  const int exponent = (static_cast<int>(whole) + 127) << 23;
  float power;
  __builtin_memcpy(&power, &exponent, sizeof power);
  return series * power;
}

inline float wrap_angle_branchless(float angle_rad) {
  constexpr float turn_rad = 6.28318530717959F;
  const float turns = (angle_rad * (1.0F / turn_rad) + rounder) - rounder;
  return angle_rad - turn_rad * turns;
}

// Number of poses processed at once, so that their sums stay in registers.
constexpr int poses_per_block = 16;

inline void explain_similarity_lanes(const SimilarityLanes& lanes,
                                     const SimilarityLanes::Decay& decay,
                                     const float* __restrict x_m, const float* __restrict y_m,
                                     const float* __restrict heading_rad,
                                     float* __restrict explained) {
  constexpr float min_exponent = -60.0F;  // squares stay normal numbers; denormal ones are slow
  float squares[poses_per_block] = {};
  float products[poses_per_block] = {};
  for (int i = 0; i < similarity_lanes; ++i) {
    for (int p = 0; p < poses_per_block; ++p) {
      const float dx = lanes.x_m[i] - x_m[p];
      const float dy = lanes.y_m[i] - y_m[p];
      const float apart = __builtin_sqrtf(dx * dx + dy * dy + decay.blur_square_m2);
      const float expected = approximate_exp(-apart * decay.per_metre, min_exponent);
      const float turn = wrap_angle_branchless(heading_rad[p] - lanes.heading_rad[i]);
      const float other_turn = wrap_angle_branchless(heading_rad[p] - lanes.other_heading_rad[i]);
      const float best_exponent = lanes.log_similarity[i] + turn * turn * lanes.per_square_turn[i];
      const float second_exponent =
          lanes.other_log_similarity[i] + other_turn * other_turn * lanes.per_square_turn[i];
      squares[p] += expected * expected;
      products[p] +=
          approximate_exp(best_exponent > second_exponent ? best_exponent : second_exponent,
                          min_exponent) *
          expected;
    }
  }
  for (int p = 0; p < poses_per_block; ++p) {
    // Sets the residue of similarity 0 (2^min_exponent) to 0.
    const float product = products[p] > 1e-16F ? products[p] : 0.0F;
    explained[p] = product * product / (squares[p] + 1e-30F);
  }
}

}  // namespace

template <Instructions set>
void SimilarityBody<set>::explain_similarity(const SimilarityLanes& lanes,
                                             const SimilarityLanes::Decay& decay,
                                             const float* __restrict x_m,
                                             const float* __restrict y_m,
                                             const float* __restrict heading_rad,
                                             float* __restrict explained, int count) {
  int done = 0;
  for (; done + poses_per_block <= count; done += poses_per_block) {
    explain_similarity_lanes(lanes, decay, x_m + done, y_m + done, heading_rad + done,
                             explained + done);
  }
  if (done == count) return;
  float x[poses_per_block] = {};
  float y[poses_per_block] = {};
  float heading[poses_per_block] = {};
  float last[poses_per_block];
  for (int p = done; p < count; ++p) {
    x[p - done] = x_m[p];
    y[p - done] = y_m[p];
    heading[p - done] = heading_rad[p];
  }
  explain_similarity_lanes(lanes, decay, x, y, heading, last);
  for (int p = done; p < count; ++p) explained[p] = last[p - done];
}

template <Instructions set>
void SimilarityBody<set>::exponentials(const float* __restrict logarithms, float scale,
                                       float* __restrict values, int count) {
  for (int i = 0; i < count; ++i) values[i] = approximate_exp(scale * logarithms[i], -126.0F);
}

template struct SimilarityBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
