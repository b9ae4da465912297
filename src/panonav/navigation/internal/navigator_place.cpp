// Where a navigator's robot is: the reference that it is nearest to.

#include <algorithm>
#include <iterator>
#include <utility>

#include "panonav/navigation/internal/navigator_core.hpp"

namespace panonav {

namespace {

// The next place is looked for again around the outermost that was found, so often: a step is half
// an edge, and four where references stand eight times as close as it was meant for.
constexpr int rounds_farther = 2;
// Views beside the place by which the probability that it is right is told.
constexpr int compared_with_place = 15;

}  // namespace

// The references most like a view: around the last place, and in all of the area.
struct Navigator::Core::Located {
  std::vector<std::size_t> around;
  std::optional<FoundView> here;
  std::optional<FoundView> anywhere;
  bool elsewhere = false;  // the latter is another place, and looks right
};

void Navigator::Core::enter(std::size_t node, Step& step) {
  place.node = node;
  const std::size_t area = planner.areas().area_of[node];
  if (views.area() == area) return;
  views.enter(graph(), planner.areas(), area);
  plan.field = planner.field(area);
  step.note(NavigationEvent::entered_area);
}

void Navigator::Core::relocalise(Step& step) {
  const auto found = search_whole_memory(*source, graph(), planner.areas(), step.signature);
  step.note(NavigationEvent::relocalised);
  if (!found) return;
  // A place that does not look like it either is no reason to leave the one that was expected.
  if (place.node && found->difference > scales.place.limit()) return;
  if (place.node) step.note(NavigationEvent::kidnapped);
  step.decision.difference = found->difference;
  forget_plans(step);
  enter(found->node, step);
}

bool Navigator::Core::needs_all_components() const {
  return scales.coarse_components == 0 || !place.node || scales.narrow[*place.node] != 0 ||
         goal->around.contains(*place.node) || place.doubt.unknown_steps > 0 ||
         place.doubt.elsewhere_steps > 0 || 2 * progress.steps_in_vain > patience();
}

Navigator::Core::Located Navigator::Core::search_around(const SeenView& view) {
  Located located;
  located.around = nodes_around(graph(), {&*place.node, 1}, options.near_links);
  located.here = views.nearest(graph(), located.around, view);
  // Where references stand close together a step leads beyond those: from the outermost on the
  // search goes on, if it finds more similar ones.
  std::size_t centre = *place.node;
  for (int round = 0; round < rounds_farther && located.here; ++round) {
    const auto inner = nodes_around(graph(), {&centre, 1}, options.near_links - 1);
    if (std::ranges::binary_search(inner, located.here->node)) break;
    centre = located.here->node;
    const auto farther = nodes_around(graph(), {&centre, 1}, options.near_links);
    const auto found = views.nearest(graph(), farther, view);
    if (!found || found->dissimilarity >= located.here->dissimilarity) break;
    located.here = found;
    std::vector<std::size_t> both;
    std::ranges::set_union(located.around, farther, std::back_inserter(both));
    located.around = std::move(both);
  }
  located.anywhere = views.nearest(graph(), view);
  located.elsewhere = located.here && located.anywhere &&
                      located.anywhere->dissimilarity < located.here->dissimilarity &&
                      located.anywhere->difference <= scales.limit(view) &&
                      !std::ranges::binary_search(located.around, located.anywhere->node);
  return located;
}

// The place near where the robot was, unless several observations say otherwise.
void Navigator::Core::accept(const Located& located, Step& step) {
  PlaceDoubt& doubt = place.doubt;
  if (located.elsewhere) {
    // They must agree on the place, too.
    const bool again =
        doubt.elsewhere && std::ranges::binary_search(
                               nodes_around(graph(), {&*doubt.elsewhere, 1}, options.near_links),
                               located.anywhere->node);
    doubt.elsewhere_steps = again ? doubt.elsewhere_steps + 1 : 1;
    doubt.elsewhere = located.anywhere->node;
  } else {
    doubt.elsewhere_steps = 0;
    doubt.elsewhere.reset();
  }
  const bool accepted = doubt.elsewhere_steps >= options.min_agreeing_steps;
  const auto& found = accepted ? located.anywhere : located.here;
  if (found) {
    step.decision.difference = found->difference;
    enter(found->node, step);
  }
  if (accepted) {
    step.note(NavigationEvent::kidnapped);
    doubt.elsewhere_steps = 0;
    doubt.elsewhere.reset();
    forget_plans(step);
  }
}

bool Navigator::Core::line_tells() const {
  return pilot.drives() && pilot.unknown_steps() == 0;
}

void Navigator::Core::locate(Step& step) {
  std::optional<ViewId> told = step.report.estimate;
  if (!told && line_tells()) told = pilot.place();
  if (told) {
    const auto node = graph().node_of(*told);
    if (node) enter(*node, step);
  }
  if (!place.node) {
    relocalise(step);
  } else {
    Located located = search_around(step.view);
    const bool in_doubt =
        !located.here || located.elsewhere || located.here->difference > scales.limit(step.view);
    if (in_doubt && step.view.components != scales.components) {
      step.view = SeenView(step.signature, scales.full_scale);
      located = search_around(step.view);
    }
    accept(located, step);
  }
  const auto looks_right = [&] { return step.decision.difference <= scales.limit(step.view); };
  if (plan.under_way) {
    const bool beyond = looks_right() && guide().way < plan.under_way->guide.way;
    if (beyond || --plan.under_way->steps_left < 0) plan.under_way.reset();
  }
  // Between references that stand far apart no place looks right.
  int& unknown_steps = place.doubt.unknown_steps;
  if (looks_right() || plan.under_way || line_tells()) {
    unknown_steps = 0;
    if (looks_right() && !plan.under_way) place.known_node = place.node;
    return;
  }
  step.note(NavigationEvent::unknown_place);
  ++unknown_steps;
  if (unknown_steps % options.min_agreeing_steps == 0) relocalise(step);
  if (looks_right()) {
    unknown_steps = 0;
    place.known_node = place.node;
  } else if (unknown_steps >= options.lost_patience) {
    state = NavigationState::lost;
  }
}

// A reference that looks right has to look better than chance, too: in another building the limit
// of the difference lets enough views through to drive on for ever.
void Navigator::Core::judge_place(Step& step) {
  const auto probability = [&] {
    return place_probability(criterion.evidence_for_first(
        step.view.packed,
        views.with_most_alike(graph().view(*place.node), step.view, compared_with_place)));
  };
  step.decision.probability = probability();
  int& improbable_steps = place.doubt.improbable_steps;
  // Between references that stand far apart no place is probable, nor where something stands in
  // the way and in the picture: what ends such a run is that every way was tried.
  if (step.decision.probability < 0.5 && !plan.under_way && !line_tells() &&
      obstruction.level == 0) {
    ++improbable_steps;
  }
  const bool sought = std::ranges::find(step.decision.events, NavigationEvent::relocalised) !=
                      step.decision.events.end();
  if (state == NavigationState::moving && improbable_steps > 0 && !sought &&
      improbable_steps % options.min_agreeing_steps == 0) {
    relocalise(step);
    step.decision.probability = probability();
  }
  if (step.decision.probability >= 0.5) {
    improbable_steps = 0;
  } else if (state == NavigationState::moving && improbable_steps >= options.lost_patience) {
    state = NavigationState::lost;
  }
}

// Some views of the area into which the way leads.
void Navigator::Core::load_ahead() {
  if (options.views_ahead == 0 || !place.node || !guide().reachable()) return;
  const SubAreas& areas = planner.areas();
  const std::size_t here = *views.area();
  std::size_t node = *place.node;
  while (areas.area_of[node] == here) {
    const std::size_t next = plan.field[areas.place_of[node]].next;
    if (next == node) return;  // the goal
    node = next;
  }
  views.load_ahead(graph(), areas, areas.area_of[node], options.views_ahead);
}

}  // namespace panonav
