#include "panonav/localisation/localiser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

// The signature with the magnitudes of the rows that do not count set to 0; no `allowed_rows`:
// unchanged.
PackedSignature with_rows(PackedSignature signature, std::span<const std::uint8_t> allowed_rows) {
  if (allowed_rows.empty()) return signature;
  for (std::size_t i = 0; i < signature.magnitudes.size(); ++i) {
    if (allowed_rows[i % allowed_rows.size()] == 0) signature.magnitudes[i] = 0;
  }
  return signature;
}

// Without the features in rows that do not count.
std::optional<LocalFeatures> with_rows(std::optional<LocalFeatures> features,
                                       std::span<const std::uint8_t> allowed_rows) {
  if (features && !allowed_rows.empty()) {
    std::erase_if(features->features,
                  [&](const LocalFeature& feature) { return allowed_rows[feature.row] == 0; });
  }
  return features;
}

constexpr std::size_t references = 4;  // the corners of a grid's square

// The mean of what the nearest references say. The error of the compass grows with the distance,
// and so does the square of the difference, so weights are its inverse fourth power. Only those
// near to what the best match says count: a compass that locked on to a wrong maximum must not pull
// the mean.
std::optional<double> absolute_heading(const VisualMemory& memory,
                                       std::span<const LocalisedMatch> matches) {
  constexpr double agreement_rad = radians(15.0);
  constexpr double min_difference = 1e-2;
  std::optional<double> centre_rad;
  double sum = 0.0;
  double weights = 0.0;
  for (const LocalisedMatch& match : matches.first(std::min(references, matches.size()))) {
    const auto& pose = memory.info(match.view).pose;
    if (!pose || !pose->heading_rad || !match.compass) continue;
    const double heading_rad = *pose->heading_rad + match.compass->heading_rad;
    if (!centre_rad) centre_rad = heading_rad;
    const double offset = angle_difference(heading_rad, *centre_rad);
    if (std::abs(offset) > agreement_rad) continue;
    const double weight = std::pow(std::max(min_difference, match.column_difference), -4.0);
    sum += weight * offset;
    weights += weight;
  }
  if (!centre_rad) return std::nullopt;
  return wrap_angle(*centre_rad + sum / weights);
}

// Columns tell the turn to a step of theirs.
constexpr double compass_window_rad = 2.0 * std::numbers::pi / ColumnProfiles::columns;

std::shared_ptr<const ColumnRanking> ranking_of(const VisualMemory& memory,
                                                const LocaliserOptions& options) {
  validate(options);
  return std::make_shared<const ColumnRanking>(memory, options.components,
                                               std::max(options.reranked_views, 1));
}

// Which of the best references is the nearest one: a position that many references agree on says it
// better than their differences one by one, in which noise decides between neighbours.
void put_nearest_first(const VisualMemory& memory, Point2 position,
                       std::vector<LocalisedMatch>& matches) {
  const auto end =
      matches.begin() + static_cast<std::ptrdiff_t>(std::min(references, matches.size()));
  const auto distance_m = [&](const LocalisedMatch& match) {
    const auto& pose = memory.info(match.view).pose;
    return pose ? distance(pose->position(), position) : std::numeric_limits<double>::infinity();
  };
  const auto nearest = std::ranges::min_element(matches.begin(), end, {}, distance_m);
  std::rotate(matches.begin(), nearest, nearest + 1);
}

}  // namespace

void visit_options(LocaliserOptions& options, OptionVisitor& visitor) {
  using T = LocaliserOptions;
  constexpr OptionTable table{
      option<&T::top>("number of matches listed", 1, 1e6),
      option<&T::components>("Fourier components compared, 0 for all", 0),
      option<&T::reranked_views>("views compared column by column when the nearest ones do not "
                                 "explain the picture; 0 keeps the order of dissimilarity",
                                 0, 1e6),
  };
  table.visit(options, visitor);
}

int first_matches(const LocaliserOptions& options, bool by_features) {
  return std::max({options.top, PositionModel::candidates, by_features ? verified_candidates : 0});
}

bool looks_further(const PlaceModel& model, std::span<const RankedMatch> first) {
  return std::ranges::none_of(first, [&](const RankedMatch& match) {
    return match.columns.difference <= model.neighbouring;
  });
}

Localiser::Localiser(const VisualMemory& memory, const LocaliserOptions& options)
    : Localiser(memory, ranking_of(memory, options), options) {}

Localiser::Localiser(const VisualMemory& memory, std::shared_ptr<const ColumnRanking> ranking,
                     const LocaliserOptions& options)
    : memory_(&memory),
      options_(options),
      ranking_(std::move(ranking)),
      support_(*ranking_),
      criterion_(*ranking_),
      place_model_(learn_place_model(*ranking_)),
      position_model_(learn_position_model(*ranking_)) {}

Localiser::Localiser(const VisualMemory& memory, const PlaceModel& place_model,
                     const PositionModel& position_model, const LocaliserOptions& options,
                     std::optional<double> spacing_m, std::size_t views)
    : memory_(&memory),
      options_(options),
      ranking_(ranking_of(memory, options)),
      support_(*ranking_, spacing_m),
      criterion_(*ranking_, views),
      place_model_(place_model),
      position_model_(position_model) {
  require(position_model_.components == options_.components, "components of the position model",
          position_model_.components, to_text(options_.components) + ", as asked for");
}

Localisation Localiser::localise(const PackedSignature& query, const SearchMask& mask,
                                 const QueryFeatures& features) const {
  Localisation result;
  result.components = options_.components == 0 ? memory_->shape().components : options_.components;
  const auto nearest = [&](int wanted) {
    SearchResult found =
        memory_->search(query, {.top = wanted, .components = options_.components}, mask);
    result.bytes_read += found.bytes_read;
    result.bytes_in_full = found.bytes_in_full;
    result.views_compared += found.matches.size();
    return ranking_->rank(query, found.matches, mask.allowed_rows);
  };
  std::optional<LocalFeatures> seen_features;
  if (features && ranks_by_features() && options_.reranked_views > 0) {
    seen_features = with_rows(features(Handedness::as_seen), mask.allowed_rows);
  }
  const bool by_features = seen_features.has_value();
  const int first = first_matches(options_, by_features);
  std::vector<RankedMatch> ranked = nearest(first);
  if (ranked.empty()) return result;
  if (options_.reranked_views > first && looks_further(place_model_, ranked)) {
    ranked = nearest(options_.reranked_views);
  }
  result.evidence = criterion_.evidence(query, ranked, mask);
  // Profiles of the references are kept over all rows.
  if (options_.reranked_views > 0 && mask.allowed_rows.empty()) {
    support_.put_best_supported_first(ColumnProfiles(query, options_.components), ranked,
                                      mask.excluded_views);
  }
  if (by_features) put_verified_first(*seen_features, features_, ranked);
  const bool known_by_columns = place_probability(result.evidence) >= 0.5;
  if (features && features_ && leave_doubt(result.evidence)) {
    if (!seen_features) {
      seen_features = with_rows(features(Handedness::as_seen), mask.allowed_rows);
    }
    const auto mirrored = with_rows(features(Handedness::mirrored), mask.allowed_rows);
    if (seen_features && mirrored) {
      result.evidence.features =
          criterion_.feature_evidence(*seen_features, *mirrored, features_, ranked, mask);
    }
  }
  result.known_probability = place_probability(result.evidence);
  result.known = result.known_probability >= 0.5;
  if (options_.reranked_views == 0) {
    std::ranges::sort(ranked, {}, [](const RankedMatch& r) {
      return std::pair(r.match.dissimilarity, r.match.view);
    });
  }

  const PackedSignature seen = with_rows(query, mask.allowed_rows);
  for (const RankedMatch& r : ranked) {
    if (static_cast<int>(result.matches.size()) == options_.top) break;
    std::optional<CompassReading> reading;
    if (result.components >= 2) {
      reading = compass_near(seen, with_rows(memory_->packed(r.match.view), mask.allowed_rows),
                             r.columns.heading_rad, compass_window_rad,
                             {.components = options_.components});
    }
    result.matches.push_back(
        {r.match.view, r.match.dissimilarity, r.columns.difference, r.verified_features, reading});
  }
  if (result.known) {
    result.position = interpolate_position(*ranking_, position_model_, ranked);
    // Columns alone do not know the place: so much do they say of the position.
    if (!known_by_columns && result.position && result.position->radius_m) {
      result.position->radius_m =
          std::max(*result.position->radius_m, position_model_.neighbourhood_m);
    }
    result.heading_rad = absolute_heading(*memory_, result.matches);
    if (result.position && options_.reranked_views > 0 && !by_features) {
      put_nearest_first(*memory_, result.position->position, result.matches);
    }
  }
  return result;
}

}  // namespace panonav
