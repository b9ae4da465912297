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
  std::string line = std::to_string(decision.look) + " " + std::string(name_of(decision.state));
  if (decision.nearest) line += " at view " + std::to_string(decision.nearest->value);
  if (decision.next) line += " to view " + std::to_string(decision.next->value);
  line += " in area " + std::to_string(decision.area);
  std::array<char, 120> numbers{};
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
  visitor.visit({.name = "step_m",
                 .help = "longest way between two looks",
                 .low = 0,
                 .high = 100,
                 .low_open = true},
                options.step_m);
  visitor.visit({.name = "near_links",
                 .help = "the next place is looked for within so many passages of the last one",
                 .low = 1,
                 .high = 10},
                options.near_links);
  visitor.visit({.name = "coarse_components",
                 .help = "components compared in the open, 0 for all",
                 .low = 0,
                 .high = 1000},
                options.coarse_components);
  visitor.visit({.name = "views_ahead",
                 .help = "views of the next area that a look loads",
                 .low = 0,
                 .high = 1e6},
                options.views_ahead);
  visit_options(options.homing, visitor);
  visitor.visit({.name = "agreeing_looks",
                 .help = "looks that must agree before another place or a block is believed",
                 .low = 1,
                 .high = 1000},
                options.agreeing_looks);
  visitor.visit({.name = "lost_patience",
                 .help = "looks without a known place after which the robot is lost",
                 .low = 1,
                 .high = 1e6},
                options.lost_patience);
  visitor.visit({.name = "passage_patience",
                 .help = "looks without coming nearer after which a passage counts as blocked",
                 .low = 1,
                 .high = 1e6},
                options.passage_patience);
  visitor.visit({.name = "shortest_leg_m",
                 .help = "shortest way along a recorded route that is worth a leg",
                 .low = 0,
                 .high = 1000,
                 .low_open = true},
                options.shortest_leg_m);
  visitor.visit({.name = "attempts",
                 .help = "times that closed passages, or the last stretch, are tried",
                 .low = 1,
                 .high = 1000},
                options.attempts);
  visitor.visit(
      {.name = "most_looks", .help = "looks after which a run ends", .low = 1, .high = 1e9},
      options.most_looks);
}

}  // namespace panonav
