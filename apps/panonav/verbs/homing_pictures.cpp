#include "verbs/homing_pictures.hpp"

#include "panonav/core/error.hpp"

namespace panonav::command {

void declare_homing(Arguments& arguments, HomingArguments& wanted) {
  arguments.flag("--horizon", wanted.horizon,
                 "Compare one row only, the mean of the rows within 5 degrees of the horizon (all "
                 "rows where elevations are not known), as [S06] does");
  arguments.option("--published", wanted.published, 1,
                   "Use the rule as published [S06] with K frequencies; goes with --iterations. K");
  arguments.options("signature", wanted.signature);
  arguments.options("preprocessing", wanted.preprocessing);
  arguments.options("homing", wanted.homing);
}

FourierHomingOptions homing_options(const Arguments& arguments, const HomingArguments& wanted,
                                    int components) {
  FourierHomingOptions options = wanted.homing;
  if (wanted.published) {
    for (const auto* name :
         {"highest", "rising", "turn", "gradient", "weights", "starting_estimates",
          "displacement_search", "vertical_motion", "lean"}) {
      if (!arguments.given("homing", name)) continue;
      throw UsageError("--published sets '" + std::string(name) +
                       "' itself; leave one of them out");
    }
    options = published_homing(*wanted.published, wanted.homing.iterations);
  }
  const int most = components - 2;
  if (most < 1) throw ContractError("components", components, ">= 3, for homing");
  if (options.highest > most) {
    throw ContractError(wanted.published ? "published" : "highest", options.highest,
                        "1 to " + std::to_string(most) + ", components less two");
  }
  return options;
}

HomingView view_to_home_with(const FourierSignature& signature, bool horizon) {
  return horizon ? horizon_view(signature) : homing_view(signature);
}

HomingReader::HomingReader(const Dataset& recording, const HomingArguments& wanted)
    : reader_(recording.source, wanted_shape(recording.source, wanted.signature)),
      preprocessing_(wanted.preprocessing),
      components_(wanted.signature.components),
      horizon_(wanted.horizon) {}

Panorama HomingReader::read(const DatasetEntry& entry) const {
  Panorama panorama = reader_.read(entry.path);
  const int most = panorama.columns() / 2;
  if (components_ > most) {
    throw FileError(entry.path.string(), "components is " + std::to_string(components_) +
                                             "; allowed: 3 to " + std::to_string(most) +
                                             ", half the columns of the picture");
  }
  if (preprocessing_.masked_rows_top + preprocessing_.masked_rows_bottom >= panorama.rows()) {
    throw FileError(entry.path.string(), "has " + std::to_string(panorama.rows()) +
                                             " rows, and the masks leave none of them");
  }
  return panorama;
}

HomingView HomingReader::view(const Panorama& panorama) const {
  return view_to_home_with(compute_signature(preprocess(panorama, preprocessing_), components_),
                           horizon_);
}

void check_same_rows(const HomingView& view, const DatasetEntry& entry, const HomingView& goal,
                     const std::string& goal_name) {
  if (view.rows() == goal.rows()) return;
  throw FileError(entry.path.string(), "rows is " + std::to_string(view.rows()) + "; allowed: " +
                                           std::to_string(goal.rows()) + ", as in " + goal_name);
}

}  // namespace panonav::command
