#pragma once

#include <optional>

#include "cli/arguments.hpp"
#include "panonav/pipeline/homing_guide.hpp"

namespace panonav::command {

/// The arguments of verbs that compute home vectors.
struct HomingArguments {
  HomingViewOptions views;
  std::optional<int> published;  ///< number of frequencies K of the published rule [S06]
  FourierHomingOptions homing;
};

/// Adds --horizon, --published and the options of signature, preprocessing and homing.
void declare_homing(Arguments& arguments, HomingArguments& values);

/// Returns the options of the chosen rule. Throws UsageError if --published is combined with
/// options that it sets itself, ContractError if `components` are too few for its frequencies.
[[nodiscard]] FourierHomingOptions make_homing_options(const Arguments& declared,
                                                       const HomingArguments& arguments,
                                                       int components);

/// Throws UsageError if --vertical-motion or --tilt was typed but the view has no elevations or
/// fewer than three rows, so that vertical image motion cannot be measured. `name` is the view's
/// file.
void reject_unused_rise_flags(const Arguments& arguments, const HomingView& view,
                              const std::string& name);

}  // namespace panonav::command
