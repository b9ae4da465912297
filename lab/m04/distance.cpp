// [M04] figures 7 and 8: dissimilarity against distance, and similarity over the whole floor.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

constexpr double line_step_m = 0.02;
constexpr double line_length_m = 4.0;

// A function of distance, sampled at 0, line_step_m, 2 line_step_m, ...
using Curve = std::vector<double>;

double bin_distance_m(std::size_t bin) {
  return line_step_m * static_cast<double>(bin);
}

// Returns the largest deviation of the first `count` values from their least-squares line.
double deviation_from_line(const Curve& curve, std::size_t count) {
  const auto n = static_cast<double>(count);
  double sx = 0.0;
  double sy = 0.0;
  double sxx = 0.0;
  double sxy = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = bin_distance_m(i);
    sx += x;
    sy += curve[i];
    sxx += x * x;
    sxy += x * curve[i];
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  const double start = (sy - slope * sx) / n;
  double largest = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    largest = std::max(largest, std::abs(curve[i] - start - slope * bin_distance_m(i)));
  }
  return largest;
}

// Returns the largest distance up to which all values of the curve are within `tolerance` of one
// straight line.
double linear_range_m(const Curve& curve, double tolerance) {
  std::size_t last = 2;
  for (std::size_t count = 4; count <= curve.size(); ++count) {
    if (deviation_from_line(curve, count) > tolerance) break;
    last = count - 1;
  }
  return bin_distance_m(last);
}

double find_distance_reaching_m(const Curve& curve, double value) {
  const auto found = std::ranges::find_if(curve, [&](double v) { return v >= value; });
  return bin_distance_m(static_cast<std::size_t>(found - curve.begin()) - (found == curve.end()));
}

// Draws a free straight line of `line_length_m`, or the longest one of `line_draws` trials.
std::pair<Point2, Point2> sample_straight_line(const simulation::FreeSpace& space, Random& random) {
  std::optional<std::pair<Point2, Point2>> best;
  constexpr int line_draws = 200;
  for (int draw = 0; draw < line_draws; ++draw) {
    const Pose2 start = space.random_pose(random);
    double length = 0.0;
    Point2 end = start.position();
    while (length < line_length_m - 1e-9) {
      const double next = length + line_step_m;
      const Point2 there{start.x_m + next * std::cos(start.heading_rad),
                         start.y_m + next * std::sin(start.heading_rad)};
      if (!space.is_free_between(end, there)) break;
      end = there;
      length = next;
    }
    if (!best || length > distance(best->first, best->second)) best = {start.position(), end};
    if (length >= line_length_m - 1e-9) break;
  }
  return *best;
}

// Accumulates the mean value at each distance.
struct CurveSums {
  Curve sums;
  Curve counts;

  void add(std::size_t bin, double value) {
    if (bin >= sums.size()) {
      sums.resize(bin + 1);
      counts.resize(bin + 1);
    }
    sums[bin] += value;
    counts[bin] += 1.0;
  }
  [[nodiscard]] Curve mean() const {
    Curve curve;
    for (std::size_t bin = 0; bin < sums.size(); ++bin) curve.push_back(sums[bin] / counts[bin]);
    return curve;
  }
};

class DistanceCurve final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    Random random(place.seed, 79);
    CurveSums sums;
    for (std::size_t line = 0; line < lines_per_scene; ++line) {
      const auto [from, to] = sample_straight_line(*place.free_space, random);
      add_line(place, from, to, line, sums, executor);
    }
    Curve curve = sums.mean();
    require(curve.size() >= 50, "length of the straight lines [m]",
            bin_distance_m(curve.size() - 1), ">= 1 m");
    // The absolute dissimilarity depends on the place and has no meaning by itself [M04 section
    // 2.2]. It is divided by the level of far views, the mean over the farther half of all
    // distances.
    const auto middle = curve.begin() + static_cast<std::ptrdiff_t>(curve.size() / 2);
    const Curve far(middle, curve.end());
    const double level = mean(far);
    for (double& value : curve) value /= level;
    // Scale the single pair of this scene like its curve.
    if (single_pairs_.size() == curves_.size() + 1) {
      for (double& value : single_pairs_.back().y) value /= level;
    }
    noise_.push_back(curve[0]);
    linear_m_.push_back(linear_range_m(curve, linearity_tolerance));
    saturation_m_.push_back(find_distance_reaching_m(curve, 0.95));
    half_m_.push_back(find_distance_reaching_m(curve, 0.5));
    value_at_grid_spacing_.push_back(
        curve[static_cast<std::size_t>(std::lround(place.spacing_m / line_step_m))]);
    const auto quarter = static_cast<std::ptrdiff_t>(far.size() / 2);
    rise_after_saturation_.push_back(mean(Curve(far.begin() + quarter, far.end())) /
                                     mean(Curve(far.begin(), far.begin() + quarter)));
    curves_.push_back(std::move(curve));
  }

  void report(Reproduction& result) const override {
    require(!curves_.empty(), "places", 0.0, ">= 1");
    viewer::Series average{.label = "mean of " + std::to_string(curves_.size()) + " scenes",
                           .style = viewer::SeriesStyle::lines_and_points};
    std::size_t shared = curves_.front().size();
    for (const Curve& curve : curves_) shared = std::min(shared, curve.size());
    // Plot every value up to 30 cm, then one per 10 cm, so that error bars can be distinguished.
    for (std::size_t bin = 0; bin < shared; bin += bin_distance_m(bin) < 0.299 ? 1 : 5) {
      std::vector<double> here;
      for (const Curve& curve : curves_) here.push_back(curve[bin]);
      add_point(average, bin_distance_m(bin), mean_figure(here));
    }
    viewer::LinePlot plot{.title = "Dissimilarity against distance ([M04] figure 7)",
                          .x_label = "distance between the views [m]",
                          .y_label = "dissimilarity (1: level of far views)",
                          .series = single_pairs_};
    plot.series.push_back(average);
    add_plot(result, "fig07_dissimilarity_distance.svg",
             "Dissimilarity from one view, as the robot drives away from it (thin), and the mean "
             "over all pairs of views of all scenes with its 95 % interval: steep and straight at "
             "first, then bent, then level.",
             plot);
    add_row(result, "m04.fig7.noise",
            "figure 7: dissimilarity of two pictures of one place, as a share of far views",
            mean_figure(noise_), "");
    add_row(result, "m04.fig7.linear_range",
            "figure 7: linear range: largest distance up to which the curve stays within 2 % of "
            "the level of far views of one straight line (mean over scenes)",
            mean_figure(linear_m_), "m");
    add_row(result, "m04.fig7.half",
            "figure 7: distance at half the level of far views (mean over scenes)",
            mean_figure(half_m_), "m");
    add_row(result, "m04.fig7.saturation",
            "figure 7: distance at 95 % of the level of far views (mean over scenes)",
            mean_figure(saturation_m_), "m");
    add_row(result, "m04.fig7.at_25_cm",
            "figure 7: dissimilarity 25 cm away, as a share of far views",
            mean_figure(value_at_grid_spacing_), "");
    add_row(result, "m04.fig7.rise_after_saturation",
            "figure 7: level at 3 .. 4 m over that at 2 .. 3 m (1: fully saturated)",
            mean_figure(rise_after_saturation_), "");
  }

 private:
  // Adds all pairs of views along one straight line to `sums`.
  void add_line(const simulation::PlaceRecording& place, Point2 from, Point2 to, std::size_t line,
                CurveSums& sums, Executor& executor) {
    const auto steps = static_cast<std::size_t>(std::lround(distance(from, to) / line_step_m));
    std::vector<Pose2> poses;
    std::vector<Pose2> repeated_poses;
    for (std::size_t i = 0; i <= steps; ++i) {
      const double share = steps > 0 ? static_cast<double>(i) / static_cast<double>(steps) : 0.0;
      // The heading is arbitrary, because magnitudes do not depend on it.
      poses.push_back(
          {from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m), 0.0});
      if (i % repeat_interval == 0) repeated_poses.push_back(poses.back());
    }
    const std::uint64_t noise = place.seed * 100003U + 70000U + 5000U * line;
    const auto compute_signatures_at = [&](const std::vector<Pose2>& from_here,
                                           std::uint64_t seed) {
      return compute_signatures(
          simulation::capture_views(place, place.rendering, from_here, seed, {}, executor),
          m04_components, executor);
    };
    const auto views = compute_signatures_at(poses, noise);
    const auto repeated_views = compute_signatures_at(repeated_poses, noise + 2500U);
    for (std::size_t i = 0; i < views.size(); ++i) {
      // At distance 0 only noise distinguishes the two pictures.
      if (i % repeat_interval == 0)
        sums.add(0, dissimilarity_l1(views[i], repeated_views[i / repeat_interval]));
      for (std::size_t j = i + 1; j < views.size(); ++j) {
        sums.add(j - i, dissimilarity_l1(views[i], views[j]));
      }
    }
    // The paper shows single pairs: one reference view, and a robot that drives away from it.
    if (line > 0 || single_pairs_.size() >= shown_pairs) return;
    viewer::Series one{.label = "pair " + std::to_string(single_pairs_.size() + 1),
                       .style = viewer::SeriesStyle::lines};
    for (std::size_t j = 0; j < views.size(); ++j) {
      one.add(bin_distance_m(j), dissimilarity_l1(views[0], j == 0 ? repeated_views[0] : views[j]));
    }
    single_pairs_.push_back(std::move(one));
  }

  static constexpr std::size_t lines_per_scene = 2;
  static constexpr std::size_t repeat_interval = 10;  // every tenth view is taken twice
  static constexpr std::size_t shown_pairs = 5;
  static constexpr double linearity_tolerance = 0.02;

  std::vector<Curve> curves_;
  std::vector<viewer::Series> single_pairs_;
  std::vector<double> noise_;
  std::vector<double> linear_m_;
  std::vector<double> half_m_;
  std::vector<double> saturation_m_;
  std::vector<double> value_at_grid_spacing_;
  std::vector<double> rise_after_saturation_;
};

// Similarity of all references to a query: a map for the first query, rank correlations with
// distance for all.
class SimilaritySurface final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    const auto references = compute_signatures(place.references, m04_components, executor);
    for (const auto& query : place.queries) {
      const auto signature = compute_signature(query.panorama, m04_components);
      std::vector<double> values;
      std::vector<double> distances;
      for (std::size_t i = 0; i < references.size(); ++i) {
        values.push_back(dissimilarity_l1(signature, references[i]));
        distances.push_back(-distance(place.references[i].pose.position(), query.pose.position()));
      }
      const auto scaled = similarities(values);
      correlations_.push_back(rank_correlation(scaled, distances));
      if (!map_) map_ = make_similarity_map(place, query.pose.position(), scaled);
    }
  }

  void report(Reproduction& result) const override {
    require(map_.has_value(), "queries", 0.0, ">= 1");
    add_plot(
        result, "fig08_similarity_surface.svg",
        "Similarity is highest around the place where the view was taken and falls on all sides.",
        *map_);
    add_row(result, "m04.fig8.monotony",
            "figure 8: rank correlation of similarity with nearness over all references (1: it "
            "falls on all sides; median)",
            median_figure(correlations_), "");
  }

 private:
  static viewer::HeatMap make_similarity_map(const simulation::PlaceRecording& place, Point2 robot,
                                             const std::vector<double>& scaled) {
    Point2 low = place.references.front().pose.position();
    Point2 high = low;
    for (const auto& reference : place.references) {
      const Point2 p = reference.pose.position();
      low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
      high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
    }
    viewer::HeatMap map{
        .title =
            "Similarity at every reference view; cross: where the view was taken ([M04] figure 8)",
        .value_label = "similarity (0 .. 1000)"};
    map.spacing_m = place.spacing_m;
    map.first_cell = low;
    map.columns = static_cast<int>(std::lround((high.x_m - low.x_m) / map.spacing_m)) + 1;
    map.rows = static_cast<int>(std::lround((high.y_m - low.y_m) / map.spacing_m)) + 1;
    map.values.assign(static_cast<std::size_t>(map.columns) * map.rows, std::nan(""));
    for (std::size_t i = 0; i < place.references.size(); ++i) {
      const Point2 p = place.references[i].pose.position();
      const auto column = std::lround((p.x_m - low.x_m) / map.spacing_m);
      const auto row = std::lround((p.y_m - low.y_m) / map.spacing_m);
      map.values[static_cast<std::size_t>(row) * map.columns + static_cast<std::size_t>(column)] =
          scaled[i];
    }
    map.crosses = {robot};
    return map;
  }

  std::optional<viewer::HeatMap> map_;
  std::vector<double> correlations_;
};

}  // namespace

std::unique_ptr<Experiment> make_distance_curve_experiment() {
  return std::make_unique<DistanceCurve>();
}
std::unique_ptr<Experiment> make_similarity_surface_experiment() {
  return std::make_unique<SimilaritySurface>();
}

}  // namespace panonav::lab
