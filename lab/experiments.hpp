#pragma once

#include <functional>
#include <initializer_list>
#include <vector>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// What the experiments of all papers share. Each experiment appends rows and writes images.
struct Experiments {
  const ReproductionOptions& options;
  Executor& executor;
  Reproduction& result;
};

/// A part of the experiments of a paper.
struct ReproductionStage {
  double cost = 1.0;  ///< relative, for the progress
  std::function<void()> run;
};
using ReproductionPlan = std::vector<ReproductionStage>;

// The stages of each paper, in order; what `context` refers to must outlive them. Throw
// ContractError on options out of range.
[[nodiscard]] ReproductionPlan plan_f11(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_m03(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_m04(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_navigation(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_s06(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_y03(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_elsewhere(const Experiments& context);

struct OptionMinimum {
  const char* name;
  int value;
  int min;
};
/// Throws ContractError on the first value below its minimum.
void require_minima(std::initializer_list<OptionMinimum> options);

}  // namespace panonav::lab
