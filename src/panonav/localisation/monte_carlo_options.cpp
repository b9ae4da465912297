#include <string_view>

#include "panonav/localisation/monte_carlo.hpp"

namespace panonav {

void visit_options(MonteCarloOptions& options, OptionVisitor& visitor) {
  using T = MonteCarloOptions;
  constexpr OptionTable table{
      option<&T::min_particles>("fewest particles", 1, 1e7),
      option<&T::max_particles>("most particles", 1, 1e7),
      option<&T::kld_error>(
          "allowed error of the particles' distribution; smaller needs more particles", 1e-4, 1),
      option<&T::resample_below>(
          "effective sample size below which particles are resampled, as a share of them", 0, 1),
      option<&T::compass>("weigh headings by the visual compass"),
      choice<&T::injection>("where new particles are drawn", "none", "explained"),
      option<&T::reranked_views>(
          "views compared column by column when no near one explains the picture", 0, 1e6),
      option<&T::seed>("seed of all random choices", 0),
  };
  table.visit(options, visitor);
}

std::string_view name_of(LocalisationState state) {
  switch (state) {
    case LocalisationState::localised:
      return "localised";
    case LocalisationState::ambiguous:
      return "ambiguous";
    case LocalisationState::lost:
      break;
  }
  return "lost";
}

}  // namespace panonav
