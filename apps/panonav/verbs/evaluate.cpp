#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/estimate_evaluation.hpp"
#include "reports/map_measures.hpp"

namespace panonav::command {

namespace {

struct EvaluateArguments {
  std::string estimate;
  std::string truth;
  TrajectoryError::Options options;
};

ordered_json to_json(const TrajectoryError::Summary& errors) {
  return {{"rmse", errors.rms},
          {"mean", errors.mean},
          {"median", errors.median},
          {"p95", errors.p95},
          {"max", errors.largest}};
}

ordered_json to_json(const EstimateEvaluation& evaluation) {
  const TrajectoryError& error = evaluation.trajectory;
  const auto& alignment = error.ground_truth_from_estimate;
  ordered_json json{{"pairs", error.pairs},
                    {"left_out", error.left_out},
                    {"alignment",
                     {{"scale", alignment.scale},
                      {"rotation_rad", alignment.rotation_rad},
                      {"x_m", alignment.translation.x_m},
                      {"y_m", alignment.translation.y_m},
                      {"reflected", alignment.reflected}}},
                    {"ate_m", to_json(error.position_m)},
                    {"heading_rad", to_json(error.heading_rad)},
                    {"relative_pairs", error.relative_pairs},
                    {"rpe_m", nullptr},
                    {"rpe_heading_rad", nullptr}};
  if (error.relative_pairs > 0) {
    json["rpe_m"] = to_json(error.relative_position_m);
    json["rpe_heading_rad"] = to_json(error.relative_heading_rad);
  }
  json["procrustes_disparity"] = nullptr;
  json["procrustes_disparity_with_reflection"] = nullptr;
  if (evaluation.map) {
    json["procrustes_disparity"] = evaluation.map->shape.value;
    json["procrustes_disparity_with_reflection"] = evaluation.map->shape.with_reflection;
  }
  json.update(neighbours_json(evaluation.map.value_or(MapComparison{})));
  json.update(closures_json(evaluation.closures));
  return json;
}

std::string format_line(const std::string& label, const TrajectoryError::Summary& errors,
                        double unit, int digits) {
  return label + "  RMSE " + format_fixed(errors.rms * unit, digits) + "  median " +
         format_fixed(errors.median * unit, digits) + "  95 % within " +
         format_fixed(errors.p95 * unit, digits) + "  maximum " +
         format_fixed(errors.largest * unit, digits);
}

ExitCode evaluate(const EvaluateArguments& arguments, Session& session) {
  const auto evaluation = evaluate_estimate(arguments.estimate, arguments.truth, arguments.options);
  if (!evaluation) {
    return session.no_answer("panonav evaluate: fewer than two poses of " + arguments.estimate +
                             " are in the time range of " + arguments.truth +
                             ", without its gaps longer than --max-gap-s; check that both use the "
                             "same clock");
  }
  if (session.json()) {
    session.print(json_line(to_json(*evaluation)));
    return ExitCode::done;
  }
  const TrajectoryError& error = evaluation->trajectory;
  session.print(std::to_string(error.pairs) + " poses compared, " + std::to_string(error.left_out) +
                " without ground truth");
  session.print(format_line("ATE [m]            ", error.position_m, 1.0, 3));
  session.print(format_line("heading [degrees]  ", error.heading_rad, degrees(1.0), 2));
  if (error.relative_pairs > 0) {
    session.print("over " + to_text(arguments.options.relative_distance_m) + " m of path:");
    session.print(format_line("RPE [m]            ", error.relative_position_m, 1.0, 3));
    session.print(format_line("RPE [degrees]      ", error.relative_heading_rad, degrees(1.0), 2));
  }
  if (evaluation->map) {
    session.print("Procrustes disparity " + format_fixed(evaluation->map->shape.value, 4) +
                  "  with a reflection allowed " +
                  format_fixed(evaluation->map->shape.with_reflection, 4));
    print_neighbours(*evaluation->map, session);
  }
  if (evaluation->closures) print_closures(*evaluation->closures, session);
  return ExitCode::done;
}

Run declare_evaluate(Arguments& arguments) {
  auto values = std::make_shared<EvaluateArguments>();
  arguments.positional(
      "ESTIMATE", values->estimate,
      "Estimated trajectory as TUM text or CSV, or a memory file (NAME.panonav) with a map");
  arguments.positional("GROUND_TRUTH", values->truth, "True trajectory as TUM text or CSV");
  arguments.options("evaluation", values->options);
  arguments.show_in_help({"--align", "--align-scale"});
  arguments.reject_options_unless(
      {"--align-scale", "--align-reflection"}, [values] { return values->options.align; },
      "with --align false");
  return [values](Session& session) { return evaluate(*values, session); };
}

}  // namespace

Verb evaluate_verb() {
  return {
      "evaluate", "Compare an estimated trajectory or map with the true trajectory",
      "The true poses are interpolated at the time stamps of the estimated poses. Unless --align "
      "is false, the estimate is first aligned with the true trajectory by least squares. The exit "
      "code is 1 if fewer than two estimated poses have a corresponding true pose.",
      "  panonav evaluate estimate.tum truth.tum\n"
      "  panonav evaluate estimate.csv truth.csv --align-scale true --json\n"
      "  panonav evaluate office.panonav run/poses.csv",
      declare_evaluate};
}

}  // namespace panonav::command
