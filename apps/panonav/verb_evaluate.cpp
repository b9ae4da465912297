#include <memory>
#include <nlohmann/json.hpp>

#include "arguments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/evaluation/trajectory_error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace panonav::command {

namespace {

using nlohmann::ordered_json;

struct EvaluateArguments {
  std::string estimate;
  std::string truth;
  TrajectoryErrorOptions options;
};

ordered_json as_json(const ErrorSummary& errors) {
  return {{"rms", errors.rms},
          {"mean", errors.mean},
          {"median", errors.median},
          {"p95", errors.p95},
          {"largest", errors.largest}};
}

ordered_json as_json(const TrajectoryError& error) {
  const auto& alignment = error.truth_from_estimate;
  ordered_json json{{"pairs", error.pairs},
                    {"left_out", error.left_out},
                    {"alignment",
                     {{"scale", alignment.scale},
                      {"rotation_rad", alignment.rotation_rad},
                      {"x_m", alignment.translation.x_m},
                      {"y_m", alignment.translation.y_m},
                      {"reflected", alignment.reflected}}},
                    {"position_m", as_json(error.position_m)},
                    {"heading_rad", as_json(error.heading_rad)},
                    {"relative_pairs", error.relative_pairs},
                    {"relative_position_m", nullptr},
                    {"relative_heading_rad", nullptr}};
  if (error.relative_pairs > 0) {
    json["relative_position_m"] = as_json(error.relative_position_m);
    json["relative_heading_rad"] = as_json(error.relative_heading_rad);
  }
  return json;
}

std::string line_of(const std::string& label, const ErrorSummary& errors, double unit, int digits) {
  return label + "  rms " + fixed(errors.rms * unit, digits) + "  median " +
         fixed(errors.median * unit, digits) + "  95 % within " + fixed(errors.p95 * unit, digits) +
         "  largest " + fixed(errors.largest * unit, digits);
}

Trajectory read(const std::string& path) {
  return Trajectory(read_trajectory(path));
}

ExitCode evaluate(const EvaluateArguments& wanted, Session& session) {
  const Trajectory estimate = read(wanted.estimate);
  const Trajectory truth = read(wanted.truth);
  const auto error = trajectory_error(estimate, truth, wanted.options);
  if (!error) {
    session.note("panonav evaluate: fewer than two poses of " + wanted.estimate +
                 " have a stamp within " + wanted.truth + "; do both count the same seconds?");
    return ExitCode::no_answer;
  }
  if (session.json()) {
    session.print(as_json(*error).dump());
    return ExitCode::done;
  }
  session.print(std::to_string(error->pairs) + " poses compared, " +
                std::to_string(error->left_out) + " without a true pose");
  session.print(line_of("position [m]       ", error->position_m, 1.0, 3));
  session.print(line_of("heading [degrees]  ", error->heading_rad, degrees(1.0), 2));
  if (error->relative_pairs > 0) {
    session.print("over " + to_text(wanted.options.relative_distance_m) + " m of path:");
    session.print(line_of("position [m]       ", error->relative_position_m, 1.0, 3));
    session.print(line_of("heading [degrees]  ", error->relative_heading_rad, degrees(1.0), 2));
  }
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<EvaluateArguments>();
  arguments.positional("ESTIMATE", wanted->estimate, "Trajectory as TUM text or CSV");
  arguments.positional("TRUTH", wanted->truth, "Trajectory as TUM text or CSV");
  arguments.options("evaluation", wanted->options);
  return [wanted](Session& session) { return evaluate(*wanted, session); };
}

}  // namespace

Verb evaluate_verb() {
  return {"evaluate", "Compare an estimated trajectory with the truth",
          "Poses are associated by stamp and aligned by least squares unless --align false. Ends "
          "with 1\n"
          "when the two have no time in common.",
          "  panonav evaluate estimate.tum truth.tum\n"
          "  panonav evaluate estimate.csv truth.csv --align-scale true --json",
          declare};
}

}  // namespace panonav::command
