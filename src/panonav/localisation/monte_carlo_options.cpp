#include <array>
#include <string_view>

#include "panonav/localisation/monte_carlo.hpp"

namespace panonav {

void visit_options(MonteCarloOptions& options, OptionVisitor& visitor) {
  visitor.visit({.name = "least_particles", .help = "fewest particles", .low = 1, .high = 1e7},
                options.least_particles);
  visitor.visit({.name = "most_particles", .help = "most particles", .low = 1, .high = 1e7},
                options.most_particles);
  visitor.visit(
      {.name = "kld_error",
       .help = "allowed error of the particles' distribution; smaller needs more particles",
       .low = 1e-4,
       .high = 1.0},
      options.kld_error);
  visitor.visit({.name = "resample_below",
                 .help = "effective sample size below which particles are resampled, as a share",
                 .low = 0.0,
                 .high = 1.0},
                options.resample_below);
  visitor.visit({.name = "compass", .help = "weigh headings by the visual compass"},
                options.compass);
  constexpr std::array<std::string_view, 4> kinds{"none", "uniform", "topological", "explained"};
  int kind = static_cast<int>(options.redraw);
  visitor.visit({.name = "redraw", .help = "where new particles are drawn"}, kinds, kind);
  options.redraw = static_cast<Redraw>(kind);
  visitor.visit({.name = "redraw_share",
                 .help = "share of particles redrawn by 'topological'",
                 .low = 0.0,
                 .high = 1.0},
                options.redraw_share);
  visitor.visit(
      {.name = "redraw_number", .help = "particles redrawn by 'uniform'", .low = 0, .high = 1e7},
      options.redraw_number);
  visitor.visit({.name = "compared_views",
                 .help = "views compared column by column when no near one explains the picture",
                 .low = 0,
                 .high = 1e6},
                options.compared_views);
  visitor.visit({.name = "seed", .help = "seed of all random choices", .low = 0}, options.seed);
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
