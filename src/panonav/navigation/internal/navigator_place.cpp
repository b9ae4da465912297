// Part of the navigator that determines the robot's place: the reference to which it is nearest.

#include <algorithm>
#include <iterator>
#include <utility>

#include "panonav/navigation/internal/navigator_core.hpp"

namespace panonav {

namespace {

/// Largest number of times that the search for the next place continues around the outermost
/// reference found. A step is half an edge; with references eight times as dense as intended, it is
/// four edges.
constexpr int max_search_rounds = 2;
/// Number of other views compared for the evidence of a place; enough to include the tenth best
/// match.
constexpr int compared_view_count = 15;

}  // namespace

/// The references most similar to a view.
struct Navigator::Core::PlaceCandidates {
  std::vector<std::size_t> around;    ///< nodes around the last place
  std::optional<FoundView> here;      ///< the best of these
  std::optional<FoundView> anywhere;  ///< the best of the loaded area
  bool is_elsewhere = false;          ///< `anywhere` is another place that matches
};

void Navigator::Core::set_place(std::size_t node, Step& step) {
  place.node = node;
  const std::size_t area = planner.areas().area_of[node];
  if (views.area() == area) return;
  views.enter(graph(), planner.areas(), area);
  plan.field = planner.field(area);
  step.add_event(NavigationDecision::Event::entered_area);
}

void Navigator::Core::relocalise(Step& step) {
  const auto found = search_whole_memory(*source, graph(), planner.areas(), step.signature);
  step.add_event(NavigationDecision::Event::relocalised);
  if (!found) return;
  // If the place found does not match either, keeps the expected one.
  if (place.node && found->difference > scales.place.max_difference()) return;
  if (place.node) step.add_event(NavigationDecision::Event::kidnapped);
  step.decision.difference = found->difference;
  abandon_plans(step);
  set_place(found->node, step);
}

bool Navigator::Core::needs_all_components() const {
  return scales.coarse_components == 0 || !place.node || scales.is_narrow[*place.node] != 0 ||
         goal->around.contains(*place.node) || place.doubt.unknown_steps > 0 ||
         place.doubt.other_place_steps > 0 ||
         2 * progress.steps_without_progress > max_steps_without_progress();
}

Navigator::Core::PlaceCandidates Navigator::Core::find_candidates(const QueryView& view) {
  PlaceCandidates found;
  found.around = nodes_around(graph(), {&*place.node, 1}, options.near_links);
  found.here = views.find_nearest(graph(), found.around, view);
  // If references are dense, a step leads beyond those searched. Therefore continues around the
  // outermost reference found, as long as more similar ones are found.
  std::size_t centre = *place.node;
  for (int round = 0; round < max_search_rounds && found.here; ++round) {
    const auto inner = nodes_around(graph(), {&centre, 1}, options.near_links - 1);
    if (std::ranges::binary_search(inner, found.here->node)) break;
    centre = found.here->node;
    const auto farther = nodes_around(graph(), {&centre, 1}, options.near_links);
    const auto nearest = views.find_nearest(graph(), farther, view);
    if (!nearest || nearest->dissimilarity >= found.here->dissimilarity) break;
    found.here = nearest;
    std::vector<std::size_t> both;
    std::ranges::set_union(found.around, farther, std::back_inserter(both));
    found.around = std::move(both);
  }
  found.anywhere = views.find_nearest(graph(), view);
  found.is_elsewhere = found.here && found.anywhere &&
                       found.anywhere->dissimilarity < found.here->dissimilarity &&
                       found.anywhere->difference <= scales.max_difference(view) &&
                       !std::ranges::binary_search(found.around, found.anywhere->node);
  return found;
}

// Chooses the candidate near the last place, unless several observations agree on another one.
void Navigator::Core::choose_place(const PlaceCandidates& candidates, Step& step) {
  PlaceDoubt& doubt = place.doubt;
  const auto reset_other_place = [&doubt] {
    doubt.other_place_steps = 0;
    doubt.other_node.reset();
  };
  if (candidates.is_elsewhere) {
    const std::size_t other = candidates.anywhere->node;
    const bool agrees =
        doubt.other_node &&
        std::ranges::binary_search(
            nodes_around(graph(), {&*doubt.other_node, 1}, options.near_links), other);
    doubt.other_place_steps = agrees ? doubt.other_place_steps + 1 : 1;
    doubt.other_node = other;
  } else {
    reset_other_place();
  }
  const bool is_kidnapped = doubt.other_place_steps >= options.min_agreeing_steps;
  const auto& found = is_kidnapped ? candidates.anywhere : candidates.here;
  if (found) {
    step.decision.difference = found->difference;
    set_place(found->node, step);
  }
  if (is_kidnapped) {
    step.add_event(NavigationDecision::Event::kidnapped);
    reset_other_place();
    abandon_plans(step);
  }
}

bool Navigator::Core::is_localised_on_route() const {
  return pilot.is_on_leg() && pilot.unknown_steps() == 0;
}

void Navigator::Core::locate(Step& step) {
  std::optional<ViewId> reported = step.report.estimate;
  if (!reported && is_localised_on_route()) reported = pilot.nearest_reference();
  if (reported) {
    const auto node = graph().node_of(*reported);
    if (node) set_place(*node, step);
  }
  if (place.node) {
    search_place(step);
  } else {
    relocalise(step);
  }
  update_place_doubt(step);
}

// Searches around the last place; uses all components if the first ones are inconclusive.
void Navigator::Core::search_place(Step& step) {
  PlaceCandidates found = find_candidates(step.view);
  const bool is_doubtful = !found.here || found.is_elsewhere ||
                           found.here->difference > scales.max_difference(step.view);
  if (is_doubtful && step.view.components != scales.components) {
    step.view = QueryView(step.signature, scales.full_scale);
    found = find_candidates(step.view);
  }
  choose_place(found, step);
}

// Counts successive steps at which the place does not match. Searches the whole memory every
// `min_agreeing_steps` of them; after `lost_patience` of them the robot is lost.
void Navigator::Core::update_place_doubt(Step& step) {
  const auto matches = [&] { return step.decision.difference <= scales.max_difference(step.view); };
  if (plan.committed) {
    const bool is_beyond = matches() && guide().path_length < plan.committed->guide.path_length;
    if (is_beyond || --plan.committed->steps_left < 0) plan.committed.reset();
  }
  int& unknown_steps = place.doubt.unknown_steps;
  // Between references that are far apart no place matches, so a committed edge or a route decides.
  if (matches() || plan.committed || is_localised_on_route()) {
    unknown_steps = 0;
    if (matches() && !plan.committed) place.known_node = place.node;
    return;
  }
  step.add_event(NavigationDecision::Event::unknown_place);
  ++unknown_steps;
  if (unknown_steps % options.min_agreeing_steps == 0) relocalise(step);
  if (matches()) {
    unknown_steps = 0;
    place.known_node = place.node;
  } else if (unknown_steps >= options.lost_patience) {
    state = NavigationDecision::State::lost;
  }
}

double Navigator::Core::compute_place_probability(const Step& step) const {
  return place_probability(criterion.evidence_for_first(
      step.view.packed,
      views.most_similar_signatures(graph().view(*place.node), step.view, compared_view_count)));
}

// Updates the probability of the place, because a matching reference must also match better than by
// chance: in another building, a robot would find matching views and drive endlessly.
void Navigator::Core::update_probability(Step& step) {
  step.decision.probability = compute_place_probability(step);
  int& improbable_steps = place.doubt.improbable_steps;
  // Between distant references, and with an obstacle in view, no place is probable. These steps are
  // not counted; an obstructed run ends after all paths were tried.
  if (step.decision.probability < 0.5 && !plan.committed && !is_localised_on_route() &&
      obstruction.level == 0) {
    ++improbable_steps;
  }
  const bool has_relocalised =
      std::ranges::find(step.decision.events, NavigationDecision::Event::relocalised) !=
      step.decision.events.end();
  if (state == NavigationDecision::State::moving && improbable_steps > 0 && !has_relocalised &&
      improbable_steps % options.min_agreeing_steps == 0) {
    relocalise(step);
    step.decision.probability = compute_place_probability(step);
  }
  if (step.decision.probability >= 0.5) {
    improbable_steps = 0;
  } else if (state == NavigationDecision::State::moving &&
             improbable_steps >= options.lost_patience) {
    state = NavigationDecision::State::lost;
  }
}

void Navigator::Core::prefetch_next_area() {
  if (options.views_ahead == 0 || !place.node || !guide().is_reachable()) return;
  const SubAreas& areas = planner.areas();
  const std::size_t here = *views.area();
  std::size_t node = *place.node;
  while (areas.area_of[node] == here) {
    const std::size_t next = plan.field[areas.index_in_area[node]].next;
    if (next == node) return;  // the goal
    node = next;
  }
  views.prefetch(graph(), areas, areas.area_of[node], options.views_ahead);
}

}  // namespace panonav
