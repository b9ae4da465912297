#include "runs/homing_pictures.hpp"

#include <string>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

const std::vector<std::string> rise{"--vertical-motion", "--tilt"};

}  // namespace

void declare_homing(Arguments& arguments, HomingArguments& wanted) {
  arguments.flag("--horizon", wanted.views.horizon,
                 "Compare one row only, the mean of the rows within 5 degrees of the horizon (all "
                 "rows where elevations are not known), as [S06] does");
  arguments.option("--published K", wanted.published, 1,
                   "Use the rule as published [S06] with K frequencies; goes with --iterations");
  arguments.options("signature", wanted.views.signature);
  arguments.options("preprocessing", wanted.views.preprocessing);
  arguments.options("homing", wanted.homing);
  arguments.uncommon({"--horizon"});
  arguments.used_only(
      {"--rising"}, [&wanted] { return wanted.homing.iterations > 0; }, "without --iterations");
  arguments.used_only(
      {"--starting-estimates"},
      [&wanted] { return wanted.homing.turn == FourierHomingOptions::TurnEstimate::global; },
      "with --turn sequential");
  arguments.used_only(
      rise, [&wanted] { return !wanted.views.horizon; }, "with --horizon");
}

FourierHomingOptions homing_options(const Arguments& arguments, const HomingArguments& wanted,
                                    int components) {
  FourierHomingOptions options = wanted.homing;
  if (wanted.published) {
    for (const auto* name :
         {"highest", "rising", "turn", "gradient", "weights", "starting_estimates",
          "displacement_search", "vertical_motion", "tilt"}) {
      if (!arguments.given("homing", name)) continue;
      throw UsageError("--published sets '" + std::string(name) +
                       "' itself; leave one of them out");
    }
    options = published_homing_options(*wanted.published, wanted.homing.iterations);
  }
  const int most = components - 2;
  if (most < 1) throw ContractError("components", components, ">= 3, for homing");
  if (options.highest > most) {
    throw ContractError(wanted.published ? "published" : "highest", options.highest,
                        "1 to " + std::to_string(most) + ", components less two");
  }
  return options;
}

void refuse_unused_rise(const Arguments& arguments, const HomingView& view,
                        const std::string& name) {
  if (view.elevations() && view.rows() >= 3) return;
  const std::string why = view.elevations()
                              ? " has fewer than three rows"
                              : " does not tell the elevations of its rows (elevation_deg)";
  arguments.refuse_unused(rise, "where " + name + why);
}

}  // namespace panonav::command
