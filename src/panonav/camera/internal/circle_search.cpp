#include "panonav/camera/internal/circle_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <numeric>
#include <ranges>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav {
namespace {

/// Directions in which the coarse search samples a circle; finer searches sample it every 3 px.
constexpr int coarse_directions = 96;

/// Returns the number of samples of a circle: one per `spacing` of its circumference, 48 to 720.
int sample_count(double radius, double spacing) {
  return std::clamp(static_cast<int>(2 * std::numbers::pi * radius / spacing), 48, 720);
}

/// Interpolates bilinearly; points outside [0.5, width - 0.5] x [0.5, height - 0.5] are clamped to
/// it.
template <class Planes>
float sample_bilinear(const Planes& image, const std::vector<float>& plane, double u, double v) {
  const double x = std::clamp(u - 0.5, 0.0, image.width - 1.0);
  const double y = std::clamp(v - 0.5, 0.0, image.height - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(0, image.width - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, image.height - 2));
  const int x1 = std::min(x0 + 1, image.width - 1);
  const int y1 = std::min(y0 + 1, image.height - 1);
  const auto fx = static_cast<float>(x - x0);
  const auto fy = static_cast<float>(y - y0);
  const float top = plane[image.index(x0, y0)] * (1 - fx) + plane[image.index(x1, y0)] * fx;
  const float bottom = plane[image.index(x0, y1)] * (1 - fx) + plane[image.index(x1, y1)] * fx;
  return top * (1 - fy) + bottom * fy;
}

double figure_of_merit(const CircleScore& found, const CircleRange& range) {
  return found.visible < range.visible_fraction ? -1.0 : found.quality * std::sqrt(found.visible);
}

struct Direction {
  double cosine, sine;               ///< of the direction from the centre
  float double_cosine, double_sine;  ///< of twice its angle
};

std::array<Direction, coarse_directions> make_directions() {
  std::array<Direction, coarse_directions> result{};
  for (int i = 0; i < coarse_directions; ++i) {
    const double angle = 2 * std::numbers::pi * i / coarse_directions;
    result[i] = {std::cos(angle), std::sin(angle), static_cast<float>(std::cos(2 * angle)),
                 static_cast<float>(std::sin(2 * angle))};
  }
  return result;
}

/// Averages the edge field along one circle, in sectors.
class SectorScore {
 public:
  static constexpr int sectors = 12;

  void add(int sample_number, int count, float value) {
    const auto sector = static_cast<std::size_t>(sample_number * sectors / count);
    sum_[sector] += value;
    ++samples_[sector];
    ++visible_;
  }
  [[nodiscard]] CircleScore score(int count, EdgeAveraging averaging) const {
    if (visible_ == 0) return {};
    const double visible = static_cast<double>(visible_) / count;
    if (averaging == EdgeAveraging::mean) {
      return {static_cast<double>(std::accumulate(sum_.begin(), sum_.end(), 0.0F)) / visible_,
              visible};
    }
    float roots = 0;
    int visible_sectors = 0;
    for (std::size_t i = 0; i < sectors; ++i) {
      if (samples_[i] == 0) continue;
      ++visible_sectors;
      if (sum_[i] > 0) roots += std::sqrt(sum_[i] / static_cast<float>(samples_[i]));
    }
    const double mean_root = static_cast<double>(roots) / visible_sectors;
    return {mean_root * mean_root, visible};
  }

 private:
  std::array<float, sectors> sum_{};
  std::array<int, sectors> samples_{};
  int visible_ = 0;
};

/// Computes the merit of a circle from the nearest pixels in 96 directions, for exhaustive search.
double coarse_merit(const EdgeField& field, const std::array<Direction, coarse_directions>& rays,
                    const FieldCircle& circle, const CircleRange& range) {
  SectorScore total;
  for (int i = 0; i < coarse_directions; ++i) {
    const Direction& ray = rays[i];
    const double u = circle.u + circle.radius * ray.cosine;
    const double v = circle.v + circle.radius * ray.sine;
    if (u < 0 || v < 0 || u >= field.width || v >= field.height) continue;
    const std::size_t at = field.index(static_cast<int>(u), static_cast<int>(v));
    total.add(i, coarse_directions,
              field.cosine[at] * ray.double_cosine + field.sine[at] * ray.double_sine);
  }
  return figure_of_merit(total.score(coarse_directions, range.averaging), range);
}

/// Computes the merit of circles of one radius around all pixels at once: sums copies of the field
/// that are shifted by the radius in each direction, in loops that the compiler vectorises.
class ShiftedSums {
 public:
  explicit ShiftedSums(const EdgeField& field) : width_(field.width), height_(field.height) {
    for (int i = 0; i < coarse_directions / 2; ++i) {
      const Direction& ray = rays_[i];
      std::vector<float> plane(field.cosine.size());
      for (std::size_t k = 0; k < plane.size(); ++k) {
        plane[k] = field.cosine[k] * ray.double_cosine + field.sine[k] * ray.double_sine;
      }
      across_.push_back(std::move(plane));
    }
  }

  /// Computes the merit of the circle of this radius around each pixel's centre.
  void compute_merits(int radius, const CircleRange& range, std::span<float> merit) const {
    std::vector<float> sum(merit.size());
    std::vector<float> samples(merit.size());
    std::vector<float> roots(merit.size(), 0.0F);
    std::vector<float> sectors_seen(merit.size(), 0.0F);
    std::vector<float> visible(merit.size(), 0.0F);
    constexpr int directions_per_sector = coarse_directions / SectorScore::sectors;
    for (int sector = 0; sector < SectorScore::sectors; ++sector) {
      std::fill(sum.begin(), sum.end(), 0.0F);
      std::fill(samples.begin(), samples.end(), 0.0F);
      for (int i = sector * directions_per_sector; i < (sector + 1) * directions_per_sector; ++i) {
        add_shifted_plane(i, radius, sum, samples);
      }
      for (std::size_t k = 0; k < merit.size(); ++k) {
        const float mean = std::max(0.0F, sum[k]) / std::max(1.0F, samples[k]);
        roots[k] += std::sqrt(mean);
        sectors_seen[k] += samples[k] > 0 ? 1.0F : 0.0F;
        visible[k] += samples[k];
      }
    }
    for (std::size_t k = 0; k < merit.size(); ++k) {
      const float mean_root = roots[k] / std::max(1.0F, sectors_seen[k]);
      merit[k] = static_cast<float>(
          figure_of_merit({mean_root * mean_root, visible[k] / coarse_directions}, range));
    }
  }

 private:
  void add_shifted_plane(int direction, int radius, std::vector<float>& sum,
                         std::vector<float>& samples) const {
    const Direction& ray = rays_[direction];
    const std::vector<float>& plane = across_[direction % (coarse_directions / 2)];
    const int du = static_cast<int>(std::lround(radius * ray.cosine));
    const int dv = static_cast<int>(std::lround(radius * ray.sine));
    const int from = std::max(0, -du);
    const int to = std::min(width_, width_ - du);
    for (int v = std::max(0, -dv); v < std::min(height_, height_ - dv); ++v) {
      float* out = sum.data() + static_cast<std::ptrdiff_t>(v) * width_;
      float* seen = samples.data() + static_cast<std::ptrdiff_t>(v) * width_;
      const float* in = plane.data() + static_cast<std::ptrdiff_t>(v + dv) * width_ + du;
      for (int u = from; u < to; ++u) {
        out[u] += in[u];
        seen[u] += 1.0F;
      }
    }
  }

  int width_;
  int height_;
  std::array<Direction, coarse_directions> rays_ = make_directions();
  std::vector<std::vector<float>> across_;  ///< opposite directions share a plane
};

struct EdgePoint {
  double u = 0.0;
  double v = 0.0;
};

/// Finds the strongest edge on the ray within `reach` px of the circle; edges near the circle are
/// preferred.
std::optional<EdgePoint> find_edge_on_ray(std::span<const SmoothPlanes> images,
                                          const FieldCircle& circle, double cosine, double sine,
                                          double reach) {
  constexpr double step = 0.5;
  const int half = static_cast<int>(reach / step);
  const int count = 2 * half + 1;
  std::vector<double> strength(count, 0.0);
  for (const SmoothPlanes& image : images) {
    for (int i = 0; i < count; ++i) {
      const double r = circle.radius + (i - half) * step;
      const auto point = [&](double at) {
        return std::pair{circle.u + at * cosine, circle.v + at * sine};
      };
      const auto [u0, v0] = point(r - 0.5);
      const auto [u1, v1] = point(r + 0.5);
      if (std::min({u0, v0, u1, v1}) < 0.5 || std::max(u0, u1) > image.width - 0.5 ||
          std::max(v0, v1) > image.height - 0.5) {
        continue;
      }
      double slope = 0;
      for (const std::vector<float>& plane : image.channels) {
        const double rise =
            sample_bilinear(image, plane, u1, v1) - sample_bilinear(image, plane, u0, v0);
        slope = std::max(slope, std::abs(rise));
      }
      const double scale = image.slope_scale;
      strength[i] += slope * slope / (slope * slope + scale * scale);
    }
  }
  const double share = 1.0 / static_cast<double>(images.size());
  for (double& value : strength) value *= share;
  int best = -1;
  double best_merit = 0;
  for (int i = 1; i + 1 < count; ++i) {
    const double here = strength[i];
    if (here < 0.15 || here < strength[i - 1] || here < strength[i + 1]) continue;
    const double off = static_cast<double>(i - half) / (half + 1);
    const double merit = here * (1 - off * off);
    if (merit > best_merit) {
      best_merit = merit;
      best = i;
    }
  }
  if (best < 0) return std::nullopt;
  const double before = strength[best - 1];
  const double here = strength[best];
  const double after = strength[best + 1];
  const double curvature = before - 2 * here + after;
  const double shift =
      curvature < 0 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0;
  const double r = circle.radius + (best - half + shift) * step;
  return EdgePoint{circle.u + r * cosine, circle.v + r * sine};
}

/// The least-squares problem of `minimise` for a circle through points, with Tukey weights of their
/// distances to it.
class CircleProblem {
 public:
  using Equations = DenseEquations<3>;

  CircleProblem(const std::vector<EdgePoint>& points, const FieldCircle& start)
      : points_(points), fit_{.circle = start} {}

  bool linearise(Equations& equations) {
    constexpr double tukey = 4.685;  // 95 % efficiency for normal errors
    constexpr int min_points = 12;
    const FieldCircle& circle = fit_.circle;
    std::vector<double> deviations;
    for (const EdgePoint& p : points_) {
      deviations.push_back(std::abs(std::hypot(p.u - circle.u, p.v - circle.v) - circle.radius));
    }
    // Interpolated edge positions are accurate to a tenth of a pixel at best.
    const double scale = tukey * std::max(0.1, 1.4826 * upper_median(deviations));
    equations.set_zero();
    double weights = 0;
    double squares = 0;
    int used = 0;
    for (const EdgePoint& p : points_) {
      const double distance = std::hypot(p.u - circle.u, p.v - circle.v);
      const double residual = distance - circle.radius;
      if (distance == 0 || std::abs(residual) >= scale) continue;
      const double t = residual / scale;
      const double weight = tukey_weight(t * t);
      const Eigen::Vector3d row((p.u - circle.u) / distance, (p.v - circle.v) / distance, 1.0);
      equations.matrix += weight * row * row.transpose();
      equations.right += weight * residual * row;
      weights += weight;
      squares += weight * residual * residual;
      ++used;
    }
    if (used < min_points) return false;
    fit_.residual = std::sqrt(squares / weights);
    return true;
  }

  bool move(const Eigen::Vector3d& step) {
    constexpr double settled_px = 1e-4;
    fit_.circle.u += step(0);
    fit_.circle.v += step(1);
    fit_.circle.radius += step(2);
    return fit_.circle.radius <= 0 || step.norm() < settled_px;
  }

  [[nodiscard]] const CircleFit& fit() const { return fit_; }

 private:
  const std::vector<EdgePoint>& points_;
  CircleFit fit_;
};

/// Fits a circle by robust least squares; the residual is the weighted root mean square distance.
/// nullopt if the points do not determine a circle.
std::optional<CircleFit> fit_circle_to_points(const std::vector<EdgePoint>& points,
                                              FieldCircle circle) {
  CircleProblem problem(points, circle);
  CircleProblem::Equations equations;
  // Rejects arcs that are too short to determine centre and radius.
  equations.min_reciprocal_condition = 1e-5;
  const LeastSquaresReport solved = minimise(problem, equations, {.max_steps = 20});
  if (!solved.solvable || problem.fit().circle.radius <= 0) return std::nullopt;
  return problem.fit();
}

}  // namespace

CircleScore score_circle(const EdgeField& field, const FieldCircle& circle,
                         EdgeAveraging averaging) {
  const int count = sample_count(circle.radius, 3.0);
  SectorScore total;
  // Steps around the circle by rotating a unit vector; rounding stays below 1e-12.
  const double step_cosine = std::cos(2 * std::numbers::pi / count);
  const double step_sine = std::sin(2 * std::numbers::pi / count);
  double next_cosine = 1;
  double next_sine = 0;
  for (int i = 0; i < count; ++i) {
    const double cosine = next_cosine;
    const double sine = next_sine;
    next_cosine = cosine * step_cosine - sine * step_sine;
    next_sine = sine * step_cosine + cosine * step_sine;
    const double u = circle.u + circle.radius * cosine;
    const double v = circle.v + circle.radius * sine;
    if (u < 0 || v < 0 || u > field.width || v > field.height) continue;
    const auto across = static_cast<float>(cosine * cosine - sine * sine);
    const auto along = static_cast<float>(2 * cosine * sine);
    total.add(i, count,
              sample_bilinear(field, field.cosine, u, v) * across +
                  sample_bilinear(field, field.sine, u, v) * along);
  }
  return total.score(count, averaging);
}

std::vector<FieldCircle> circle_candidates(const EdgeField& field, const CircleRange& range,
                                           int count) {
  const int lowest = std::max(2, static_cast<int>(std::floor(range.min_radius)));
  const int highest = std::max(lowest, static_cast<int>(std::ceil(range.max_radius)));
  const int radii = highest - lowest + 1;
  const std::size_t area = field.index(0, field.height);
  const auto at = [&](int u, int v, int r) { return r * area + field.index(u, v); };
  const ShiftedSums sums(field);
  std::vector<float> merit(area * radii);
  for (int r = 0; r < radii; ++r) {
    sums.compute_merits(lowest + r, range, std::span(merit).subspan(r * area, area));
  }
  struct Candidate {
    float merit;
    FieldCircle circle;
  };
  const auto is_local_maximum = [&](int u, int v, int r) {
    const float here = merit[at(u, v, r)];
    for (int k = std::max(0, r - 1); k <= std::min(radii - 1, r + 1); ++k) {
      for (int y = std::max(0, v - 1); y <= std::min(field.height - 1, v + 1); ++y) {
        for (int x = std::max(0, u - 1); x <= std::min(field.width - 1, u + 1); ++x) {
          if (merit[at(x, y, k)] > here) return false;
        }
      }
    }
    return true;
  };
  // A mirror has several circles around its centre: disc, holder, arcs of the scene. Circles are
  // therefore ranked by their own merit plus half of the root of the summed squared merits of all
  // circles around the same centre.
  std::vector<float> centre_merit(area, 0.0F);
  for (int r = 0; r < radii; ++r) {
    for (std::size_t k = 0; k < area; ++k) {
      const float here = std::max(0.0F, merit[r * area + k]);
      centre_merit[k] += here * here;
    }
  }
  std::vector<Candidate> candidates;
  for (int r = 0; r < radii; ++r) {
    for (int v = 0; v < field.height; ++v) {
      for (int u = 0; u < field.width; ++u) {
        const float here = merit[at(u, v, r)];
        if (here <= 0 || !is_local_maximum(u, v, r)) continue;
        const float total = here + 0.5F * std::sqrt(centre_merit[field.index(u, v)]);
        candidates.push_back({total, {u + 0.5, v + 0.5, static_cast<double>(lowest + r)}});
      }
    }
  }
  std::ranges::stable_sort(candidates, std::greater<>(), &Candidate::merit);
  std::vector<FieldCircle> result;
  for (const Candidate& candidate : candidates) {
    if (std::ssize(result) == count) break;
    result.push_back(candidate.circle);
  }
  return result;
}

std::vector<FieldCircle> concentric_candidates(const EdgeField& field, double u, double v,
                                               double centre_reach, const CircleRange& range,
                                               double step) {
  const auto rays = make_directions();
  std::vector<double> merits;
  std::vector<FieldCircle> circles;
  for (double radius = range.min_radius; radius <= range.max_radius; radius += step) {
    double best = -1;
    FieldCircle best_circle{u, v, radius};
    for (double y = -centre_reach; y <= centre_reach; y += step) {
      for (double x = -centre_reach; x <= centre_reach; x += step) {
        const FieldCircle circle{u + x, v + y, radius};
        const double merit = coarse_merit(field, rays, circle, range);
        if (merit > best) {
          best = merit;
          best_circle = circle;
        }
      }
    }
    merits.push_back(best);
    circles.push_back(best_circle);
  }
  std::vector<FieldCircle> result;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const bool peak = merits[i] > 0 && (i == 0 || merits[i] >= merits[i - 1]) &&
                      (i + 1 == circles.size() || merits[i] >= merits[i + 1]);
    if (peak) result.push_back(circles[i]);
  }
  return result;
}

FieldCircle climb_to_maximum(const EdgeField& field, const FieldCircle& start,
                             const CircleRange& range) {
  FieldCircle best = start;
  double best_merit = figure_of_merit(score_circle(field, best, range.averaging), range);
  for (double step = 2; step >= 0.25; step /= 2) {
    for (int round = 0; round < 20; ++round) {
      const FieldCircle from = best;
      bool better = false;
      for (int du = -1; du <= 1; ++du) {
        for (int dv = -1; dv <= 1; ++dv) {
          for (int dr = -1; dr <= 1; ++dr) {
            const FieldCircle next{from.u + du * step, from.v + dv * step, from.radius + dr * step};
            if (next.radius < 2) continue;
            const double merit = figure_of_merit(score_circle(field, next, range.averaging), range);
            if (merit > best_merit) {
              best_merit = merit;
              best = next;
              better = true;
            }
          }
        }
      }
      if (!better) break;
    }
  }
  return best;
}

double fit_tolerance_px(double radius) {
  return std::max(0.75, 0.002 * radius);
}

std::optional<CircleFit> fit_circle(std::span<const SmoothPlanes> images,
                                    const FieldCircle& start) {
  require(!images.empty(), "number of images", 0, "at least 1");
  FieldCircle circle = start;
  CircleFit fit;
  // Half-widths of the search window, in px: first the error of the coarse search, last the
  // width of an edge.
  for (const double reach :
       {std::max(4.0, 0.03 * start.radius), std::max(3.0, 0.01 * start.radius), 2.5, 2.5}) {
    const int count = sample_count(circle.radius, 1.5);
    std::vector<EdgePoint> points;
    int visible = 0;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const double u = circle.u + circle.radius * std::cos(angle);
      const double v = circle.v + circle.radius * std::sin(angle);
      if (u < 1 || v < 1 || u > images[0].width - 1 || v > images[0].height - 1) continue;
      ++visible;
      const auto point = find_edge_on_ray(images, circle, std::cos(angle), std::sin(angle), reach);
      if (point) points.push_back(*point);
    }
    if (visible < 24 || static_cast<int>(points.size()) * 4 < visible) return std::nullopt;
    const auto next = fit_circle_to_points(points, circle);
    if (!next || std::hypot(next->circle.u - start.u, next->circle.v - start.v) +
                         std::abs(next->circle.radius - start.radius) >
                     std::max(8.0, 0.06 * start.radius)) {
      return std::nullopt;
    }
    fit = *next;
    circle = fit.circle;
    const auto near = std::count_if(points.begin(), points.end(), [&](const EdgePoint& p) {
      return std::abs(std::hypot(p.u - circle.u, p.v - circle.v) - circle.radius) <=
             fit_tolerance_px(circle.radius);
    });
    fit.support = static_cast<double>(near) / visible;
  }
  return fit;
}

}  // namespace panonav
