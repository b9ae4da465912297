#include "panonav/pipeline/picture_guess.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "panonav/camera/calibrate_dual_fisheye.hpp"
#include "panonav/camera/find_mirror.hpp"
#include "panonav/camera/mirror_camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/view_encoder.hpp"

namespace panonav {

namespace {

/// Largest relative difference of the width of a sphere from twice its height.
constexpr double sphere_tolerance = 0.02;

double aspect_ratio(const Image& image) {
  return static_cast<double>(image.width()) / image.height();
}

/// Keeps every n-th pixel of a grey image, so that its longer side is at most `side_px`.
Image subsample(const Image& image, int side_px) {
  const int every = (std::max(image.width(), image.height()) + side_px - 1) / side_px;
  Image small(image.width() / every, image.height() / every, 1);
  const Image grey = to_grey(image.view());
  for (int v = 0; v < small.height(); ++v) {
    for (int u = 0; u < small.width(); ++u) small.at(u, v) = grey.at(u * every, v * every);
  }
  return small;
}

/// True if pixels outside the circles inscribed in both halves are dark, compared with those
/// inside.
bool has_two_circles(const Image& grey) {
  const double radius = 0.5 * grey.height();
  double inside = 0.0;
  double outside = 0.0;
  int inside_count = 0;
  int outside_count = 0;
  for (int v = 0; v < grey.height(); ++v) {
    for (int u = 0; u < grey.width(); ++u) {
      const double from_left = u < grey.width() / 2 ? 0.25 * grey.width() : 0.75 * grey.width();
      const double off = std::hypot(u + 0.5 - from_left, v + 0.5 - radius) / radius;
      if (off < 0.85) {
        inside += grey.at(u, v);
        ++inside_count;
      } else if (off > 1.08) {
        outside += grey.at(u, v);
        ++outside_count;
      }
    }
  }
  constexpr double max_dark_share = 0.2;
  return outside_count > 0 && inside_count > 0 && inside > 0.0 &&
         outside / outside_count < max_dark_share * inside / inside_count;
}

/// Median difference of the first and last column, in median differences of adjacent columns. About
/// 1 for a panorama that covers a full turn.
double compute_edge_step(const Image& grey) {
  const auto difference = [&](int a, int b) {
    double sum = 0.0;
    for (int v = 0; v < grey.height(); ++v) sum += std::abs(grey.at(a, v) - grey.at(b, v));
    return sum / grey.height();
  };
  std::vector<double> steps;
  for (int u = 0; u + 1 < grey.width(); ++u) steps.push_back(difference(u, u + 1));
  // A uniform image has no steps; a grey level keeps the ratio finite.
  return difference(0, grey.width() - 1) / (1.0 + upper_median_in_place(std::span(steps)));
}

bool covers_full_turn(std::span<const Image> greys) {
  // Unrelated edges differ by some ten steps; adjacent columns at a sharp object by three or four.
  constexpr double max_edge_step = 5.0;
  std::vector<double> steps;
  for (const Image& grey : greys) steps.push_back(compute_edge_step(grey));
  return upper_median_in_place(std::span(steps)) < max_edge_step;
}

PictureGuess guess_sphere() {
  PictureGuess guess{.form = PictureForm::sphere, .source = PictureSource{}, .explanation = {}};
  guess.source->kind = PictureKind::equirectangular;
  guess.source->layout.elevations = ElevationBand{-0.5 * std::numbers::pi, 0.5 * std::numbers::pi};
  guess.source->layout.kept_elevations = default_equirectangular_band;
  guess.explanation =
      "The images are twice as wide as high, and their left edge continues the right edge: they "
      "show the whole sphere.";
  return guess;
}

PictureGuess guess_strip(const Image& first) {
  const double half_rad = std::numbers::pi / aspect_ratio(first);
  PictureGuess guess{.form = PictureForm::strip, .source = PictureSource{}, .explanation = {}};
  guess.source->kind = PictureKind::panorama;
  guess.source->layout.elevations = ElevationBand{-half_rad, half_rad};
  guess.explanation =
      "The images are strips whose left edge continues the right edge: panoramas of a full turn. "
      "Assumed: square pixels and the horizon in the middle, so elevations from " +
      format_fixed(degrees(-half_rad), 0) + " to " + format_fixed(degrees(half_rad), 0) +
      " degrees.";
  return guess;
}

PictureGuess guess_lenses(std::span<const Image> samples, Executor& executor) {
  PictureGuess guess{.form = PictureForm::two_lenses, .source = std::nullopt, .explanation = {}};
  std::optional<DualFisheyeCalibration> best;
  // Cameras are built with the lenses upright, or with the circles lying on their sides.
  constexpr std::array<std::pair<double, double>, 3> rolls_deg{
      {{0.0, 0.0}, {90.0, -90.0}, {-90.0, 90.0}}};
  const std::array view{samples.front().view()};
  for (const auto& [left_deg, right_deg] : rolls_deg) {
    DualFisheyeCalibration::Knowledge knowledge;
    knowledge.left_roll_rad = radians(left_deg);
    knowledge.right_roll_rad = radians(right_deg);
    auto found = calibrate_dual_fisheye(view, knowledge, executor);
    auto* calibration = std::get_if<DualFisheyeCalibration>(&found);
    if (calibration == nullptr) continue;
    if (!best || calibration->inlier_share > best->inlier_share) best = std::move(*calibration);
  }
  guess.explanation = "The images show two circles: the raw images of a camera with two lenses. ";
  if (!best) {
    guess.explanation +=
        "One image alone does not show how the lenses fit together. Take four images at one place, "
        "with objects some metres away, and rotate the camera on its stand by about 90 degrees "
        "between them; then calibrate the camera from them. Or use the stitched images of the "
        "camera's own program.";
    return guess;
  }
  guess.source.emplace();
  guess.source->kind = PictureKind::mirror;
  guess.source->camera = best->camera;
  guess.source->layout.kept_elevations = default_equirectangular_band;
  guess.explanation += "They were calibrated from one image, to " +
                       format_fixed(degrees(best->azimuth_deviation_rad), 1) + " degrees.";
  return guess;
}

std::optional<PictureGuess> guess_mirror(std::span<const Image> samples) {
  std::vector<Image> small;
  constexpr int side_px = 640;
  for (const Image& sample : samples) small.push_back(subsample(sample, side_px));
  std::vector<ImageView> views;
  for (const Image& image : small) views.push_back(image.view());
  auto circle = find_mirror(views);
  if (!circle) return std::nullopt;
  PictureGuess guess{.form = PictureForm::mirror, .source = std::nullopt, .explanation = {}};
  guess.explanation = "The images show a ring: a camera with a mirror. ";
  if (is_scattered(*circle)) {
    guess.explanation +=
        "It is not at the same pixels in all images, so the camera has moved relative to the "
        "mirror, or the circle is no mirror. Fix the camera to the mirror and record again.";
    return guess;
  }
  const double scale = static_cast<double>(samples.front().width()) / small.front().width();
  circle->image_size = samples.front().size();
  circle->centre = {circle->centre.u_px * scale, circle->centre.v_px * scale};
  circle->rim_radius_px *= scale;
  if (circle->inner_radius_px) *circle->inner_radius_px *= scale;
  guess.source.emplace();
  guess.source->kind = PictureKind::mirror;
  guess.source->camera =
      camera_from_mirror(*circle, {.model = EquiangularModel{radians(-60.0), radians(20.0)}});
  guess.explanation +=
      "Assumed: the mirror shows elevations from -60 degrees near the middle to 20 degrees at the "
      "rim, and the camera points up into it.";
  return guess;
}

PictureGuess refuse_ordinary(const Image& first, const std::string& why) {
  return {PictureForm::ordinary, std::nullopt,
          "The images have " + std::to_string(first.width()) + " x " +
              std::to_string(first.height()) + " px and " + why +
              ". panonav needs images that show all directions at once: those of a 360 degree "
              "camera, of a mirror camera, or panoramas of a full turn."};
}

/// An edge that is nearly upright.
struct UprightEdge {
  double cosine = 0.0;
  double sine = 0.0;
  double slope = 0.0;
  double weight = 0.0;
  std::size_t half = 0;  ///< 0 or 1: every second of eight sectors of azimuth
};

std::vector<UprightEdge> find_upright_edges(const Panorama& panorama) {
  constexpr double max_slope = 0.4;  // 22 degrees
  const ElevationBand& band = *panorama.elevations();
  const double row_rad = (band.top_rad - band.bottom_rad) / panorama.rows();
  const double column_rad = 2.0 * std::numbers::pi / panorama.columns();
  std::vector<UprightEdge> edges;
  std::vector<double> weights;
  // Differences over a window, as the slope of single pixels is coarse.
  constexpr int reach = 3;
  const int columns = panorama.columns();
  for (int y = reach; y + reach < panorama.rows(); ++y) {
    for (int c = 0; c < columns; ++c) {
      double by_azimuth = 0.0;
      double by_elevation = 0.0;
      for (int i = -reach; i <= reach; ++i) {
        for (int j = -reach; j <= reach; ++j) {
          const double value = panorama.at(y + i, (c + j + columns) % columns);
          by_azimuth += j * value;
          by_elevation -= i * value;
        }
      }
      by_azimuth /= column_rad;
      by_elevation /= row_rad;
      if (std::abs(by_elevation) > max_slope * std::abs(by_azimuth) || by_azimuth == 0.0) continue;
      const double azimuth = panorama.azimuth_rad(c);
      edges.push_back({std::cos(azimuth), std::sin(azimuth), -by_elevation / by_azimuth,
                       std::abs(by_azimuth), static_cast<std::size_t>(8 * c / columns % 2)});
      weights.push_back(edges.back().weight);
    }
  }
  // Keeps the clearest tenth: noise has slopes of all sizes.
  constexpr std::size_t min_edges = 100;
  if (edges.size() < 10 * min_edges) return {};
  const double limit = quantile(weights, 0.9);
  std::erase_if(edges, [&](const UprightEdge& edge) { return edge.weight < limit; });
  return edges;
}

/// Leans are tried in steps of a degree, up to this angle in both directions.
constexpr int max_lean_deg = 20;
constexpr int leans_per_side = 2 * max_lean_deg + 1;
constexpr std::size_t lean_count = leans_per_side * leans_per_side;
constexpr std::size_t upright_lean = lean_count / 2;
/// Fewest images from which a lean is estimated.
constexpr std::size_t min_lean_images = 8;

struct LeanDegrees {
  int a = 0;  ///< slope of edges at azimuth 0
  int b = 0;  ///< at azimuth 90 degrees
};

LeanDegrees lean_at(std::size_t index) {
  const int i = static_cast<int>(index);
  return {i / leans_per_side - max_lean_deg, i % leans_per_side - max_lean_deg};
}

/// Share of the edges of one image that each lean explains, of two halves of the azimuths. A lean
/// of the camera fits both halves; slanted things and chance do not.
using LeanScores = std::array<std::vector<double>, 2>;

std::optional<LeanScores> score_leans(const Panorama& panorama) {
  if (!panorama.elevations() || panorama.rows() < 16 || panorama.columns() < 16) {
    return std::nullopt;
  }
  const std::vector<UprightEdge> edges = find_upright_edges(panorama);
  if (edges.empty()) return std::nullopt;
  double total = 0.0;
  for (const UprightEdge& edge : edges) total += edge.weight;
  constexpr double slope_deviation = 0.04;  // of an edge's slope, some 2 degrees (chosen)
  LeanScores scores{std::vector<double>(lean_count), std::vector<double>(lean_count)};
  for (std::size_t lean = 0; lean < lean_count; ++lean) {
    const LeanDegrees degrees = lean_at(lean);
    const double a = radians(degrees.a);
    const double b = radians(degrees.b);
    for (const UprightEdge& edge : edges) {
      const double off = (edge.slope - a * edge.cosine - b * edge.sine) / slope_deviation;
      scores.at(edge.half)[lean] += edge.weight / (total * (1.0 + off * off));
    }
  }
  return scores;
}

std::size_t find_best_lean(const std::vector<double>& scores) {
  return static_cast<std::size_t>(std::ranges::max_element(scores) - scores.begin());
}

void add_scores(std::vector<double>& sum, const std::vector<double>& scores, double factor = 1.0) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += factor * scores[i];
}

/// True if the mean of the values is above 0 by more than three standard errors.
bool is_significantly_positive(const std::vector<double>& values) {
  const double average = mean(values);
  double squares = 0.0;
  for (const double value : values) squares += (value - average) * (value - average);
  const auto n = static_cast<double>(values.size());
  return average > 3.0 * std::sqrt(squares / (n * (n - 1.0)));
}

/// Returns the lean that all images have in common, by all of their edges. nullopt unless a lean
/// that is estimated from one half of the azimuths of all other images explains the edges in the
/// other half of an image better than no lean does, for both halves.
std::optional<double> find_common_lean_deg(const std::vector<LeanScores>& images) {
  LeanScores sums{std::vector<double>(lean_count), std::vector<double>(lean_count)};
  for (const LeanScores& image : images) {
    for (const std::size_t half : {0U, 1U}) add_scores(sums.at(half), image.at(half));
  }
  for (const std::size_t half : {0U, 1U}) {
    std::vector<double> gains;
    for (const LeanScores& image : images) {
      std::vector<double> others = sums.at(1 - half);
      add_scores(others, image.at(1 - half), -1.0);
      const std::vector<double>& own = image.at(half);
      gains.push_back(own[find_best_lean(others)] - own[upright_lean]);
    }
    if (!is_significantly_positive(gains)) return std::nullopt;
  }
  add_scores(sums[0], sums[1]);
  const LeanDegrees best = lean_at(find_best_lean(sums[0]));
  return std::hypot(best.a, best.b);
}

/// Returns the root mean square of the leans of single images, whatever their directions: the
/// scalar product of independent estimates from both halves of the azimuths has the square of the
/// lean as its mean. nullopt if that is not significant.
std::optional<double> find_varying_lean_deg(const std::vector<LeanScores>& images) {
  std::vector<double> squares;
  for (const LeanScores& image : images) {
    const LeanDegrees first = lean_at(find_best_lean(image[0]));
    const LeanDegrees second = lean_at(find_best_lean(image[1]));
    squares.push_back(first.a * second.a + first.b * second.b);
  }
  if (!is_significantly_positive(squares)) return std::nullopt;
  return std::sqrt(mean(squares));
}

}  // namespace

PictureGuess guess_pictures(std::span<const Image> samples, Executor& executor) {
  if (samples.empty()) throw ContractError("samples", 0.0, "1 or more");
  const Image& first = samples.front();
  const double ratio = aspect_ratio(first);
  constexpr int side_px = 512;
  std::vector<Image> greys;
  for (const Image& sample : samples) greys.push_back(subsample(sample, side_px));
  const bool is_sphere_shaped = std::abs(ratio - 2.0) <= 2.0 * sphere_tolerance;
  if (is_sphere_shaped) {
    const auto circles = std::ranges::count_if(greys, has_two_circles);
    if (2 * static_cast<std::size_t>(circles) > greys.size()) {
      return guess_lenses(samples, executor);
    }
    if (covers_full_turn(greys)) return guess_sphere();
    return refuse_ordinary(first, "their left edge does not continue the right edge");
  }
  if (ratio > 2.0) {
    if (covers_full_turn(greys)) return guess_strip(first);
    return refuse_ordinary(first,
                           "their left edge does not continue the right edge, so they do not cover "
                           "a full turn");
  }
  if (std::min(first.width(), first.height()) >= 32) {
    if (auto mirror = guess_mirror(samples)) return std::move(*mirror);
  }
  return refuse_ordinary(first, "show neither a ring nor a full turn");
}

std::optional<Lean> estimate_lean(std::span<const Panorama> panoramas, Executor& executor) {
  std::vector<std::optional<LeanScores>> all(panoramas.size());
  parallel_for(executor, panoramas.size(),
               [&](std::size_t i) { all[i] = score_leans(panoramas[i]); });
  std::vector<LeanScores> images;
  for (auto& scores : all) {
    if (scores) images.push_back(std::move(*scores));
  }
  if (images.size() < min_lean_images) return std::nullopt;
  const std::optional<double> common_deg = find_common_lean_deg(images);
  const std::optional<double> varying_deg = find_varying_lean_deg(images);
  // Leans of single images include the common one, so they exceed it where both are found.
  if (varying_deg && (!common_deg || *varying_deg > std::numbers::sqrt2 * *common_deg)) {
    return Lean{radians(*varying_deg), false};
  }
  if (common_deg) return Lean{radians(*common_deg), true};
  return std::nullopt;
}

int count_carrier_rows(std::span<const Panorama> panoramas) {
  constexpr std::size_t min_panoramas = 8;
  // Share of a row's structure that the mean of all panoramas keeps: 1 if all are equal, and about
  // one over their number if they are unrelated.
  constexpr double min_common_share = 0.6;
  if (panoramas.size() < min_panoramas) return 0;
  const auto count = static_cast<double>(panoramas.size());
  const int columns = panoramas.front().columns();
  const auto common_share = [&](int y) {
    std::vector<double> mean(static_cast<std::size_t>(columns), 0.0);
    double energy = 0.0;
    for (const Panorama& panorama : panoramas) {
      double average = 0.0;
      for (const float value : panorama.row(y)) average += static_cast<double>(value) / columns;
      for (int c = 0; c < columns; ++c) {
        const double off = panorama.at(y, c) - average;
        mean[static_cast<std::size_t>(c)] += off / count;
        energy += off * off / count;
      }
    }
    double kept = 0.0;
    for (const double value : mean) kept += value * value;
    return energy > 0.0 ? kept / energy : 1.0;
  };
  int rows = 0;
  while (rows < panoramas.front().rows() &&
         common_share(panoramas.front().rows() - 1 - rows) > min_common_share) {
    ++rows;
  }
  return rows;
}

}  // namespace panonav
