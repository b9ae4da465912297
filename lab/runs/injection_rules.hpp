#pragma once

#include <memory>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/monte_carlo.hpp"

namespace panonav::lab {

/// Method by which the filter of an experiment injects particles: its own or one of a paper.
enum class InjectionMethod {
  none,         ///< no injection
  uniform,      ///< a fixed number anywhere in the memorised area: the usual rule
  topological,  ///< a fixed fraction, around the best matches [M03 section 4.1]
  explained,    ///< the filter's own: `MonteCarloOptions::Injection::explained`
};

/// Returns a rule that replaces 50 particles per image by new ones anywhere in the memorised area
/// [M03 figure 8].
[[nodiscard]] MonteCarloLocaliser::InjectionRule uniform_injection();

/// Returns a rule that replaces 10 % of the particles per image by new ones around the topological
/// localisations: the references with a dissimilarity within 25 % of the best one [M03 section
/// 4.1].
[[nodiscard]] MonteCarloLocaliser::InjectionRule topological_injection(
    std::shared_ptr<const ColumnRanking> ranking);

/// Sets the injection rule of a filter that uses `ranking`. Has no effect for `none` and
/// `explained`, which are set by the filter's options.
void set_injection_method(MonteCarloLocaliser& filter, InjectionMethod method,
                          const std::shared_ptr<const ColumnRanking>& ranking);

}  // namespace panonav::lab
