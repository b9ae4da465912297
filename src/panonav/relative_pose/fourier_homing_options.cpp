
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

void visit_options(FourierHomingOptions& options, OptionVisitor& visitor) {
  using T = FourierHomingOptions;
  constexpr OptionTable table{
      option<&T::highest>("highest frequency compared; 0 takes all", 0, 62),
      option<&T::iterations>("times that the solution is refined", 0, 20),
      option<&T::rising>("each iteration compares higher frequencies"),
      choice<&T::turn>("how the heading is found first", "sequential", "global"),
      choice<&T::gradient>("views whose gradients count", "current", "both"),
      choice<&T::weights>("weights of components and rows", "equal", "coherence"),
      option<&T::starting_estimates>("headings tried", 1,
                                     static_cast<double>(max_starting_estimates)),
      option<&T::displacement_search>("try displacements up to two thirds of R before solving"),
      option<&T::vertical_motion>("rows off the horizon move up and down, too"),
      option<&T::tilt>("the robot may tilt a little, as on uneven ground"),
  };
  table.visit(options, visitor);
}

FourierHomingOptions published_homing_options(int highest, int iterations) {
  return {.highest = highest,
          .iterations = iterations,
          .turn = FourierHomingOptions::TurnEstimate::sequential,
          .gradient = FourierHomingOptions::Gradient::current,
          .weights = FourierHomingOptions::Weights::equal,
          .starting_estimates = 1,
          .displacement_search = false,
          .vertical_motion = false,
          .tilt = false};
}

}  // namespace panonav
