#include "panonav/camera/internal/patch_matching.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>

#include "panonav/geometry/angles.hpp"

namespace panonav::dual_fisheye {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Grey levels of one picture, reduced by `reduction` and smoothed.
struct Plane {
  int reduction = 1, width = 0, height = 0;
  const std::vector<float>* values = nullptr;
};

Plane make_plane(const SmoothPlanes& smooth, int reduction) {
  return {reduction, smooth.width, smooth.height, &smooth.channels[0]};
}

/// Half-width of a patch, which has 15 x 15 values: at the finest level about 5 degrees in
/// pictures of 1280 x 640.
constexpr int patch_radius = 7;
constexpr int patch_side = 2 * patch_radius + 1;
/// Smallest standard deviation of a patch, in grey levels: weaker ones are dominated by 8-bit
/// rounding and sensor noise.
constexpr double min_contrast = 3.0;
/// Smallest correlation of two patches that are accepted as a match.
constexpr double min_correlation = 0.7;

struct Patch {
  int half = 0;
  std::vector<float> values;  ///< negative: not seen
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y + half) * static_cast<std::size_t>(2 * half + 1) +
                  static_cast<std::size_t>(x + half)];
  }
};
template <class View>
Patch cut_patch(const View& view, const Vector3d& middle, const Vector3d& east,
                const Vector3d& north, double step_rad, int half) {
  Patch patch{half, {}};
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      patch.values.push_back(view.value(middle + step_rad * (x * east + y * north)));
    }
  }
  return patch;
}

struct Correlation {
  double value = -1.0;
  double log_gain = 0.0;
};
Correlation correlate(const Patch& a, const Patch& b, int dx, int dy) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int y = -patch_radius; y <= patch_radius; ++y) {
    for (int x = -patch_radius; x <= patch_radius; ++x) {
      const double p = a.at(x, y);
      const double q = b.at(x + dx, y + dy);
      if (p < 0 || q < 0) continue;
      n += 1;
      sa += p;
      sb += q;
      saa += p * p;
      sbb += q * q;
      sab += p * q;
    }
  }
  if (n < 0.5 * patch_side * patch_side) return {};
  const double va = saa - sa * sa / n;
  const double vb = sbb - sb * sb / n;
  if (!(va > 0 && vb > 0.25 * min_contrast * min_contrast * n)) return {};
  return {(sab - sa * sb / n) / std::sqrt(va * vb),
          std::log(std::max(sb, 1.0) / std::max(sa, 1.0))};
}

/// Computes a matrix that weights position errors: 1 across the patch's main edge direction, less
/// along it. nullopt if the contrast is too low.
std::optional<Eigen::Matrix2d> compute_error_weights(const Patch& patch) {
  double n = 0, sum = 0, squares = 0;
  Eigen::Matrix2d tensor = Eigen::Matrix2d::Zero();
  for (int y = -patch_radius; y <= patch_radius; ++y) {
    for (int x = -patch_radius; x <= patch_radius; ++x) {
      const double here = patch.at(x, y);
      if (here < 0) continue;
      n += 1;
      sum += here;
      squares += here * here;
      if (x == patch_radius || y == patch_radius || patch.at(x + 1, y) < 0 ||
          patch.at(x, y + 1) < 0)
        continue;
      const Vector2d slope(patch.at(x + 1, y) - here, patch.at(x, y + 1) - here);
      tensor += slope * slope.transpose();
    }
  }
  if (n < 0.5 * patch_side * patch_side) return std::nullopt;
  if (squares - sum * sum / n < min_contrast * min_contrast * n) return std::nullopt;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(tensor);
  const double largest = solver.eigenvalues()[1];
  if (!(largest > 0)) return std::nullopt;
  const Vector2d roots(std::sqrt(std::max(0.0, solver.eigenvalues()[0] / largest)), 1.0);
  const Eigen::Matrix2d axes = solver.eigenvectors();
  return Eigen::Matrix2d(axes * roots.asDiagonal() * axes.transpose());
}

/// A direction in the world with two directions orthogonal to it, and its region.
struct Direction {
  Vector3d middle, east, north;
  int region = 0;
};
/// Returns direction i of `count` evenly spread directions (Fibonacci lattice). The poles are left
/// out, because they show floor or tripod and the hand above.
Direction make_direction(std::size_t i, int count) {
  const double z = 0.94 * (1 - (2.0 * static_cast<double>(i) + 1) / count);
  const double azimuth = std::numbers::pi * (3 - std::sqrt(5.0)) * static_cast<double>(i);
  const double flat = std::sqrt(1 - z * z);
  const Vector3d middle(flat * std::cos(azimuth), flat * std::sin(azimuth), z);
  const Vector3d east(-std::sin(azimuth), std::cos(azimuth), 0);
  const double turns = azimuth / (2 * std::numbers::pi);
  const int region = static_cast<int>((turns - std::floor(turns)) * sectors) % sectors +
                     sectors * static_cast<int>(2 * (z + 1));
  return {middle, east, middle.cross(east), region};
}

/// Returns the pairs of views to match: both lenses of each picture, and each lens of a picture
/// with each lens of the next one (cyclically).
std::vector<std::array<int, 2>> list_view_pairs(int pictures) {
  std::vector<std::array<int, 2>> pairs;
  for (int p = 0; p < pictures; ++p) {
    pairs.push_back({2 * p, 2 * p + 1});
    if (pictures == 1 || (pictures == 2 && p == 1)) continue;
    const int next = (p + 1) % pictures;
    for (const int a : {0, 1}) {
      for (const int b : {0, 1}) pairs.push_back({2 * p + a, 2 * next + b});
    }
  }
  return pairs;
}

}  // namespace

/// One lens in one picture, with the pose given by the state.
class PatchMatcher::View {
 public:
  View(const State& state, int picture, int lens, const Plane& plane, double mirror_sign)
      : lens_(state.lenses[lens]),
        lens_from_world_(world_from_lens(state.rotations[picture], lens_).transpose()),
        plane_(plane),
        mirror_sign_(mirror_sign) {}

  /// Projects a direction of the world to image pixels; nullopt beyond the field of view.
  [[nodiscard]] std::optional<Vector2d> pixel(const Vector3d& in_world) const {
    const Vector3d d = lens_from_world_ * in_world;
    const auto point = project(lens_, {d.x(), d.y(), d.z()});
    if (!point) return std::nullopt;
    return Vector2d(lens_.centre_u_px + mirror_sign_ * point->right_px,
                    lens_.centre_v_px - point->up_px);
  }
  /// Returns the grey level in this direction; negative if the view does not show it.
  [[nodiscard]] float value(const Vector3d& in_world) const {
    const auto at = pixel(in_world);
    if (!at) return -1.0F;
    const double u = at->x() / plane_.reduction - 0.5;
    const double v = at->y() / plane_.reduction - 0.5;
    if (!(u >= 0 && v >= 0 && u < plane_.width - 1 && v < plane_.height - 1)) return -1.0F;
    const auto u0 = static_cast<std::size_t>(u);
    const auto v0 = static_cast<std::size_t>(v);
    const auto a = static_cast<float>(u - static_cast<double>(u0));
    const auto b = static_cast<float>(v - static_cast<double>(v0));
    const float* here = plane_.values->data() + v0 * static_cast<std::size_t>(plane_.width) + u0;
    const float* below = here + plane_.width;
    return (1 - b) * ((1 - a) * here[0] + a * here[1]) + b * ((1 - a) * below[0] + a * below[1]);
  }

 private:
  FisheyeLens lens_;
  Matrix3d lens_from_world_;
  Plane plane_;
  double mirror_sign_;
};

int Matching::count_near_expected() const {
  return static_cast<int>(
      std::ranges::count_if(matches, [](const Match& match) { return match.offset_steps <= 1.0; }));
}

void PatchMatcher::estimate_yaws(State& state, double step_rad, double left_azimuth_rad) {
  static_cast<void>(get_or_create_planes(state, step_rad));
  // Uses the first reduction for all fields of view, which differ little.
  const int reduction = planes_.front().first;
  const std::vector<SmoothPlanes>& smooth_pictures = planes_.front().second;
  constexpr int columns = 360;  // a value a degree
  constexpr int rows = 30;      // every second degree about the horizon
  const auto panorama = [&](int picture) {
    std::vector<float> values;
    const Plane plane = make_plane(smooth_pictures[picture], reduction);
    State level = state;
    level.rotations[picture] = {};
    const View left(level, picture, 0, plane, mirror_sign_);
    const View right(level, picture, 1, plane, mirror_sign_);
    for (int y = 0; y < rows; ++y) {
      double sum = 0;
      for (int c = 0; c < columns; ++c) {
        const double azimuth = left_azimuth_rad + 2 * std::numbers::pi * c / columns;
        const auto d = Direction3::from_angles(azimuth, radians(2.0 * y - rows));
        const View& view = std::cos(azimuth - left_azimuth_rad) > 0 ? left : right;
        values.push_back(std::max(0.0F, view.value({d.x, d.y, d.z})));
        sum += values.back();
      }
      for (int c = 0; c < columns; ++c) {
        values[static_cast<std::size_t>(y) * columns + c] -= static_cast<float>(sum / columns);
      }
    }
    return values;
  };
  const auto first = panorama(0);
  for (int p = 1; p < static_cast<int>(state.rotations.size()); ++p) {
    const auto other = panorama(p);
    double best = -1;
    for (int turn = 0; turn < columns; ++turn) {
      double product = 0;
      for (std::size_t i = 0; i < other.size(); ++i) {
        const std::size_t column = (i % columns + static_cast<std::size_t>(turn)) % columns;
        product += static_cast<double>(other[i]) * first[i / columns * columns + column];
      }
      if (product > best) {
        best = product;
        state.rotations[p].yaw_rad = 2 * std::numbers::pi * turn / columns;
      }
    }
  }
}

/// Matches patches around one direction of the world between pairs of views that see it.
class PatchMatcher::Search {
 public:
  Search(const std::vector<View>& views, const Direction& direction, double step_rad,
         int search_steps)
      : views_(views),
        direction_(direction),
        step_rad_(step_rad),
        search_steps_(search_steps),
        search_areas_(views.size()) {}

  /// Matches the patch of view a in view b and appends the match, if there is one, to `found`;
  /// counts the patch as textured if both views have contrast there.
  void add_match(int a, int b, Matching& found) {
    const auto pixel = views_[a].pixel(direction_.middle);
    if (!pixel || !views_[b].pixel(direction_.middle)) return;
    const auto whitener = compute_error_weights(get_or_create_search_area(a));
    if (!whitener) return;
    const std::vector<Correlation> correlations = correlate_all_offsets(a, b);
    const auto best = static_cast<int>(
        std::ranges::max_element(correlations, {}, &Correlation::value) - correlations.begin());
    if (correlations[best].value < -0.5)
      return;  // view b does not show the patch, or has no contrast there
    ++found.textured_count;
    const int width = 2 * search_steps_ + 1;
    const int x = best % width;
    const int y = best / width;
    if (correlations[best].value < min_correlation || x == 0 || y == 0 || x == width - 1 ||
        y == width - 1) {
      return;
    }
    const auto vertex = [&](int stride) {  // of the parabola through three values
      const double low = correlations[best - stride].value;
      const double high = correlations[best + stride].value;
      const double bend = low + high - 2 * correlations[best].value;
      return bend < 0 ? std::clamp(0.5 * (low - high) / bend, -0.5, 0.5) : 0.0;
    };
    const auto& [middle, east, north, region] = direction_;
    const double dx = x - search_steps_ + vertex(1);
    const double dy = y - search_steps_ + vertex(width);
    const auto other = views_[b].pixel(middle + step_rad_ * (dx * east + dy * north));
    if (!other) return;
    found.matches.push_back({{ImagePoint{a / 2, a % 2, *pixel}, ImagePoint{b / 2, b % 2, *other}},
                             east,
                             north,
                             *whitener,
                             std::hypot(dx, dy),
                             correlations[best].log_gain,
                             region});
  }

 private:
  /// Returns the search area of a view, cut from the image at the first call.
  [[nodiscard]] const Patch& get_or_create_search_area(int view) {
    if (!search_areas_[view]) {
      search_areas_[view] = cut_patch(views_[view], direction_.middle, direction_.east,
                                      direction_.north, step_rad_, patch_radius + search_steps_);
    }
    return *search_areas_[view];
  }
  /// Correlates the patch of view a with view b at every offset of the search window; the result is
  /// row-major.
  [[nodiscard]] std::vector<Correlation> correlate_all_offsets(int a, int b) {
    std::vector<Correlation> correlations;
    const int width = 2 * search_steps_ + 1;
    for (int i = 0; i < width * width; ++i) {
      correlations.push_back(correlate(get_or_create_search_area(a), get_or_create_search_area(b),
                                       i % width - search_steps_, i / width - search_steps_));
    }
    return correlations;
  }

  const std::vector<View>& views_;
  Direction direction_;
  double step_rad_;
  int search_steps_;
  std::vector<std::optional<Patch>> search_areas_;
};

Matching PatchMatcher::match(const State& state, double step_rad, int search_steps,
                             int directions) {
  const auto& [reduction, smooth] = get_or_create_planes(state, step_rad);
  const int count = static_cast<int>(grey_.size());
  std::vector<View> views;
  for (int p = 0; p < count; ++p) {
    const Plane plane = make_plane(smooth[p], reduction);
    for (int lens = 0; lens < 2; ++lens) views.emplace_back(state, p, lens, plane, mirror_sign_);
  }
  const auto pairs = list_view_pairs(count);
  const auto directions_size = static_cast<std::size_t>(directions);
  std::vector<Matching> found(directions_size);
  executor_.for_each_chunk(directions_size, 1, [&](std::size_t begin, std::size_t, std::size_t) {
    Search search(views, make_direction(begin, directions), step_rad, search_steps);
    for (const auto& [a, b] : pairs) search.add_match(a, b, found[begin]);
  });
  Matching all;
  for (Matching& part : found) {
    all.textured_count += part.textured_count;
    std::ranges::move(part.matches, std::back_inserter(all.matches));
  }
  return all;
}

const std::pair<int, std::vector<SmoothPlanes>>& PatchMatcher::get_or_create_planes(
    const State& state, double step_rad) {
  const int reduction =
      std::max(1, static_cast<int>(std::lround(state.lenses[0].focal_length_px * step_rad)));
  for (const auto& known : planes_) {
    if (known.first == reduction) return known;
  }
  constexpr double sigma_px = 0.7;  // against aliasing of the reduced pictures
  std::vector<SmoothPlanes> smooth;
  for (const Image& picture : grey_) {
    smooth.push_back(make_smooth_planes(picture.view(), reduction, sigma_px));
  }
  return planes_.emplace_back(reduction, std::move(smooth));
}

}  // namespace panonav::dual_fisheye
