#include <array>
#include <string_view>

#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

void visit_options(FourierHomingOptions& options, OptionVisitor& visitor) {
  visitor.visit(
      {.name = "highest", .help = "highest frequency compared; 0 takes all", .low = 0, .high = 62},
      options.highest);
  visitor.visit(
      {.name = "iterations", .help = "times that the solution is refined", .low = 0, .high = 20},
      options.iterations);
  visitor.visit({.name = "rising", .help = "each iteration compares higher frequencies"},
                options.rising);
  constexpr std::array<std::string_view, 2> turns{"sequential", "global"};
  int turn = static_cast<int>(options.turn);
  visitor.visit({.name = "turn", .help = "how the heading is found first"}, turns, turn);
  options.turn = static_cast<TurnEstimate>(turn);
  constexpr std::array<std::string_view, 2> gradients{"current", "both"};
  int gradient = static_cast<int>(options.gradient);
  visitor.visit({.name = "gradient", .help = "views whose slopes count"}, gradients, gradient);
  options.gradient = static_cast<HomingGradient>(gradient);
  constexpr std::array<std::string_view, 2> weights{"equal", "coherence"};
  int weight = static_cast<int>(options.weights);
  visitor.visit({.name = "weights", .help = "how much components and rows count"}, weights, weight);
  options.weights = static_cast<HomingWeights>(weight);
  visitor.visit({.name = "starting_estimates",
                 .help = "headings tried",
                 .low = 1,
                 .high = static_cast<double>(most_starting_estimates)},
                options.starting_estimates);
  visitor.visit({.name = "displacement_search",
                 .help = "try displacements up to two thirds of R before solving"},
                options.displacement_search);
  visitor.visit({.name = "vertical_motion", .help = "rows off the horizon move up and down, too"},
                options.vertical_motion);
  visitor.visit({.name = "lean", .help = "the robot may lean a little, as on uneven ground"},
                options.lean);
}

FourierHomingOptions published_homing(int highest, int iterations) {
  return {.highest = highest,
          .iterations = iterations,
          .turn = TurnEstimate::sequential,
          .gradient = HomingGradient::current,
          .weights = HomingWeights::equal,
          .starting_estimates = 1,
          .displacement_search = false,
          .vertical_motion = false,
          .lean = false};
}

}  // namespace panonav
