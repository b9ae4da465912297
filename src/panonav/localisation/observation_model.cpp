#include "panonav/localisation/observation_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/view_index.hpp"

namespace panonav {

namespace {

/// Number of references compared around a position, as in the likelihood
/// (`ViewLikelihood::sites_near`).
constexpr std::size_t near_site_count = 12;
/// Distance in spacings beyond which views are unrelated: more than most similarity ranges.
constexpr double min_far_spacings = 6.0;
/// Number of references to which the decay of similarity is fitted: on a grid, those within four
/// spacings.
constexpr std::size_t max_fitted_sites = 48;
constexpr double max_fitted_spacings = 4.0;
/// Largest distance of neighbours on a grid in spacings, diagonal ones included.
constexpr double max_adjacent_spacings = 1.5;
/// Limits of the similarity range in spacings. With a shorter range, neighbours would have nothing
/// in common; with a longer one, no decay is measurable over four spacings.
constexpr double min_range_spacings = 0.4;
constexpr double max_range_spacings = 20.0;
/// Upper limit of a typical view's log-likelihood at its own place. A higher one would not improve
/// any position, but let one wrong view outweigh all others.
constexpr double max_log_likelihood = 50.0;
/// Smallest heading width: three columns, the possible error of a neighbouring view.
constexpr double min_heading_width_rad = 3.0 * 2.0 * std::numbers::pi / ColumnProfiles::columns;
/// Heading width as a multiple of the median absolute error; a Gaussian error exceeds it in 1 of 23
/// cases.
constexpr double heading_width_per_median_error = 3.0;
/// Largest heading error used in learning; larger ones come from chance matches or symmetric
/// scenes.
constexpr double max_heading_error_rad = std::numbers::pi / 4.0;

/// Returns the nearest other sites, ascending by distance.
std::vector<std::uint32_t> find_nearest_sites(std::span<const PosedView> sites, std::size_t own,
                                              std::size_t count) {
  const Point2 here = sites[own].pose.position();
  std::vector<std::pair<double, std::uint32_t>> found;  // a heap of `count`, the farthest first
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    if (s == own) continue;
    const Point2 there = sites[s].pose.position();
    const bool is_full = found.size() == count;
    if (is_full && std::abs(there.x_m - here.x_m) > found.front().first) continue;  // quick
    const std::pair next(distance(there, here), s);
    if (is_full) {
      if (!(next < found.front())) continue;
      std::ranges::pop_heap(found);
      found.pop_back();
    }
    found.push_back(next);
    std::ranges::push_heap(found);
  }
  std::ranges::sort_heap(found);
  std::vector<std::uint32_t> nearest;
  for (const auto& [distance_m, site] : found) nearest.push_back(site);
  return nearest;
}

/// A view left out of the memory. Compares it with other views on demand and keeps the results.
class LeftOutView {
 public:
  LeftOutView(const ColumnRanking& ranking, std::span<const PosedView> sites, std::size_t own)
      : ranking_(&ranking), sites_(sites), profiles_(ranking.profiles(sites[own].id)) {}

  const ColumnMatch& match(std::size_t site) {
    const auto found = matches_.find(site);
    if (found != matches_.end()) return found->second;
    const ColumnMatch compared = match_columns(*profiles_, *ranking_->profiles(sites_[site].id));
    return matches_.emplace(site, compared).first->second;
  }

 private:
  const ColumnRanking* ranking_;
  std::span<const PosedView> sites_;
  std::shared_ptr<const ColumnProfiles> profiles_;
  std::unordered_map<std::size_t, ColumnMatch> matches_;  // by site; of few of many sites
};

// Returns the similarity of two views; negative if they differ more than distant views do on
// average.
double to_similarity(const ColumnMatch& match, double far) {
  return far * far - match.difference * match.difference;
}

// Fits the similarity range: minus the inverse slope of the logarithm of the mean similarity over
// distance [M04 section 2.2]. The line starts at far^2, the similarity of a view to itself. Ignores
// distance bins whose mean is below far^2 / 20, which is noise.
double fit_range(std::span<const std::pair<double, double>> distance_and_similarity,
                 double spacing_m, double far) {
  constexpr auto bins = static_cast<std::size_t>(2.0 * max_fitted_spacings);
  std::array<double, bins> distances{}, similarities{}, counts{};
  for (const auto& [distance_m, similarity] : distance_and_similarity) {
    const auto bin = static_cast<std::size_t>(2.0 * distance_m / spacing_m);
    if (bin >= bins) continue;
    distances[bin] += distance_m;
    similarities[bin] += similarity;
    counts[bin] += 1.0;
  }
  double product = 0.0;
  double square = 0.0;
  for (std::size_t b = 0; b < bins; ++b) {
    if (!(similarities[b] > 0.05 * far * far * counts[b])) continue;
    const double distance_m = distances[b] / counts[b];
    product -= counts[b] * distance_m * std::log(similarities[b] / (counts[b] * far * far));
    square += counts[b] * distance_m * distance_m;
  }
  // If no view is similar to its neighbours, the range is the smallest one.
  if (!(square > 0.0)) return min_range_spacings * spacing_m;
  if (!(product > 0.0)) return max_range_spacings * spacing_m;
  return std::clamp(square / product, min_range_spacings * spacing_m,
                    max_range_spacings * spacing_m);
}

/// Squared similarity that the model explains at each candidate position; first at the view's own.
using Explained = std::vector<double>;

// Fits the sharpness that maximises the probability of the true positions of the left-out views
// among all candidates. The logarithm of this probability is concave in the sharpness, so
// bisection of its slope finds the maximum.
double fit_sharpness(std::span<const Explained> views) {
  std::vector<double> own;
  for (const Explained& view : views) own.push_back(view.front());
  const double typical = quantile(own, 0.5);
  const double highest = typical > 0.0 ? max_log_likelihood / typical : 1.0;
  const auto slope = [&](double sharpness) {
    double sum = 0.0;
    for (const Explained& view : views) {
      const double largest = *std::ranges::max_element(view);
      double weights = 0.0;
      double mean = 0.0;
      for (const double value : view) {
        const double weight = std::exp(sharpness * (value - largest));
        weights += weight;
        mean += weight * value;
      }
      sum += view.front() - mean / weights;
    }
    return sum;
  };
  double low = 0.0;
  double high = highest;
  if (slope(high) >= 0.0) return high;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (slope(middle) > 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The posed views of a memory, the sample that is left out in turn, and the candidate positions.
class LearningSample {
 public:
  LearningSample(const ColumnRanking& ranking, const LearningOptions& options)
      : sites_(HeldViewIndex(ranking.memory()).posed_views()) {
    require(sites_.size() >= static_cast<std::size_t>(ObservationModel::min_views),
            "views with a position in the memory", static_cast<double>(sites_.size()),
            ">= " + to_text(ObservationModel::min_views));
    std::vector<Point2> positions;
    std::vector<ViewId> views;
    for (const PosedView& site : sites_) {
      positions.push_back(site.pose.position());
      views.push_back(site.id);
    }
    spacing_m_ = VoronoiCells(positions).spacing_m();
    require(spacing_m_ > 0.0, "spacing of the memory's positions", spacing_m_, "> 0 m");
    const auto number_of = [&](ViewId view) {
      return static_cast<std::uint32_t>(std::ranges::lower_bound(views, view) - views.begin());
    };
    const auto seed = static_cast<std::uint64_t>(options.seed);
    for (const ViewId view : sample_views(views, options.sampled_views, seed)) {
      own_.push_back(number_of(view));
      left_out_.emplace_back(ranking, sites_, own_.back());
    }
    // Takes all sites if `compared_views` allows it, else fewer, because the 12 references around
    // each candidate are compared too.
    const int count = static_cast<int>(sites_.size()) <= options.compared_views
                          ? static_cast<int>(sites_.size())
                          : std::max(8, options.compared_views / static_cast<int>(near_site_count));
    for (const ViewId view : sample_views(views, count, seed + 1)) {
      candidates_.push_back(number_of(view));
    }
  }
  LearningSample(const LearningSample&) = delete;
  LearningSample& operator=(const LearningSample&) = delete;

  [[nodiscard]] double spacing_m() const { return spacing_m_; }
  [[nodiscard]] std::size_t size() const { return own_.size(); }

  /// Returns the median difference of views far from each other.
  double far_difference() {
    std::vector<double> far;
    for (std::size_t i = 0; i < own_.size(); ++i) {
      for (const std::uint32_t c : candidates_) {
        if (distance(sites_[c].pose.position(), sites_[own_[i]].pose.position()) <
            min_far_spacings * spacing_m_) {
          continue;
        }
        far.push_back(left_out_[i].match(c).difference);
      }
    }
    // A small memory has no distant views; the fallback is the difference of unrelated places.
    return far.empty() ? PlaceModel::unrelated_difference : quantile(far, 0.5);
  }

  /// Learns how similarity falls with distance, and the heading errors of neighbours.
  void learn_decay(ObservationModel& model) {
    std::vector<std::pair<double, double>> curve;
    std::vector<double> heading_errors;
    for (std::size_t i = 0; i < own_.size(); ++i) {
      const PosedView& here = sites_[own_[i]];
      for (const std::uint32_t s : find_nearest_sites(sites_, own_[i], max_fitted_sites)) {
        const double distance_m = distance(sites_[s].pose.position(), here.pose.position());
        if (distance_m > max_fitted_spacings * spacing_m_) break;
        const ColumnMatch& match = left_out_[i].match(s);
        curve.emplace_back(distance_m, to_similarity(match, model.far_difference));
        if (distance_m <= max_adjacent_spacings * spacing_m_ && here.pose.heading_rad &&
            sites_[s].pose.heading_rad) {
          heading_errors.push_back(std::abs(angle_difference(
              *sites_[s].pose.heading_rad + match.heading_rad, *here.pose.heading_rad)));
        }
      }
    }
    model.range_m = fit_range(curve, spacing_m_, model.far_difference);
    model.neighbouring_difference =
        model.far_difference * std::sqrt(1.0 - std::exp(-spacing_m_ / model.range_m));
    std::erase_if(heading_errors, [](double error) { return error > max_heading_error_rad; });
    model.heading_width_rad =
        heading_errors.empty()
            ? min_heading_width_rad
            : std::max(heading_width_per_median_error * quantile(heading_errors, 0.5),
                       min_heading_width_rad);
  }

  /// Returns the squared similarity that each left-out view explains at its own place and at the
  /// candidates.
  std::vector<Explained> explain(const ObservationModel& model) {
    near_sites_.resize(sites_.size());
    std::vector<Explained> explained;
    for (std::size_t i = 0; i < own_.size(); ++i) {
      Explained view{compute_explained_similarity(i, own_[i], model)};
      for (const std::uint32_t c : candidates_) {
        if (c != own_[i]) view.push_back(compute_explained_similarity(i, c, model));
      }
      explained.push_back(std::move(view));
    }
    return explained;
  }

 private:
  double compute_explained_similarity(std::size_t i, std::uint32_t where,
                                      const ObservationModel& model) {
    if (near_sites_[where].empty()) {
      near_sites_[where] = find_nearest_sites(sites_, where, near_site_count);
      near_sites_[where].insert(near_sites_[where].begin(), where);
    }
    double product = 0.0;
    double square = 0.0;
    for (const std::uint32_t s : near_sites_[where]) {
      if (s == own_[i]) continue;
      const double expected = std::exp(
          -distance(sites_[s].pose.position(), sites_[where].pose.position()) / model.range_m);
      square += expected * expected;
      product +=
          expected * std::max(0.0, to_similarity(left_out_[i].match(s), model.far_difference));
    }
    return square > 0.0 ? product * product / square : 0.0;
  }

  std::vector<PosedView> sites_;
  double spacing_m_ = 0.0;
  std::vector<std::uint32_t> own_;         // sites of the left-out views
  std::vector<LeftOutView> left_out_;      // these views
  std::vector<std::uint32_t> candidates_;  // sites
  std::vector<std::vector<std::uint32_t>>
      near_sites_;  // each site and those around it, filled on demand
};

}  // namespace

ObservationModel learn_observation_model(const ColumnRanking& ranking,
                                         const LearningOptions& options) {
  validate(options);
  constexpr int max_place_samples = 40;  // the default of `learn_place_model`
  return learn_observation_model_with_places(
      ranking,
      learn_place_model(ranking,
                        {.sampled_views = std::min(options.sampled_views, max_place_samples),
                         .seed = options.seed}),
      options);
}

ObservationModel learn_observation_model_with_places(const ColumnRanking& ranking,
                                                     const PlaceModel& place,
                                                     const LearningOptions& options) {
  validate(options);
  LearningSample sample(ranking, options);
  ObservationModel model;
  model.spacing_m = sample.spacing_m();
  model.explained_difference = place.threshold;
  model.sampled_views = static_cast<int>(sample.size());
  model.far_difference = sample.far_difference();
  sample.learn_decay(model);
  model.sharpness = fit_sharpness(sample.explain(model));
  return model;
}

}  // namespace panonav
