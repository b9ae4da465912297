#pragma once

#include <memory>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/monte_carlo.hpp"

namespace panonav::lab {

/// How particles are injected in an experiment: by the filter's own ways or by a paper's.
enum class InjectionMethod {
  none,         ///< none
  uniform,      ///< a fixed number, anywhere in the memorised area: the standard way
  topological,  ///< a fixed share, in the areas of the best matches [M03 section 4.1]
  explained,    ///< `MonteCarloOptions::Injection::explained`
};

/// Replaces 50 particles at each image by new ones anywhere [M03 figure 8].
[[nodiscard]] MonteCarloLocaliser::InjectionRule uniform_injection();

/// Replaces 10 % of the particles at each image by new ones around the topological localisations,
/// the references whose dissimilarity is within a quarter of the best [M03 section 4.1].
[[nodiscard]] MonteCarloLocaliser::InjectionRule topological_injection(
    std::shared_ptr<const ColumnRanking> ranking);

/// Makes the filter over this ranking inject particles so, besides its own way.
void use_injection(MonteCarloLocaliser& filter, InjectionMethod method,
                   const std::shared_ptr<const ColumnRanking>& ranking);

}  // namespace panonav::lab
