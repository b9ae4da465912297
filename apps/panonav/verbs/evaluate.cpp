#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "cli/verbs.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/motion/trajectory_error.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

struct EvaluateArguments {
  std::string estimate;
  std::string truth;
  TrajectoryError::Options options;
};

ordered_json as_json(const TrajectoryError::Summary& errors) {
  return {{"rmse", errors.rms},
          {"mean", errors.mean},
          {"median", errors.median},
          {"p95", errors.p95},
          {"max", errors.largest}};
}

/// Closures are right when their views truly are so near.
constexpr double right_closure_m = 1.0;
constexpr int neighbours = 8;
/// Comparing everyone's neighbours takes time with the square of the poses; more are thinned out.
constexpr std::size_t max_points = 2000;

/// The estimate: poses over time, and the closures of a map.
struct Estimate {
  Trajectory trajectory;
  TopologicalMap map;                // empty where a trajectory was given
  std::map<ViewId, double> stamp_s;  // of the map's views
};

/// Comparison of the estimate with the truth as maps; nullopt where there are too few poses.
struct MapFigures {
  std::optional<ShapeDifference> shape;
  std::optional<NeighbourPreservation> neighbours;
  std::optional<ClosureCount> closures;
};

ordered_json as_json(const MapFigures& figures) {
  ordered_json json{
      {"procrustes_disparity", nullptr}, {"procrustes_disparity_with_reflection", nullptr},
      {"trustworthiness", nullptr},      {"continuity", nullptr},
      {"right_closures", nullptr},       {"wrong_closures", nullptr}};
  if (figures.shape) {
    json["procrustes_disparity"] = figures.shape->value;
    json["procrustes_disparity_with_reflection"] = figures.shape->with_reflection;
  }
  if (figures.neighbours) {
    json["trustworthiness"] = figures.neighbours->trustworthiness;
    json["continuity"] = figures.neighbours->continuity;
  }
  if (figures.closures) {
    json["right_closures"] = figures.closures->right;
    json["wrong_closures"] = figures.closures->wrong;
  }
  return json;
}

ordered_json as_json(const TrajectoryError& error) {
  const auto& alignment = error.ground_truth_from_estimate;
  ordered_json json{{"pairs", error.pairs},
                    {"left_out", error.left_out},
                    {"alignment",
                     {{"scale", alignment.scale},
                      {"rotation_rad", alignment.rotation_rad},
                      {"x_m", alignment.translation.x_m},
                      {"y_m", alignment.translation.y_m},
                      {"reflected", alignment.reflected}}},
                    {"ate_m", as_json(error.position_m)},
                    {"heading_rad", as_json(error.heading_rad)},
                    {"relative_pairs", error.relative_pairs},
                    {"rpe_m", nullptr},
                    {"rpe_heading_rad", nullptr}};
  if (error.relative_pairs > 0) {
    json["rpe_m"] = as_json(error.relative_position_m);
    json["rpe_heading_rad"] = as_json(error.relative_heading_rad);
  }
  return json;
}

std::string format_line(const std::string& label, const TrajectoryError::Summary& errors,
                        double unit, int digits) {
  return label + "  RMSE " + format_fixed(errors.rms * unit, digits) + "  median " +
         format_fixed(errors.median * unit, digits) + "  95 % within " +
         format_fixed(errors.p95 * unit, digits) + "  maximum " +
         format_fixed(errors.largest * unit, digits);
}

Trajectory read(const std::string& path) {
  return Trajectory(read_trajectory(path));
}

/// The map that `panonav map` made: poses of its first part over time.
Estimate read_map(const std::string& path) {
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  const auto map = file.map("map");
  if (!map || map->nodes.empty()) {
    throw FileError(path, "holds no map; allowed: a memory file that panonav map made");
  }
  const VisualMemory memory = file.load();
  Estimate estimate{.map = *map};
  std::vector<StampedPose> poses;
  for (const MapNode& node : map->nodes) {
    const auto& stamp_s = memory.info(node.view).stamp_s;
    if (!stamp_s) {
      throw FileError(path, "view " + memory.info(node.view).name +
                                " has no stamp; allowed: a recording with the column 'stamp_s'");
    }
    estimate.stamp_s.emplace(node.view, *stamp_s);
    if (node.component == map->nodes.front().component) poses.push_back({*stamp_s, node.pose});
  }
  std::ranges::sort(poses, {}, &StampedPose::stamp_s);
  estimate.trajectory = Trajectory(poses);
  return estimate;
}

Estimate read_estimate(const std::string& path) {
  if (std::filesystem::path(path).extension() == ".panonav") return read_map(path);
  return {.trajectory = read(path)};
}

MapFigures compare_as_maps(const Estimate& estimate, const Trajectory& truth, double max_gap_s) {
  std::vector<Point2> map;
  std::vector<Point2> known;
  for (const StampedPose& pose : estimate.trajectory.poses()) {
    const auto there = truth.at(pose.stamp_s, max_gap_s);
    if (!there) continue;
    map.push_back(pose.pose.position());
    known.push_back(there->position());
  }
  MapFigures figures;
  if (is_comparable(map, known)) figures.shape = shape_difference(map, known);
  const std::size_t every = (map.size() + max_points - 1) / max_points;
  std::vector<Point2> thinned_map;
  std::vector<Point2> thinned_truth;
  for (std::size_t i = 0; every > 0 && i < map.size(); i += every) {
    thinned_map.push_back(map[i]);
    thinned_truth.push_back(known[i]);
  }
  if (3 * neighbours + 1 < 2 * static_cast<int>(thinned_map.size())) {
    figures.neighbours = neighbour_preservation(thinned_map, thinned_truth, neighbours);
  }
  if (!estimate.map.nodes.empty()) {
    figures.closures = count_closures(
        estimate.map,
        [&](ViewId view) -> std::optional<Point2> {
          const auto there = truth.at(estimate.stamp_s.at(view), max_gap_s);
          return there ? std::optional(there->position()) : std::nullopt;
        },
        right_closure_m);
  }
  return figures;
}

void print_figures(const MapFigures& figures, Session& session) {
  if (figures.shape) {
    session.print("Procrustes disparity " + format_fixed(figures.shape->value, 4) +
                  "  with a reflection allowed " + format_fixed(figures.shape->with_reflection, 4));
  }
  if (figures.neighbours) {
    session.print("neighbours kept      trustworthiness " +
                  format_fixed(figures.neighbours->trustworthiness, 3) + "  continuity " +
                  format_fixed(figures.neighbours->continuity, 3));
  }
  if (figures.closures) {
    session.print("loop closures        right " + std::to_string(figures.closures->right) +
                  "  wrong " + std::to_string(figures.closures->wrong));
  }
}

ExitCode evaluate(const EvaluateArguments& arguments, Session& session) {
  const Estimate estimate = read_estimate(arguments.estimate);
  const Trajectory truth = read(arguments.truth);
  const auto error = trajectory_error(estimate.trajectory, truth, arguments.options);
  if (!error) {
    return session.no_answer("panonav evaluate: fewer than two poses of " + arguments.estimate +
                             " have a stamp within " + arguments.truth +
                             "; do both count the same seconds?");
  }
  const MapFigures figures = compare_as_maps(estimate, truth, arguments.options.max_gap_s);
  if (session.json()) {
    ordered_json json = as_json(*error);
    json.update(as_json(figures));
    session.print(json_line(json));
    return ExitCode::done;
  }
  session.print(std::to_string(error->pairs) + " poses compared, " +
                std::to_string(error->left_out) + " without ground truth");
  session.print(format_line("ATE [m]            ", error->position_m, 1.0, 3));
  session.print(format_line("heading [degrees]  ", error->heading_rad, degrees(1.0), 2));
  if (error->relative_pairs > 0) {
    session.print("over " + to_text(arguments.options.relative_distance_m) + " m of path:");
    session.print(format_line("RPE [m]            ", error->relative_position_m, 1.0, 3));
    session.print(format_line("RPE [degrees]      ", error->relative_heading_rad, degrees(1.0), 2));
  }
  print_figures(figures, session);
  return ExitCode::done;
}

Run declare_evaluate(Arguments& arguments) {
  auto values = std::make_shared<EvaluateArguments>();
  arguments.positional("ESTIMATE", values->estimate,
                       "Trajectory as TUM text or CSV, or a memory file (NAME.panonav) with a map");
  arguments.positional("GROUND_TRUTH", values->truth, "Trajectory as TUM text or CSV");
  arguments.options("evaluation", values->options);
  arguments.common({"--align", "--align-scale"});
  arguments.refuse_unless(
      {"--align-scale", "--align-reflection"}, [values] { return values->options.align; },
      "with --align false");
  return [values](Session& session) { return evaluate(*values, session); };
}

}  // namespace

Verb evaluate_verb() {
  return {"evaluate", "Compare an estimated trajectory or map with the ground truth",
          "Poses are associated by stamp and aligned by least squares unless --align false. The "
          "exit code is 1 when no stamps match.",
          "  panonav evaluate estimate.tum truth.tum\n"
          "  panonav evaluate estimate.csv truth.csv --align-scale true --json\n"
          "  panonav evaluate office.panonav run/poses.csv",
          declare_evaluate};
}

}  // namespace panonav::command
