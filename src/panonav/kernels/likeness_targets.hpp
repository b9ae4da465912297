#pragma once

// The bodies of explain_likeness and exponentials, one for each instruction set. No C++ standard
// headers here.

namespace panonav::kernels {

constexpr int likeness_lanes = 12;

/// What reference views around a place tell of a view, side by side. A lane without a reference has
/// likeness 0, the logarithm of which is minus infinity, and lies far away.
struct LikenessLanes {
  float x_m[likeness_lanes];
  float y_m[likeness_lanes];
  float log_likeness[likeness_lanes];        ///< to the view
  float heading_rad[likeness_lanes];         ///< that the reference tells of the view
  float other_log_likeness[likeness_lanes];  ///< at the other heading that fits
  float other_heading_rad[likeness_lanes];
  float per_square_turn[likeness_lanes];  ///< <= 0; 0: the heading does not count
};

/// How likeness falls with distance: exp(-sqrt(distance^2 + blur) * per_metre).
struct LikenessFall {
  float per_metre;
  float blur_square_m2;
};

namespace scalar {
void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall, const float* x_m,
                      const float* y_m, const float* heading_rad, float* explained, int count);
void exponentials(const float* logarithms, float scale, float* values, int count);
}  // namespace scalar
namespace avx2 {
void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall, const float* x_m,
                      const float* y_m, const float* heading_rad, float* explained, int count);
void exponentials(const float* logarithms, float scale, float* values, int count);
}  // namespace avx2
namespace avx512 {
void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall, const float* x_m,
                      const float* y_m, const float* heading_rad, float* explained, int count);
void exponentials(const float* logarithms, float scale, float* values, int count);
}  // namespace avx512
namespace neon {
void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall, const float* x_m,
                      const float* y_m, const float* heading_rad, float* explained, int count);
void exponentials(const float* logarithms, float scale, float* values, int count);
}  // namespace neon

}  // namespace panonav::kernels
