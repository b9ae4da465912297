#include "lab/runs/injection_rules.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/localisation/hierarchical.hpp"

namespace panonav::lab {

namespace {

constexpr std::size_t uniform_particle_count = 50;  // particles per image [M03 figure 8]
constexpr double topological_fraction = 0.1;        // fraction of the particles [M03 section 4.1]
constexpr double topological_tolerance = 0.25;  // above the best dissimilarity; not in the paper

}  // namespace

MonteCarloLocaliser::InjectionRule uniform_injection() {
  return [](const PackedSignature&, std::size_t particles) {
    return MonteCarloLocaliser::InjectedParticles{std::min(particles, uniform_particle_count), {}};
  };
}

MonteCarloLocaliser::InjectionRule topological_injection(
    std::shared_ptr<const ColumnRanking> ranking) {
  const auto areas = std::make_shared<const ReferenceAreas>(ranking->memory());
  return [ranking = std::move(ranking), areas](const PackedSignature& view, std::size_t particles) {
    const auto levels = localise_hierarchically(
        ranking->memory(), *areas, view,
        {.components = ranking->components(), .tolerance = topological_tolerance});
    MonteCarloLocaliser::InjectedParticles injected;
    if (levels.empty()) return injected;
    for (const Match& match : levels.back().candidates) {
      if (ranking->memory().info(match.view).pose) injected.around.push_back(match.view);
    }
    if (injected.around.empty()) return injected;
    injected.count = static_cast<std::size_t>(
        std::lround(topological_fraction * static_cast<double>(particles)));
    return injected;
  };
}

void set_injection_method(MonteCarloLocaliser& filter, InjectionMethod method,
                          const std::shared_ptr<const ColumnRanking>& ranking) {
  if (method == InjectionMethod::uniform) filter.set_injection_rule(uniform_injection());
  if (method == InjectionMethod::topological) {
    filter.set_injection_rule(topological_injection(ranking));
  }
}

}  // namespace panonav::lab
