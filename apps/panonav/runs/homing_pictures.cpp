#include "runs/homing_pictures.hpp"

#include <string>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

const std::vector<std::string> rise_flags{"--vertical-motion", "--tilt"};

}  // namespace

void declare_homing(Arguments& arguments, HomingArguments& values) {
  arguments.flag("--horizon", values.views.horizon,
                 "Compare only one row, as in paper [S06]: the mean of the rows within 5 degrees "
                 "of the horizon, or of all rows if the elevations are unknown");
  arguments.option(
      "--published K", values.published, 1,
      "Use the rule published in paper [S06] with K frequencies; --iterations can be used with it");
  arguments.options("signature", values.views.signature);
  arguments.options("preprocessing", values.views.preprocessing);
  arguments.options("homing", values.homing);
  arguments.hide_from_help({"--horizon"});
  arguments.reject_options_unless(
      {"--rising"}, [&values] { return values.homing.iterations > 0; }, "without --iterations");
  arguments.reject_options_unless(
      {"--starting-estimates"},
      [&values] { return values.homing.turn == FourierHomingOptions::TurnEstimate::global; },
      "with --turn sequential");
  arguments.reject_options_unless(
      rise_flags, [&values] { return !values.views.horizon; }, "with --horizon");
}

FourierHomingOptions make_homing_options(const Arguments& declared,
                                         const HomingArguments& arguments, int components) {
  FourierHomingOptions options = arguments.homing;
  if (arguments.published) {
    for (const auto* name :
         {"highest", "rising", "turn", "gradient", "weights", "starting_estimates",
          "displacement_search", "vertical_motion", "tilt"}) {
      if (!declared.is_set("homing", name)) continue;
      throw UsageError("--published sets '" + std::string(name) +
                       "' itself; leave out one of them");
    }
    options = published_homing_options(*arguments.published, arguments.homing.iterations);
  }
  const int max_frequency = components - 2;
  if (max_frequency < 1) throw ContractError("components", components, ">= 3, for homing");
  if (options.highest > max_frequency) {
    throw ContractError(arguments.published ? "published" : "highest", options.highest,
                        "1 to " + std::to_string(max_frequency) + ", components less two");
  }
  return options;
}

void reject_unused_rise_flags(const Arguments& arguments, const HomingView& view,
                              const std::string& name) {
  if (view.elevations() && view.rows() >= 3) return;
  const std::string why = view.elevations()
                              ? " has fewer than three rows"
                              : " does not give the elevations of its rows (elevation_deg)";
  arguments.reject_options(rise_flags, "where " + name + why);
}

}  // namespace panonav::command
