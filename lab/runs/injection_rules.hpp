#pragma once

#include <memory>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/monte_carlo.hpp"

namespace panonav::lab {

/// Rule by which an experiment injects particles: the filter's own or a paper's.
enum class InjectionMethod {
  none,         ///< none
  uniform,      ///< a fixed number, anywhere in the memorised area: the standard way
  topological,  ///< a fixed share, in the areas of the best matches [M03 section 4.1]
  explained,    ///< `MonteCarloOptions::Injection::explained`
};

/// Returns a rule that replaces 50 particles at each image by new ones anywhere [M03 figure 8].
[[nodiscard]] MonteCarloLocaliser::InjectionRule uniform_injection();

/// Returns a rule that replaces 10 % of the particles at each image by new ones around the
/// topological localisations, the references whose dissimilarity is within a quarter of the best
/// [M03 section 4.1].
[[nodiscard]] MonteCarloLocaliser::InjectionRule topological_injection(
    std::shared_ptr<const ColumnRanking> ranking);

/// Sets the rule of a filter over this ranking; its own rule is an option of the filter.
void use_injection(MonteCarloLocaliser& filter, InjectionMethod method,
                   const std::shared_ptr<const ColumnRanking>& ranking);

}  // namespace panonav::lab
