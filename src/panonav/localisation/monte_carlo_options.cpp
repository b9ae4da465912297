#include <string_view>

#include "panonav/localisation/monte_carlo.hpp"

namespace panonav {

void visit_options(MonteCarloOptions& options, OptionVisitor& visitor) {
  using T = MonteCarloOptions;
  constexpr OptionTable table{
      option<&T::min_particles>("smallest number of particles", 1, 1e7),
      option<&T::max_particles>("largest number of particles", 1, 1e7),
      option<&T::kld_error>(
          "allowed error of the particles' distribution; a smaller error needs more particles",
          1e-4, 1),
      option<&T::resample_below>("effective sample size below which particles are resampled, as a "
                                 "share of the number of particles",
                                 0, 1),
      option<&T::compass>(
          "weight particles also by the agreement of their heading with the visual compass"),
      choice<&T::injection>("positions at which new particles are added; explained: where the "
                            "image fits; none: no new particles",
                            "none", "explained"),
      option<&T::reranked_views>(
          "if no near view matches the image, compare this number of views column by column", 0,
          1e6),
      option<&T::seed>("seed of all random choices", 0),
  };
  table.visit(options, visitor);
}

std::string_view to_string(LocalisationState state) {
  switch (state) {
    case LocalisationState::localised:
      return "localised";
    case LocalisationState::position_known:
      return "position_known";
    case LocalisationState::ambiguous:
      return "ambiguous";
    case LocalisationState::lost:
      break;
  }
  return "lost";
}

}  // namespace panonav
