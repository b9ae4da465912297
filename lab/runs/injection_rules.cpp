#include "lab/runs/injection_rules.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/localisation/hierarchical.hpp"

namespace panonav::lab {

namespace {

constexpr std::size_t uniform_number = 50;      // particles that are replaced [M03 figure 8]
constexpr double topological_share = 0.1;       // of the particles [M03 section 4.1]
constexpr double topological_tolerance = 0.25;  // of the best dissimilarity; the paper has none

}  // namespace

MonteCarloLocaliser::InjectionRule uniform_injection() {
  return [](const PackedSignature&, std::size_t particles) {
    return MonteCarloLocaliser::InjectedParticles{std::min(particles, uniform_number), {}};
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
    injected.count =
        static_cast<std::size_t>(std::lround(topological_share * static_cast<double>(particles)));
    return injected;
  };
}

void use_injection(MonteCarloLocaliser& filter, InjectionMethod method,
                   const std::shared_ptr<const ColumnRanking>& ranking) {
  if (method == InjectionMethod::uniform) filter.set_injection_rule(uniform_injection());
  if (method == InjectionMethod::topological) {
    filter.set_injection_rule(topological_injection(ranking));
  }
}

}  // namespace panonav::lab
