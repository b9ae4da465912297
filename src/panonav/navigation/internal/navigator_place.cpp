// Where a navigator's robot is: the reference that it is nearest to.

#include "panonav/navigation/internal/navigator_place.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace panonav {

namespace {

// The next place is looked for again around the outermost that was found, so often: a step is half
// a passage, and four where references stand eight times as close as it was meant for.
constexpr int rounds_farther = 2;

}  // namespace

void Navigator::enter(std::size_t node, NavigationDecision& decision) {
  node_ = node;
  const std::size_t area = planner_.areas().area_of[node];
  if (views_.area() == area) return;
  views_.enter(planner_.graph(), planner_.areas(), area);
  field_ = planner_.field(area);
  decision.events.push_back(NavigationEvent::entered_area);
}

void Navigator::relocalise(const Seen& seen, NavigationDecision& decision) {
  const auto found =
      search_everywhere(*source_, planner_.graph(), planner_.areas(), seen.signature);
  decision.events.push_back(NavigationEvent::relocalised);
  if (!found) return;
  // A place that does not look like it either is no reason to leave the one that was expected.
  if (node_ && found->difference > scale_.limit()) return;
  if (node_) decision.events.push_back(NavigationEvent::kidnapped);
  decision.difference = found->difference;
  forget_plans(decision);
  enter(found->node, decision);
}

bool Navigator::needs_all_components() const {
  return coarse_components_ == 0 || !node_ || narrow_[*node_] != 0 ||
         around_goal_.contains(*node_) || unknown_looks_ > 0 || elsewhere_looks_ > 0 ||
         2 * looks_in_vain_ > patience();
}

double Navigator::limit(const SeenView& view) const noexcept {
  return (view.components == components_ ? scale_ : coarse_scale_).limit();
}

Navigator::Located Navigator::search_around(const SeenView& view) {
  const NavigationGraph& graph = planner_.graph();
  Located located;
  located.around = nodes_around(graph, {&*node_, 1}, options_.near_links);
  located.here = views_.nearest(graph, located.around, view);
  // Where references stand close together a step leads beyond those: from the outermost on the
  // search goes on, if it finds more alike ones.
  std::size_t centre = *node_;
  for (int round = 0; round < rounds_farther && located.here; ++round) {
    const auto inner = nodes_around(graph, {&centre, 1}, options_.near_links - 1);
    if (std::ranges::binary_search(inner, located.here->node)) break;
    centre = located.here->node;
    const auto farther = nodes_around(graph, {&centre, 1}, options_.near_links);
    const auto found = views_.nearest(graph, farther, view);
    if (!found || found->dissimilarity >= located.here->dissimilarity) break;
    located.here = found;
    std::vector<std::size_t> both;
    std::ranges::set_union(located.around, farther, std::back_inserter(both));
    located.around = std::move(both);
  }
  located.anywhere = views_.nearest(graph, view);
  located.elsewhere = located.here && located.anywhere &&
                      located.anywhere->dissimilarity < located.here->dissimilarity &&
                      located.anywhere->difference <= limit(view) &&
                      !std::ranges::binary_search(located.around, located.anywhere->node);
  return located;
}

// The place near where the robot was, unless several looks say otherwise.
void Navigator::accept(const Located& located, NavigationDecision& decision) {
  if (located.elsewhere) {
    // The looks must agree on the place, too.
    const bool again =
        elsewhere_ && std::ranges::binary_search(
                          nodes_around(planner_.graph(), {&*elsewhere_, 1}, options_.near_links),
                          located.anywhere->node);
    elsewhere_looks_ = again ? elsewhere_looks_ + 1 : 1;
    elsewhere_ = located.anywhere->node;
  } else {
    elsewhere_looks_ = 0;
    elsewhere_.reset();
  }
  const bool accepted = elsewhere_looks_ >= options_.agreeing_looks;
  const auto& found = accepted ? located.anywhere : located.here;
  if (found) {
    decision.difference = found->difference;
    enter(found->node, decision);
  }
  if (accepted) {
    decision.events.push_back(NavigationEvent::kidnapped);
    elsewhere_looks_ = 0;
    elsewhere_.reset();
    forget_plans(decision);
  }
}

void Navigator::locate(Seen& seen, const RobotReport& report, NavigationDecision& decision) {
  const bool line_tells = pilot_.drives() && pilot_.unknown_looks() == 0;
  std::optional<ViewId> told = report.estimate;
  if (!told && line_tells) told = pilot_.place();
  if (told) {
    const auto node = planner_.graph().node_of(*told);
    if (node) enter(*node, decision);
  }
  if (!node_) {
    relocalise(seen, decision);
  } else {
    Located located = search_around(seen.view);
    const bool in_doubt =
        !located.here || located.elsewhere || located.here->difference > limit(seen.view);
    if (in_doubt && seen.view.components != components_) {
      seen.view = SeenView(seen.signature, full_scale_);
      located = search_around(seen.view);
    }
    accept(located, decision);
  }
  if (under_way_) {
    const bool beyond =
        decision.difference <= limit(seen.view) && guide().way < under_way_->guide.way;
    if (beyond || --under_way_->looks_left < 0) under_way_.reset();
  }
  // Between references that stand far apart no place looks right.
  const bool looks_right = decision.difference <= limit(seen.view);
  if (looks_right || under_way_ || line_tells) {
    unknown_looks_ = 0;
    if (looks_right && !under_way_) known_node_ = node_;
    return;
  }
  decision.events.push_back(NavigationEvent::unknown_place);
  ++unknown_looks_;
  if (unknown_looks_ % options_.agreeing_looks == 0) relocalise(seen, decision);
  if (decision.difference <= limit(seen.view)) {
    unknown_looks_ = 0;
    known_node_ = node_;
  } else if (unknown_looks_ >= options_.lost_patience) {
    state_ = NavigationState::lost;
  }
}

// Some views of the area into which the way leads.
void Navigator::load_ahead() {
  if (options_.views_ahead == 0 || !node_ || !guide().reachable()) return;
  const SubAreas& areas = planner_.areas();
  const std::size_t here = *views_.area();
  std::size_t node = *node_;
  while (areas.area_of[node] == here) {
    const std::size_t next = field_[areas.place_of[node]].next;
    if (next == node) return;  // the goal
    node = next;
  }
  views_.load_ahead(planner_.graph(), areas, areas.area_of[node], options_.views_ahead);
}

}  // namespace panonav
