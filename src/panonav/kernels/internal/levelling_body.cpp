#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {
namespace {

/// Arc tangent of y / x in the right quadrant, 0 where both are 0. Without branches, so that
/// compilers vectorise loops that call it.
[[gnu::always_inline]] inline double arc_tangent(double y, double x) {
  constexpr double pi = 3.14159265358979323846;
  constexpr double tan_pi_8 = 0.41421356237309504880;
  const double a = x < 0.0 ? -x : x;
  const double b = y < 0.0 ? -y : y;
  const double larger = a > b ? a : b;
  const double smaller = a > b ? b : a;
  // Angles above pi / 8 are measured from pi / 4, as in `to_polar`.
  const bool is_far = smaller > tan_pi_8 * larger;
  const double numerator = is_far ? smaller - larger : smaller;
  const double denominator = is_far ? smaller + larger : larger;
  const double t = numerator / (denominator > 0.0 ? denominator : 1.0);
  // Chebyshev interpolation of (atan(t) / t - 1) / t^2 in t^2, over 0 .. tan(pi / 8)^2; error of
  // atan below 6e-17.
  constexpr double series[]{-0.3333333333333325,  0.19999999999898407,  -0.1428571426609662,
                            0.11111109636534361,  -0.09090852557176049, 0.0769105515839315,
                            -0.06649613695291669, 0.05736332165907643,  -0.04483334622272886,
                            0.02275052699336167};
  const double z = t * t;
  double sum = series[9];
#pragma GCC unroll 9
  for (int i = 8; i >= 0; --i) sum = sum * z + series[i];
  const double from_axis = (is_far ? pi / 4.0 : 0.0) + (t + t * z * sum);
  const double first = b > a ? pi / 2.0 - from_axis : from_axis;
  const double upper = x < 0.0 ? pi - first : first;
  return y < 0.0 ? -upper : upper;
}

}  // namespace

template <Instructions set>
void LevellingBody<set>::tilted_positions(const TiltedDirections& directions,
                                          const double* __restrict cosines,
                                          const double* __restrict sines, float* __restrict rows,
                                          float* __restrict columns, int count) {
  const TiltedDirections d = directions;
  for (int i = 0; i < count; ++i) {
    const double x = d.flat * cosines[i];
    const double y = d.flat * sines[i];
    const double x_robot = d.cos_pitch * x - d.sin_pitch * d.z;
    const double z_rolled = d.sin_pitch * x + d.cos_pitch * d.z;
    const double y_robot = d.cos_roll * y + d.sin_roll * z_rolled;
    const double z_robot = d.cos_roll * z_rolled - d.sin_roll * y;
    const double elevation =
        arc_tangent(z_robot, __builtin_sqrt(x_robot * x_robot + y_robot * y_robot));
    // The difference of two azimuths is the azimuth of the one seen from the other.
    const double turned = arc_tangent(y_robot * cosines[i] - x_robot * sines[i],
                                      x_robot * cosines[i] + y_robot * sines[i]);
    rows[i] = static_cast<float>((d.top_rad - elevation) * d.rows_per_rad - 0.5);
    columns[i] = static_cast<float>(turned * d.columns_per_rad);
  }
}

template <Instructions set>
void LevellingBody<set>::sample_tilted_row(const float* __restrict seen, int seen_rows,
                                           const float* __restrict rows,
                                           const float* __restrict shifts, float* __restrict values,
                                           int columns) {
  const int last_row = seen_rows - 1;
  const auto last = static_cast<float>(last_row);
  for (int c = 0; c < columns; ++c) {
    const float at_least = rows[c] < 0.0F ? 0.0F : rows[c];
    const float row = at_least > last ? last : at_least;
    const int above = static_cast<int>(row);
    const int below = above < last_row ? above + 1 : last_row;
    const float down = row - static_cast<float>(above);
    const float column = static_cast<float>(c + columns) + shifts[c];  // 0 .. 3 * columns
    const int whole = static_cast<int>(column);
    const float right = column - static_cast<float>(whole);
    const int within_two = whole >= 2 * columns ? whole - 2 * columns : whole;
    const int left_column = within_two >= columns ? within_two - columns : within_two;
    const int right_column = left_column + 1 == columns ? 0 : left_column + 1;
    const int upper = above * columns;
    const int lower = below * columns;
    const float upper_left = seen[upper + left_column];
    const float lower_left = seen[lower + left_column];
    const float high = upper_left + right * (seen[upper + right_column] - upper_left);
    const float low = lower_left + right * (seen[lower + right_column] - lower_left);
    values[c] = high + down * (low - high);
  }
}

template struct LevellingBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
