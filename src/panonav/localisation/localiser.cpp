#include "panonav/localisation/localiser.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/alternative_places.hpp"
#include "panonav/localisation/internal/heading_interpolation.hpp"
#include "panonav/localisation/internal/query_restoration.hpp"
#include "panonav/localisation/internal/query_views.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

namespace {

/// Largest number of matches that are blurred and compared with a query out of focus.
constexpr std::size_t blurred_candidates = 64;

/// Smallest probability with which a place is known.
constexpr double min_known_probability = 0.5;
/// Half width of the compass's search window: the rotation by columns is exact to one column.
constexpr double compass_window_rad = 2.0 * std::numbers::pi / ColumnProfiles::columns;

/// Smallest share of a place by columns at which features need not decide.
constexpr double min_clear_share = 0.98;
/// Largest number of alternatives that an answer names: more tell a user no more than that the
/// place is ambiguous.
constexpr std::size_t max_alternatives = 3;

ViewId view_of(const RankedMatch& match) {
  return match.match.view;
}

// Moves the best reference nearest to the interpolated position to the front. The position
// identifies it better than column differences, because noise dominates the differences between
// neighbours.
void move_nearest_first(const VisualMemory& memory, const FloorPosition& position,
                        std::vector<PlaceMatch>& matches) {
  const auto end = matches.begin() +
                   static_cast<std::ptrdiff_t>(std::min(nearest_reference_count, matches.size()));
  const auto distance_m = [&](const PlaceMatch& match) {
    const auto there = find_position(memory.info(match.view));
    return there ? distance(*there, position) : std::numeric_limits<double>::infinity();
  };
  const auto nearest = std::ranges::min_element(matches.begin(), end, {}, distance_m);
  std::rotate(matches.begin(), nearest, nearest + 1);
}

std::vector<ViewId> to_ids(std::span<const RankedMatch> matches) {
  std::vector<ViewId> ids;
  for (const RankedMatch& match : matches) ids.push_back(match.match.view);
  return ids;
}

}  // namespace

/// The views that queries are compared with, and the data derived from them.
struct Localiser::ComparedViews {
  ComparedViews(const VisualMemory& memory_, const LocaliserOptions& options,
                std::optional<double> spacing_m, std::size_t views)
      : memory(&memory_),
        ranking(memory_, options.components,
                std::max(ColumnRanking::default_max_cached_profiles,
                         static_cast<std::size_t>(options.reranked_views))),
        support(ranking, spacing_m),
        criterion(ranking, views) {}
  /// The views of a part of a memory of `views` views, as a camera out of focus sees them.
  ComparedViews(const VisualMemory& memory_, double blur_rad, double spacing_m, std::size_t views)
      : memory(&memory_),
        ranking(memory_, blur_rad, ColumnRanking::default_max_cached_profiles),
        support(ranking, spacing_m),
        criterion(ranking, views) {}
  ComparedViews(const ComparedViews&) = delete;
  ComparedViews& operator=(const ComparedViews&) = delete;

  const VisualMemory* memory;
  ColumnRanking ranking;
  NeighbourSupport support;               // looks at `ranking`
  PlaceCriterion criterion;               // looks at `ranking`
  std::optional<ReferenceLayout> layout;  // set once the spacing of the position model is known
};

/// The evaluation of one query.
class Localiser::Query {
 public:
  Query(const Localiser& localiser, ViewIndex& index, RestoredQuery query, const SearchMask& mask,
        const QueryFeatures& features)
      : localiser_(localiser),
        options_(localiser.options_),
        index_(index),
        restored_(std::move(query)),
        view_(restored_.signature),
        mask_(mask),
        make_features_(features),
        compared_(localiser.held_.get()) {
    const VisualMemory& memory = compared_ != nullptr ? *compared_->memory : *localiser_.sampled_;
    place_.components = options_.components == 0 ? memory.shape().components : options_.components;
    if (features && localiser_.should_rank_by_features() && options_.reranked_views > 0) {
      features_ = compute_features(Handedness::original);
    }
    is_ranked_by_features_ = features_.has_value();
  }

  Place answer() {
    if (ranked_.empty()) find_candidates();  // [M04 section 2.2]
    if (ranked_.empty()) return std::move(place_);
    if (!load_compared_views()) return std::move(place_);
    collect_column_evidence();          // evidence of whether the place is known
    rank_by_support();                  // places that look similar
    rank_by_features();                 // memories with far references
    estimate_known_probability();       // evidence where columns are inconclusive
    sort_if_not_reranked();             // by dissimilarity, if this was requested
    if (place_.known) choose_place();   // features where places look alike
    list_matches();                     // headings by the visual compass
    if (place_.known) estimate_pose();  // [M04 footnote 1]
    return std::move(place_);
  }

  /// Before `answer`: compares the candidates of another query of the same signature.
  void use_candidates(const Query& other) {
    if (compared_ != nullptr) ranked_ = other.ranked_;
  }

  /// After `answer`: returns the query with its tilt removed, or to be compared with blurred views
  /// (`restore_query`), unless the place is known without doubt. Undisturbed queries of known
  /// places in doubt are frequent in places that repeat themselves, so only one match is tried for
  /// them.
  [[nodiscard]] std::vector<RestoredQuery> restore() const {
    if (options_.reranked_views == 0 || options_.components != 0 || !mask_.allowed_rows.empty() ||
        compared_ == nullptr || is_known_without_doubt_) {
      return {};
    }
    const std::span<const RankedMatch> ranked(ranked_);
    const std::size_t count = is_known() ? std::min<std::size_t>(1, ranked.size()) : ranked.size();
    return restore_query(restored_, *compared_->memory, ranked.first(count));
  }

 private:
  /// Searches the views of smallest dissimilarity [M04 section 2.2] and ranks them by columns. If
  /// no match explains the query, searches `reranked_views` instead.
  void find_candidates() {
    const int first = std::max({options_.top, PositionModel::max_candidates,
                                is_ranked_by_features_ ? verified_candidates : 0});
    search_and_rank(first);
    const bool is_explained = std::ranges::any_of(ranked_, [&](const RankedMatch& match) {
      return match.columns.difference <= localiser_.place_model_.neighbouring_difference;
    });
    if (!ranked_.empty() && !is_explained && options_.reranked_views > first) {
      search_and_rank(options_.reranked_views);
    }
  }

  void search_and_rank(int count) {
    const SearchResult found =
        index_.search(view_, {.top = count, .components = options_.components}, mask_);
    place_.bytes_read += found.bytes_read;
    place_.bytes_in_full = found.bytes_in_full;
    place_.views_compared += found.matches.size();
    if (compared_ != nullptr) {
      ranked_ = compared_->ranking.rank(view_, found.matches, mask_.allowed_rows);
      return;
    }
    std::vector<ViewId> views;
    for (const Match& match : found.matches) views.push_back(match.view);
    loaded_.emplace(index_.load(views));
    ranked_ = ColumnRanking(*loaded_, options_.components, 0)
                  .rank(view_, found.matches, mask_.allowed_rows);
  }

  /// Loads the views that this query needs from a memory that is not held in RAM, or those of one
  /// that is if they are blurred: the candidates, the references that may support them, and the
  /// sampled views for chance. Returns false if blurred views do not know the place.
  bool load_compared_views() {
    const bool is_blurred = restored_.blur_rad > 0.0;
    if (compared_ != nullptr && !is_blurred) return true;
    if (is_blurred && !is_known_when_blurred()) return false;
    const VisualMemory& found = compared_ != nullptr ? *compared_->memory : *loaded_;
    const double spacing_m =
        compared_ != nullptr ? compared_->support.spacing_m() : localiser_.spacing_m_;
    std::vector<ViewId> views = to_ids(ranked_);
    views.insert(views.end(), mask_.excluded_views.begin(), mask_.excluded_views.end());
    const auto around = index_.views_within(
        bound_neighbours(found, ranked_, spacing_m, localiser_.position_model_.spacing_m));
    views.insert(views.end(), around.begin(), around.end());
    const auto sampled = localiser_.sampled_ ? localiser_.sampled_
                                             : std::make_shared<const VisualMemory>(index_.load(
                                                   sample_reference_views(found.views())));
    loaded_.emplace(join_memories(index_.load(views), *sampled));
    if (is_blurred) {
      loaded_views_.emplace(*loaded_, restored_.blur_rad, spacing_m, index_.size());
    } else {
      loaded_views_.emplace(*loaded_, options_, std::optional(spacing_m), index_.size());
    }
    loaded_views_->layout.emplace(*loaded_, localiser_.position_model_.spacing_m);
    compared_ = &*loaded_views_;
    return true;
  }

  /// Ranks the best candidates again, with their views and those for chance blurred. Returns true
  /// if their columns know the place: features do not add to them (`estimate_known_probability`).
  bool is_known_when_blurred() {
    ranked_.resize(std::min(
        ranked_.size(),
        std::max<std::size_t>(static_cast<std::size_t>(options_.top), blurred_candidates)));
    std::vector<Match> matches;
    for (const RankedMatch& match : ranked_) matches.push_back(match.match);
    if (compared_ == nullptr) loaded_.emplace(join_memories(*loaded_, *localiser_.sampled_));
    const VisualMemory& memory = compared_ != nullptr ? *compared_->memory : *loaded_;
    const ColumnRanking ranking(memory, restored_.blur_rad, matches.size());
    ranked_ = ranking.rank(view_, matches);
    const PlaceCriterion criterion = compared_ != nullptr
                                         ? PlaceCriterion(ranking, compared_->criterion)
                                         : PlaceCriterion(ranking, index_.size());
    return place_probability(criterion.evidence(view_, ranked_, mask_)) >= min_known_probability;
  }

  void collect_column_evidence() {
    place_.evidence = compared_->criterion.evidence(view_, ranked_, mask_);
  }

  void rank_by_support() {
    // The references' profiles cover all rows, so they cannot be compared with a masked query.
    if (options_.reranked_views == 0 || !mask_.allowed_rows.empty()) return;
    compared_->support.rank_by_support(ColumnProfiles(view_, options_.components), ranked_,
                                       mask_.excluded_views);
  }

  void rank_by_features() {
    if (is_ranked_by_features_)
      rank_by_verified_features(*features_, localiser_.features_, ranked_);
  }

  /// Adds evidence of features only where columns are inconclusive (a sequential test). Those of an
  /// image out of focus are none: the model was learnt from features of sharp images, of which a
  /// blurred one of the same place has few.
  void estimate_known_probability() {
    place_.known_probability = place_probability(place_.evidence);
    is_known_by_columns_ = is_known();
    if (make_features_ && localiser_.features_ && restored_.blur_rad == 0.0 &&
        is_inconclusive(place_.evidence)) {
      if (!features_) features_ = compute_features(Handedness::original);
      const auto mirrored = compute_features(Handedness::mirrored);
      if (features_ && mirrored) {
        place_.evidence.features = compared_->criterion.feature_evidence(
            *features_, *mirrored, localiser_.features_, ranked_, mask_);
        place_.known_probability = place_probability(place_.evidence);
      }
    }
    place_.known = is_known();
    is_known_without_doubt_ = place_.known_probability >= min_certain_probability;
    place_.probability = place_.known_probability;
  }
  [[nodiscard]] bool is_known() const { return place_.known_probability >= min_known_probability; }

  void sort_if_not_reranked() {
    if (options_.reranked_views > 0) return;
    std::ranges::sort(ranked_, {}, [](const RankedMatch& r) {
      return std::pair(r.match.dissimilarity, r.match.view);
    });
  }

  /// Shares the probability among the places that the matches show. If columns do not exclude all
  /// but the first, features decide, and the most probable place becomes the first.
  void choose_place() {
    if (!compared_->memory->info(ranked_.front().match.view).pose) return;
    const PositionModel& model = localiser_.position_model_;
    places_ = share_probability(compared_->ranking, compared_->support, model,
                                ColumnProfiles(view_, options_.components), ranked_,
                                mask_.excluded_views);
    const bool is_clear = places_.front().share >= min_clear_share && !model.ambiguous_from;
    if (places_.size() < 2 || is_clear || options_.reranked_views == 0) return;
    if (!make_features_ || !localiser_.features_) return;
    if (!features_) features_ = compute_features(Handedness::original);
    if (!features_) return;
    is_place_chosen_by_features_ =
        share_probability_by_features(places_, [&](const RankedMatch& match) {
          if (match.verified_features) return match.verified_features;
          const auto there = localiser_.features_(match.match.view);
          return there ? std::optional(match_features(*features_, *there).verified) : std::nullopt;
        });
    if (is_place_chosen_by_features_) move_chosen_place_first();
  }

  void move_chosen_place_first() {
    for (const PlaceShare& place : places_) {
      for (const RankedMatch& match : place.matches) {
        *std::ranges::find(ranked_, match.match.view, view_of) = match;
      }
    }
    const std::vector<RankedMatch>& chosen = places_.front().matches;
    std::stable_partition(ranked_.begin(), ranked_.end(), [&](const RankedMatch& r) {
      return std::ranges::find(chosen, r.match.view, view_of) != chosen.end();
    });
  }

  /// Lists the matches with the heading relative to each, by the visual compass.
  void list_matches() {
    for (const RankedMatch& r : ranked_) {
      if (static_cast<int>(place_.matches.size()) == options_.top) break;
      place_.matches.push_back(describe_match(r));
    }
  }
  [[nodiscard]] PlaceMatch describe_match(const RankedMatch& r) const {
    const VisualMemory& memory = *compared_->memory;
    std::optional<CompassReading> reading;
    if (place_.components >= 2) {
      PackedSignature there = memory.packed(r.match.view);
      if (restored_.blur_rad > 0.0) there = blur(there, restored_.blur_rad, *memory.elevations());
      reading = compass_near(mask_rows(view_, mask_.allowed_rows),
                             mask_rows(std::move(there), mask_.allowed_rows), r.columns.heading_rad,
                             compass_window_rad, options_.components);
    }
    return {memory.info(r.match.view).name,
            r.match.view,
            r.match.dissimilarity,
            r.columns.difference,
            r.verified_features,
            reading ? std::optional(reading->heading_rad) : std::nullopt};
  }

  /// Interpolates between references [M04 footnote 1], and lists the places that the image does not
  /// exclude. If features had to decide, the views of the other places are no references, even if
  /// they are near.
  void estimate_pose() {
    std::vector<RankedMatch> matches = ranked_;
    if (is_place_chosen_by_features_) {
      for (const PlaceShare& other : std::span(places_).subspan(1)) {
        std::erase_if(matches, [&](const RankedMatch& r) {
          return std::ranges::find(other.matches, r.match.view, view_of) != other.matches.end();
        });
      }
    }
    place_.position = interpolate(matches);
    place_.heading_rad = interpolate_heading(*compared_->memory, place_.matches, place_.position);
    if (place_.position && options_.reranked_views > 0 && !is_ranked_by_features_) {
      move_nearest_first(*compared_->memory,
                         {place_.position->position(), floor_of(place_.matches.front().name)},
                         place_.matches);
    }
    if (place_.position && !places_.empty()) list_alternatives();
  }

  [[nodiscard]] std::optional<PositionEstimate> interpolate(
      std::span<const RankedMatch> matches) const {
    const PositionModel& model = localiser_.position_model_;
    auto found = interpolate_position(compared_->ranking, model, *compared_->layout, matches,
                                      mask_.excluded_views, is_place_chosen_by_features_);
    // If only local features recognise the place, the position is no more precise than the
    // neighbourhood.
    if (is_known_by_columns_ || !found) return found;
    if (found->radius_m) found->radius_m = std::max(*found->radius_m, model.neighbourhood_m);
    if (found->along_route) {
      found->along_route->within_m = std::max(found->along_route->within_m, model.neighbourhood_m);
    }
    return found;
  }

  void list_alternatives() {
    place_.probability = places_.front().share * place_.known_probability;
    std::vector<OtherPlace> others;
    for (const PlaceShare& place : std::span(places_).subspan(1)) {
      auto position = interpolate(place.matches);
      const std::string_view name = compared_->memory->info(place.matches.front().match.view).name;
      if (position && floor_of(name) == floor_of(place_.matches.front().name)) {
        others.push_back({distance(position->position(), place_.position->position()) +
                              position->radius_m.value_or(0.0),
                          place.share});
      }
      if (place.share < min_named_share || place_.alternatives.size() == max_alternatives) continue;
      std::vector<PlaceMatch> matches;
      for (const RankedMatch& match : place.matches) {
        if (matches.size() == nearest_reference_count) break;
        matches.push_back(describe_match(match));
      }
      const auto heading_rad = interpolate_heading(*compared_->memory, matches, position);
      place_.alternatives.push_back({matches.front(), place.share * place_.known_probability,
                                     std::move(position), heading_rad});
    }
    const auto widen = [&](double& bound_m) {
      bound_m = std::max(bound_m, radius_over_places(bound_m, places_.front().share, others));
    };
    if (auto& radius_m = place_.position->radius_m) widen(*radius_m);
    if (auto& along_route = place_.position->along_route) widen(along_route->within_m);
  }

  [[nodiscard]] std::optional<LocalFeatures> compute_features(Handedness handedness) const {
    auto features = mask_rows(make_features_(handedness), mask_.allowed_rows);
    if (!features || restored_.tilt == Tilt{}) return features;
    const double sign = handedness == Handedness::original ? 1.0 : -1.0;
    return level_features(*std::move(features),
                          {sign * restored_.tilt.roll_rad, restored_.tilt.pitch_rad});
  }

  const Localiser& localiser_;
  const LocaliserOptions& options_;
  ViewIndex& index_;
  RestoredQuery restored_;
  const PackedSignature& view_;  // belongs to `restored_`
  const SearchMask& mask_;
  const QueryFeatures& make_features_;
  const ComparedViews* compared_;       // null before `load_compared_views` if not held
  std::optional<VisualMemory> loaded_;  // the views of `compared_`
  std::optional<ComparedViews> loaded_views_;
  std::vector<RankedMatch> ranked_;
  std::optional<LocalFeatures> features_;  // of the query, not mirrored
  bool is_ranked_by_features_ = false;
  bool is_known_by_columns_ = false;
  std::vector<PlaceShare> places_;  // the chosen one first; empty: unknown place or no position
  bool is_place_chosen_by_features_ = false;
  bool is_known_without_doubt_ = false;
  Place place_;
};

Localiser::Localiser(const VisualMemory& memory, const LocaliserOptions& options)
    : options_(options) {
  validate(options);
  auto compared = std::make_shared<ComparedViews>(memory, options, std::nullopt, 0);
  place_model_ = learn_place_model(compared->ranking);
  position_model_ = learn_position_model(compared->ranking);
  compared->layout.emplace(memory, position_model_.spacing_m);
  held_ = std::move(compared);
}

Localiser::Localiser(const VisualMemory& memory, const PlaceModel& place_model,
                     const PositionModel& position_model, const LocaliserOptions& options,
                     std::optional<double> spacing_m)
    : options_(options), place_model_(place_model), position_model_(position_model) {
  validate(options);
  auto compared = std::make_shared<ComparedViews>(memory, options, spacing_m, 0);
  compared->layout.emplace(memory, position_model_.spacing_m);
  held_ = std::move(compared);
  require(position_model_.components == options_.components, "components of the position model",
          position_model_.components, to_text(options_.components) + ", as requested");
}

Localiser::Localiser(std::shared_ptr<const VisualMemory> sampled, const PlaceModel& place_model,
                     const PositionModel& position_model, const LocaliserOptions& options,
                     double spacing_m)
    : options_(options),
      sampled_(std::move(sampled)),
      spacing_m_(spacing_m),
      place_model_(place_model),
      position_model_(position_model) {
  validate(options);
  require(position_model_.components == options_.components, "components of the position model",
          position_model_.components, to_text(options_.components) + ", as requested");
}

Place Localiser::localise(const PackedSignature& query, const SearchMask& mask,
                          const QueryFeatures& features) const {
  if (!held_) throw ContractError("memory", "not held", "one that is held, or its index");
  HeldViewIndex index(*held_->memory);
  return localise(index, query, mask, features);
}

Place Localiser::localise(ViewIndex& index, const PackedSignature& query, const SearchMask& mask,
                          const QueryFeatures& features) const {
  Query as_taken(*this, index, {query}, mask, features);
  Place place = as_taken.answer();
  constexpr std::size_t max_attempts = 3;  // without the tilt, blurred, and both
  std::vector<RestoredQuery> pending = as_taken.restore();
  for (std::size_t i = 0; i < std::min(pending.size(), max_attempts); ++i) {
    const RestoredQuery restored = pending[i];
    Query attempt(*this, index, restored, mask, features);
    if (restored.tilt == Tilt{}) attempt.use_candidates(as_taken);
    Place found = attempt.answer();
    found.bytes_read += place.bytes_read;
    found.views_compared += place.views_compared;
    if (found.known && (!place.known || found.probability >= place.probability)) return found;
    if (place.known) break;
    if (restored.blur_rad == 0.0) std::ranges::move(attempt.restore(), std::back_inserter(pending));
  }
  return place;
}

}  // namespace panonav
