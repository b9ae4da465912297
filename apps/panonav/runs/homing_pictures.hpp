#pragma once

#include <optional>

#include "cli/arguments.hpp"
#include "panonav/pipeline/homing_guide.hpp"

namespace panonav::command {

/// The arguments of verbs that compute home vectors.
struct HomingArguments {
  HomingViewOptions views;
  std::optional<int> published;  ///< K of S06's own rule
  FourierHomingOptions homing;
};

/// Adds --horizon, --published and the options of signature, preprocessing and homing.
void declare_homing(Arguments& arguments, HomingArguments& values);

/// Returns the options of the chosen rule. Throws UsageError when --published is combined with
/// options of our own rule, ContractError when `components` hold too few
/// frequencies.
[[nodiscard]] FourierHomingOptions make_homing_options(const Arguments& declared,
                                                       const HomingArguments& arguments,
                                                       int components);

/// Throws UsageError when --vertical-motion or --tilt was typed and this view, of the file `name`,
/// cannot tell rows that move up and down: elevations are unknown, or there are fewer than three
/// rows.
void reject_unused_rise(const Arguments& arguments, const HomingView& view,
                        const std::string& name);

}  // namespace panonav::command
