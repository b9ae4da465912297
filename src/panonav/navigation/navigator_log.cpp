// What is said of navigation in words: names, options, lines of a log.

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/navigator.hpp"

namespace panonav {

std::string_view name_of(NavigationState state) {
  constexpr std::array<std::string_view, 5> names{"moving", "arrived", "blocked", "lost",
                                                  "unreachable"};
  return names.at(static_cast<std::size_t>(state));
}

std::string_view name_of(NavigationEvent event) {
  constexpr std::array<std::string_view, 11> names{
      "relocalised", "kidnapped", "entered_area",  "unknown_place", "obstructed", "closed",
      "reopened",    "homing",    "homing_failed", "route",         "route_left"};
  return names.at(static_cast<std::size_t>(event));
}

std::string describe(const NavigationDecision& decision) {
  std::string line = std::to_string(decision.step) + " " + std::string(name_of(decision.state));
  std::array<char, 120> numbers{};
  if (decision.nearest) {
    std::snprintf(numbers.data(), numbers.size(), " at view %u (probability %.2f)",
                  static_cast<unsigned>(decision.nearest->value), decision.probability);
    line += numbers.data();
  }
  if (decision.next) line += " to view " + std::to_string(decision.next->value);
  line += " in area " + std::to_string(decision.area);
  std::snprintf(numbers.data(), numbers.size(), ", way left %.4g, difference %.3f", decision.way,
                decision.difference);
  line += numbers.data();
  if (decision.advance_m > 0.0) {
    const char* how = decision.homing ? "home" : decision.on_route ? "along a route" : "go";
    std::snprintf(numbers.data(), numbers.size(), ", %s %.3f m towards %.1f degrees", how,
                  decision.advance_m, degrees(decision.direction_rad));
    line += numbers.data();
  }
  for (const NavigationEvent event : decision.events) line += ", " + std::string(name_of(event));
  return line;
}

void visit_options(NavigatorOptions& options, OptionVisitor& visitor) {
  using T = NavigatorOptions;
  constexpr OptionTable table{
      option<&T::step_m>("longest way between two steps", above(0), 100),
      option<&T::near_links>("edges from the last place within which the next one is searched", 1,
                             10),
      option<&T::coarse_components>("components compared in the open, 0 for all", 0, 1000),
      option<&T::views_ahead>("views of the next area that a step loads", 0, 1e6),
      options_of<&T::homing>(),
      option<&T::min_agreeing_steps>(
          "steps that must agree before another place or a block is believed", 1, 1000),
      option<&T::lost_patience>("steps without a known place after which the robot is lost", 1,
                                1e6),
      option<&T::edge_patience>("steps without coming nearer after which an edge counts as blocked",
                                1, 1e6),
      option<&T::min_leg_m>("shortest way along a recorded route that is worth a leg", above(0),
                            1000),
      option<&T::attempts>("times that closed edges, or the last stretch, are tried", 1, 1000),
      option<&T::max_run_steps>("steps after which a run ends", 1, 1e9),
  };
  table.visit(options, visitor);
}

}  // namespace panonav
