#include <algorithm>
#include <array>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/estimate_evaluation.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/recorded_poses.hpp"
#include "panonav_recordings/recording.hpp"
#include "reports/map_measures.hpp"
#include "runs/orientation_note.hpp"

namespace panonav::command {

namespace {

struct EvaluateArguments {
  std::string estimate;
  std::string truth;
  std::optional<std::string> estimate_topic;
  std::optional<std::string> truth_topic;
  TrajectoryError::Options options;
};

constexpr std::array<std::string_view, 3> align_names{"rigid", "similarity", "none"};

std::string_view align_name(const TrajectoryError::Options& options) {
  return align_names[static_cast<std::size_t>(options.align)];
}

ordered_json to_json(const TrajectoryError::Summary& errors) {
  return {{"rmse", errors.rms},
          {"mean", errors.mean},
          {"median", errors.median},
          {"p95", errors.p95},
          {"max", errors.largest}};
}

constexpr std::array<std::string_view, 3> pairing_names{"stamp", "image_number", "order"};

ordered_json to_json(const EstimateEvaluation& evaluation, const TrajectoryError::Options& options,
                     const std::array<std::string, 2>& formats) {
  const TrajectoryError& error = evaluation.trajectory;
  const Alignment3& alignment = error.truth_from_estimate;
  const Rotation3& q = alignment.rotation;
  ordered_json json{{"formats", formats},
                    {"paired_by", pairing_names[static_cast<std::size_t>(evaluation.pairing)]},
                    {"pairs", error.pairs},
                    {"left_out", error.left_out},
                    {"alignment",
                     {{"kind", align_name(options)},
                      {"dimensions", error.planar ? 2 : 3},
                      {"scale", alignment.scale},
                      {"rotation_xyzw", {q.x, q.y, q.z, q.w}},
                      {"x_m", alignment.translation.x_m},
                      {"y_m", alignment.translation.y_m},
                      {"z_m", alignment.translation.z_m},
                      {"reflected", alignment.reflected}}},
                    {"ate_m", to_json(error.position_m)},
                    {"rotation_rad", nullptr},
                    {"relative_pairs", error.relative_pairs},
                    {"rpe_m", nullptr},
                    {"rpe_rotation_rad", nullptr}};
  if (alignment.is_unique && evaluation.has_rotations)
    json["rotation_rad"] = to_json(error.rotation_rad);
  if (error.relative_pairs > 0) {
    json["rpe_m"] = to_json(error.relative_position_m);
    json["rpe_rotation_rad"] = to_json(error.relative_rotation_rad);
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

/// Says which alignment was used, as in "rigid alignment in space (SE3)".
std::string describe_alignment(const TrajectoryError& error,
                               const TrajectoryError::Options& options) {
  if (options.align == TrajectoryError::Align::none) return "no alignment";
  const bool has_scale = options.align == TrajectoryError::Align::similarity;
  std::string text = std::string(align_name(options)) + " alignment";
  text += error.planar ? " in the plane, as both stay at one height without tilt"
                       : std::string(" in space (") + (has_scale ? "Sim3)" : "SE3)");
  const Alignment3& alignment = error.truth_from_estimate;
  if (has_scale) text += ", scale " + format_fixed(alignment.scale, 6);
  if (alignment.reflected) text += ", mirrored";
  return text;
}

std::string format_line(const std::string& label, const TrajectoryError::Summary& errors,
                        double unit, int digits) {
  return label + "  RMSE " + format_fixed(errors.rms * unit, digits) + "  median " +
         format_fixed(errors.median * unit, digits) + "  95 % within " +
         format_fixed(errors.p95 * unit, digits) + "  maximum " +
         format_fixed(errors.largest * unit, digits);
}

TrajectoryFile read_poses(const std::string& input, const std::optional<std::string>& topic,
                          recordings::PoseUse use) {
  const std::string_view flag =
      use == recordings::PoseUse::estimate ? "--estimate-topic" : "--truth-topic";
  if (recordings::is_recording(input)) {
    try {
      return recordings::read_recorded_poses(input, topic, use);
    } catch (const FileError& error) {
      const std::string_view text = error.what();
      if (!text.ends_with("choose one")) throw;
      throw Error(std::string(text) + " with " + std::string(flag) + " NAME");
    }
  }
  if (topic && std::filesystem::exists(input)) {
    throw UsageError(std::string(flag) + " is " + to_readable_line(*topic) +
                     "; allowed: nothing, as " + to_readable_line(input) + " is no recording");
  }
  if (!std::filesystem::is_directory(input)) return read_trajectory_file(input);
  const auto table = std::filesystem::path(input) / "poses.csv";
  if (std::filesystem::is_regular_file(table)) return read_trajectory_file(table);
  throw FileError(input,
                  "is a folder without poses.csv; allowed: a data set with poses.csv, a file of "
                  "poses or a recording");
}

TrajectoryEstimate read_estimate(const EvaluateArguments& arguments) {
  if (!arguments.estimate_topic && !recordings::is_recording(arguments.estimate) &&
      !std::filesystem::is_directory(arguments.estimate)) {
    return panonav::read_estimate(arguments.estimate);
  }
  return {read_poses(arguments.estimate, arguments.estimate_topic, recordings::PoseUse::estimate),
          {},
          {}};
}

/// Selects an alignment with scale if estimate and truth are in different units. Throws UsageError
/// if another alignment is set.
void choose_alignment(const Arguments& declared, EvaluateArguments& arguments,
                      const TrajectoryFile& estimate, const TrajectoryFile& truth,
                      Session& session) {
  if (!truth.units.is_metric) session.set_length_unit(LengthUnit::view_steps);
  auto& align = arguments.options.align;
  if (estimate.units.is_metric == truth.units.is_metric ||
      align == TrajectoryError::Align::similarity) {
    return;
  }
  const std::string in_steps = truth.units.is_metric ? arguments.estimate : arguments.truth;
  if (declared.is_set("evaluation", "align")) {
    throw UsageError("--align is " + std::string(align_name(arguments.options)) +
                     "; allowed: similarity, as the lengths of " + to_readable_line(in_steps) +
                     " are in view steps (panonav scale makes metres of the view steps of a "
                     "memory)");
  }
  align = TrajectoryError::Align::similarity;
  session.note("panonav evaluate: the lengths of " + to_readable_line(in_steps) +
               " are in view steps, so the alignment includes the scale (--align similarity)");
}

std::string describe_pairing(const EstimateEvaluation& evaluation,
                             const std::array<std::string, 2>& formats,
                             const std::array<TrajectoryUnits, 2>& units) {
  switch (evaluation.pairing) {
    case EstimateEvaluation::Pairing::stamp:
      return "stamp";
    case EstimateEvaluation::Pairing::image_number:
      return "the numbers of their images, which have no stamps";
    case EstimateEvaluation::Pairing::order:
      break;
  }
  const bool is_estimate = units[0].times != TrajectoryUnits::Times::stamps;
  return "their order in the files, as the " + std::string(is_estimate ? "estimate" : "truth") +
         " (" + formats[is_estimate ? 0 : 1] + ") has no stamps";
}

std::string describe_span(const TrajectoryFile& file) {
  return to_text(file.poses.front().stamp_s) + " to " + to_text(file.poses.back().stamp_s);
}

void print_errors(const EstimateEvaluation& evaluation, const EvaluateArguments& arguments,
                  Session& session) {
  constexpr int metre_digits = 6;  // as many as evo_ape prints
  const TrajectoryError& error = evaluation.trajectory;
  const std::string unit = to_string(session.length_unit());
  const auto pad = [](std::string label) {
    constexpr std::size_t label_width = 19;
    label.resize(std::max(label.size(), label_width), ' ');
    return label;
  };
  session.print(format_line(pad("ATE [" + unit + "]"), error.position_m, 1.0, metre_digits));
  if (!evaluation.has_rotations) {
    session.print("rotation and RPE: unknown, as one of the trajectories has no headings");
  } else if (error.truth_from_estimate.is_unique) {
    session.print(format_line("rotation [degrees] ", error.rotation_rad, degrees(1.0), 2));
  } else {
    session.print(
        "rotation: unknown, as the positions lie on a line, about which any rotation fits");
  }
  if (error.relative_pairs > 0) {
    session.print("over " + to_text(arguments.options.relative_distance_m) + " " + unit +
                  " of path:");
    session.print(
        format_line(pad("RPE [" + unit + "]"), error.relative_position_m, 1.0, metre_digits));
    session.print(format_line("RPE [degrees]      ", error.relative_rotation_rad, degrees(1.0), 2));
  }
  if (evaluation.map) {
    session.print("Procrustes disparity " + format_fixed(evaluation.map->shape.value, 4) +
                  "  with a reflection allowed " +
                  format_fixed(evaluation.map->shape.with_reflection, 4));
    print_neighbours(*evaluation.map, session);
  }
  if (evaluation.closures) print_closures(*evaluation.closures, session);
}

/// Warns if fewer than half of the estimated poses are compared.
void note_few_pairs(const EstimateEvaluation& evaluation, const std::string& spans,
                    Session& session) {
  const TrajectoryError& error = evaluation.trajectory;
  if (error.pairs >= error.left_out) return;
  session.note("panonav evaluate: only " + std::to_string(error.pairs) + " of " +
               format_count(error.pairs + error.left_out, "estimated pose") +
               " have a true pose, so the errors say nothing about most of the estimate; " + spans);
}

/// Check of the orientation of the images from which a map was made.
struct MapOrientation {
  OrientationCheck check;
  std::string fault;  ///< line for people; empty: none that true poses show
};

/// Compares the views of a map with the true poses of their stamps; finds nothing for a trajectory.
MapOrientation check_map(const EvaluateArguments& arguments, const TrajectoryEstimate& estimate,
                         const TrajectoryFile& truth) {
  if (!estimate.map || truth.units.times != estimate.trajectory.units.times) return {};
  const auto memory = MemoryFile::open(arguments.estimate, Access::read_only);
  MapOrientation orientation{
      check_orientation(memory, truth, arguments.options.max_stamp_difference_s), {}};
  if (orientation.check.fault) {
    orientation.fault = "the stated orientation of the images is wrong: " +
                        describe_fault(orientation.check, memory.header().source, "");
  }
  return orientation;
}

ExitCode evaluate(const Arguments& declared, EvaluateArguments arguments, Session& session) {
  TrajectoryEstimate estimate = read_estimate(arguments);
  TrajectoryFile truth =
      read_poses(arguments.truth, arguments.truth_topic, recordings::PoseUse::ground_truth);
  choose_alignment(declared, arguments, estimate.trajectory, truth, session);
  const std::string spans = "the stamps of the estimate are " + describe_span(estimate.trajectory) +
                            ", those of the truth " + describe_span(truth);
  const std::string truth_name = truth.is_estimate ? "reference" : "ground truth";
  const std::array units{estimate.trajectory.units, truth.units};
  const std::array<std::string, 2> formats{estimate.trajectory.format, truth.format};
  const MapOrientation orientation = check_map(arguments, estimate, truth);
  const std::size_t repeated = estimate.trajectory.repeated + truth.repeated;
  std::optional<EstimateEvaluation> evaluation;
  try {
    evaluation = evaluate_estimate(std::move(estimate), std::move(truth), arguments.options);
  } catch (const ContractError& error) {
    throw FileError(arguments.estimate, error.what());
  }
  if (!evaluation) {
    return session.no_answer("panonav evaluate: fewer than two poses of " + arguments.estimate +
                             " have a true pose in " + arguments.truth + " within " +
                             to_text(arguments.options.max_stamp_difference_s) +
                             " s (--max-stamp-difference-s); " + spans +
                             "; check that both use the same clock");
  }
  if (repeated > 0) {
    session.note("panonav evaluate: " + format_count(repeated, "pose") +
                 " left out, because the pose before has the same stamp");
  }
  note_few_pairs(*evaluation, spans, session);
  if (session.json()) {
    ordered_json json = to_json(*evaluation, arguments.options, formats);
    json["orientation_fault"] = orientation_json(orientation.check);
    session.print(session.json_line(std::move(json)));
    return ExitCode::done;
  }
  const TrajectoryError& error = evaluation->trajectory;
  const bool is_by_stamp = evaluation->pairing == EstimateEvaluation::Pairing::stamp;
  session.print("estimate: " + formats[0] + ", " + truth_name + ": " + formats[1]);
  session.print(format_count(error.pairs, "pose") + " compared, " + std::to_string(error.left_out) +
                " without " + truth_name +
                (is_by_stamp && error.left_out > 0
                     ? " within " + to_text(arguments.options.max_stamp_difference_s) +
                           " s (--max-stamp-difference-s)"
                     : "") +
                "; paired by " + describe_pairing(*evaluation, formats, units));
  session.print(describe_alignment(error, arguments.options));
  print_errors(*evaluation, arguments, session);
  if (!orientation.fault.empty()) session.print(orientation.fault);
  return ExitCode::done;
}

Run declare_evaluate(Arguments& arguments) {
  auto values = std::make_shared<EvaluateArguments>();
  arguments.positional("ESTIMATE", values->estimate,
                       "Estimated trajectory: TUM, KITTI, EuRoC, a CSV table or a recording; or a "
                       "memory file (NAME.panonav) with a map");
  arguments.positional("GROUND_TRUTH", values->truth,
                       "True trajectory, with or without headings: TUM, KITTI, EuRoC, a CSV table, "
                       "a data set with poses.csv or a recording");
  arguments.option("--estimate-topic NAME", values->estimate_topic,
                   "Topic of the estimated poses in a recording; needed if there are several "
                   "topics with poses");
  arguments.option("--truth-topic NAME", values->truth_topic,
                   "Topic of the true poses in a recording; /tf: transforms of base_link in the "
                   "frame map or world. By default, a topic named as ground truth");
  arguments.options("evaluation", values->options);
  arguments.show_in_help({"--align"});
  arguments.reject_options_unless(
      {"--align-reflection"},
      [values] { return values->options.align != TrajectoryError::Align::none; },
      "with --align none");
  return [values, &arguments](Session& session) { return evaluate(arguments, *values, session); };
}

}  // namespace

Verb evaluate_verb() {
  return {
      "evaluate",
      VerbGroup::experiments,
      "Compare an estimated trajectory or map with the true one",
      "Each estimated pose is compared with the true pose of the nearest time stamp; poses without "
      "stamps (KITTI) are compared in their order. Unless --align is none, the estimate is first "
      "aligned with the true trajectory by least squares, as by evo_ape; an estimate in view steps "
      "is also scaled. The exit code is 1 if "
      "fewer than two estimated poses have a corresponding true pose.",
      "  panonav evaluate estimate.tum truth.tum\n"
      "  panonav evaluate estimate.txt euroc/data.csv --align similarity --json\n"
      "  panonav evaluate drive.bag drive.bag --estimate-topic /odom --truth-topic /vicon/robot\n"
      "  panonav evaluate office.panonav run/poses.csv",
      declare_evaluate};
}

}  // namespace panonav::command
