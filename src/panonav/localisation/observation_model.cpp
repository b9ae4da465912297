#include "panonav/localisation/observation_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

constexpr std::size_t near_sites = 12;  // as many as decide a likelihood
constexpr double far_spacings = 6.0;
constexpr double fitted_spacings = 4.0;
constexpr double min_range_spacings = 0.4;
constexpr double max_range_spacings = 20.0;
// Beyond this no view is told apart better, and one odd view would count for all others.
constexpr double max_log_likelihood = 50.0;
// Columns tell turns in steps; three of them are what a neighbouring view may be off by.
constexpr double min_heading_width_rad = 3.0 * 2.0 * std::numbers::pi / ColumnProfiles::columns;

struct Site {
  ViewId view;
  Point2 position;
  std::optional<double> heading_rad;
};

std::vector<Site> posed_sites(const VisualMemory& memory) {
  std::vector<Site> sites;
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) {
      sites.push_back({view, pose->position(), pose->heading_rad});
    }
  }
  return sites;
}

/// The nearest other sites, ascending by distance.
std::vector<std::uint32_t> nearest_sites(std::span<const Site> sites, std::size_t own,
                                         std::size_t count) {
  std::vector<std::pair<double, std::uint32_t>> found;
  found.reserve(sites.size());
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    if (s != own) found.emplace_back(distance(sites[s].position, sites[own].position), s);
  }
  count = std::min(count, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end());
  std::vector<std::uint32_t> nearest;
  for (std::size_t i = 0; i < count; ++i) nearest.push_back(found[i].second);
  return nearest;
}

/// One view, left out of the memory, compared with the others where asked.
class LeftOutView {
 public:
  LeftOutView(const ColumnRanking& ranking, std::span<const Site> sites, std::size_t own)
      : ranking_(&ranking),
        sites_(sites),
        profiles_(ranking.profiles(sites[own].view)),
        matches_(sites.size()) {}

  const ColumnMatch& match(std::size_t site) {
    if (!matches_[site]) {
      matches_[site] = match_columns(profiles_, ranking_->profiles(sites_[site].view));
    }
    return *matches_[site];
  }

 private:
  const ColumnRanking* ranking_;
  std::span<const Site> sites_;
  ColumnProfiles profiles_;
  std::vector<std::optional<ColumnMatch>> matches_;
};

// Negative for views more unlike than views far from each other are on average.
double similarity_of(const ColumnMatch& match, double far) {
  return far * far - match.difference * match.difference;
}

// Slope of the logarithm of the mean similarity over distance. At no distance a view is like
// itself, so the line starts at far^2. Bins that have fallen to a twentieth of that say nothing but
// noise.
double fit_range(std::span<const std::pair<double, double>> distance_and_similarity,
                 double spacing_m, double far) {
  constexpr auto bins = static_cast<std::size_t>(2.0 * fitted_spacings);
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
  // Nothing like a view beside it: what is known is that the range is no longer than that.
  if (!(square > 0.0)) return min_range_spacings * spacing_m;
  if (!(product > 0.0)) return max_range_spacings * spacing_m;
  return std::clamp(square / product, min_range_spacings * spacing_m,
                    max_range_spacings * spacing_m);
}

/// Squared similarity explained at each candidate place, the view's own one first.
using Explained = std::vector<double>;

// The sharpness that gives the places of the views left out the highest probability among all
// candidates: the logarithm of that probability is concave in the sharpness.
double fit_sharpness(std::span<const Explained> views) {
  std::vector<double> own;
  for (const Explained& view : views) own.push_back(view.front());
  const double typical = quantile(own, 0.5);
  const double highest = typical > 0.0 ? max_log_likelihood / typical : 1.0;
  const auto slope = [&](double sharpness) {
    double sum = 0.0;
    for (const Explained& view : views) {
      const double most = *std::ranges::max_element(view);
      double weights = 0.0;
      double mean = 0.0;
      for (const double value : view) {
        const double weight = std::exp(sharpness * (value - most));
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

}  // namespace

void visit_options(ObservationModelOptions& options, OptionVisitor& visitor) {
  using T = ObservationModelOptions;
  constexpr OptionTable table{
      option<&T::sampled_views>("views left out in turn to learn how views change with distance", 8,
                                1e6),
      option<&T::compared_views>("views with which each of them is compared", 8, 1e6),
      option<&T::seed>("seed of the draws", 0),
  };
  table.visit(options, visitor);
}

ObservationModel learn_observation_model(const ColumnRanking& ranking,
                                         const ObservationModelOptions& options) {
  validate(options);
  const std::vector<Site> sites = posed_sites(ranking.memory());
  require(sites.size() >= static_cast<std::size_t>(ObservationModel::min_views),
          "views with a position in the memory", static_cast<double>(sites.size()),
          ">= " + to_text(ObservationModel::min_views));
  std::vector<Point2> positions;
  std::vector<ViewId> views;
  for (const Site& site : sites) {
    positions.push_back(site.position);
    views.push_back(site.view);
  }
  ObservationModel model;
  model.spacing_m = VoronoiCells(positions).spacing_m();
  require(model.spacing_m > 0.0, "spacing of the memory's positions", model.spacing_m, "> 0 m");
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const PlaceModel place = learn_place_model(
      ranking, {.sampled_views = std::min(options.sampled_views, PlaceModelOptions{}.sampled_views),
                .seed = options.seed});
  model.explained_difference = place.threshold;

  const std::vector<ViewId> sampled = sample_views(views, options.sampled_views, seed);
  model.sampled_views = static_cast<int>(sampled.size());
  // Candidate places: all, or so many that with the references around them the limit is kept.
  const int limit = static_cast<int>(sites.size()) <= options.compared_views
                        ? static_cast<int>(sites.size())
                        : std::max(8, options.compared_views / static_cast<int>(near_sites));
  const std::vector<ViewId> drawn = sample_views(views, limit, seed + 1);
  const auto site_of = [&](ViewId view) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(views, view) - views.begin());
  };
  std::vector<std::uint32_t> candidates;
  for (const ViewId view : drawn) candidates.push_back(site_of(view));

  std::vector<LeftOutView> left_out;
  std::vector<std::uint32_t> own;
  std::vector<double> far;
  for (const ViewId view : sampled) {
    own.push_back(site_of(view));
    left_out.emplace_back(ranking, sites, own.back());
    for (const std::uint32_t c : candidates) {
      if (distance(sites[c].position, sites[own.back()].position) <
          far_spacings * model.spacing_m) {
        continue;
      }
      far.push_back(left_out.back().match(c).difference);
    }
  }
  // A memory smaller than that: as unlike as views of places that have nothing in common.
  model.far_difference = far.empty() ? PlaceModel::unrelated_difference : quantile(far, 0.5);

  std::vector<std::pair<double, double>> curve;
  std::vector<double> turns;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Site& here = sites[own[i]];
    for (const std::uint32_t s : nearest_sites(sites, own[i], 48)) {
      const double distance_m = distance(sites[s].position, here.position);
      if (distance_m > fitted_spacings * model.spacing_m) break;
      const ColumnMatch& match = left_out[i].match(s);
      curve.emplace_back(distance_m, similarity_of(match, model.far_difference));
      if (distance_m <= 1.5 * model.spacing_m && here.heading_rad && sites[s].heading_rad) {
        turns.push_back(std::abs(
            angle_difference(*sites[s].heading_rad + match.heading_rad, *here.heading_rad)));
      }
    }
  }
  model.range_m = fit_range(curve, model.spacing_m, model.far_difference);
  model.neighbouring_difference =
      model.far_difference * std::sqrt(1.0 - std::exp(-model.spacing_m / model.range_m));
  model.heading_width_rad = min_heading_width_rad;
  if (!turns.empty()) {
    // Three median errors; turns at which the columns fit by chance or by symmetry are no errors.
    std::erase_if(turns, [](double turn) { return turn > std::numbers::pi / 4; });
    if (!turns.empty()) {
      model.heading_width_rad = std::max(3.0 * quantile(turns, 0.5), min_heading_width_rad);
    }
  }

  std::vector<std::vector<std::uint32_t>> near(sites.size());
  std::vector<Explained> explained;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const auto at = [&](std::uint32_t where) {
      if (near[where].empty()) {
        near[where] = nearest_sites(sites, where, near_sites);
        near[where].insert(near[where].begin(), where);
      }
      double product = 0.0;
      double square = 0.0;
      for (const std::uint32_t s : near[where]) {
        if (s == own[i]) continue;
        const double expected =
            std::exp(-distance(sites[s].position, sites[where].position) / model.range_m);
        square += expected * expected;
        product +=
            expected * std::max(0.0, similarity_of(left_out[i].match(s), model.far_difference));
      }
      return square > 0.0 ? product * product / square : 0.0;
    };
    Explained view{at(own[i])};
    for (const std::uint32_t c : candidates) {
      if (c != own[i]) view.push_back(at(c));
    }
    explained.push_back(std::move(view));
  }
  model.sharpness = fit_sharpness(explained);
  return model;
}

}  // namespace panonav
