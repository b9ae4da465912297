#include "runs/orientation_note.hpp"

#include <filesystem>
#include <string_view>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/open_input.hpp"

namespace panonav::command {

namespace {

/// Returns " --columns-run clockwise --forward-column 0.250".
std::string format_flags(const OrientationCheck& check) {
  std::string flags;
  for (const auto& [field, value] : check.settings) {
    flags += (field == "columns" ? " --columns-run " : " --forward-column ") + value;
  }
  return flags;
}

/// Returns " columns = "clockwise", forward_column = 0.250".
std::string format_fields(const OrientationCheck& check) {
  std::string fields;
  for (const OrientationSetting& setting : check.settings) {
    fields += (fields.empty() ? " " : ", ") + to_toml(setting);
  }
  return fields;
}

}  // namespace

std::string describe_fault(const OrientationCheck& check, const PictureSource& source,
                           const std::string& recording) {
  if (!check.fault) return "";
  const std::string text = check.explanation + "; ";
  if (!check.corrected) return text + "calibrate the two lenses again (panonav calibrate --help)";
  if (source.camera) return text + "state" + format_fields(check) + " in the camera file";
  if (!recording.empty() && has_dataset_file(recording)) {
    const auto file = std::filesystem::path(recording) / "dataset.toml";
    return text + "state" + format_fields(check) + " in " + to_readable_line(file.string());
  }
  return text + "say" + format_flags(check);
}

ordered_json orientation_json(const OrientationCheck& check) {
  if (!check.fault) return nullptr;
  const OrientationEvidence& evidence = check.evidence;
  return {{"columns_run_opposite", check.fault->is_mirrored},
          {"forward_turn_deg", degrees(check.fault->turn_rad)},
          {"turns", evidence.turns()},
          {"opposite_turns", evidence.opposite_turns()},
          {"moves", evidence.moves()}};
}

ExitCode correct_recording(const std::vector<std::string>& inputs, const PictureArguments& pictures,
                           const std::string& out, Session& session) {
  const std::string& input = inputs.front();
  if (inputs.size() > 1) {
    throw UsageError("--orientation is with " + format_count(inputs.size(), "input") +
                     "; allowed: one recording");
  }
  const Dataset recording = open_recording(input, pictures, {}, session);
  const OrientationCheck check = check_orientation(recording, session.executor());
  if (check.explanation.empty()) {
    return session.no_answer(
        "panonav calibrate: " + to_readable_line(input) +
        " does not show the orientation of its images (" +
        format_count(check.evidence.turns(), "turn") + ", " +
        format_count(check.evidence.moves(), "motion") +
        "); it needs poses with headings or odometry, turns in both directions or motions in "
        "several, and images at most half as far apart as things around are away");
  }
  if (check.corrected) write_orientation(out, recording, check);
  if (session.json()) {
    const ordered_json written = check.corrected ? ordered_json(out) : ordered_json(nullptr);
    session.print(json_line({{"input", input},
                             {"orientation_fault", orientation_json(check)},
                             {"columns_right", to_json_or_null(check.columns_right)},
                             {"forward_right", to_json_or_null(check.forward_right)},
                             {"out", written}}));
    return ExitCode::done;
  }
  if (!check.fault) {
    session.print(check.explanation + "; there is nothing to correct, and no file is written");
    return ExitCode::done;
  }
  session.print(describe_fault(check, recording.source, input));
  if (check.corrected) session.print(out + " is written with these settings");
  return ExitCode::done;
}

}  // namespace panonav::command
