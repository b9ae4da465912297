#include "runs/orientation_note.hpp"

#include <cmath>
#include <filesystem>
#include <string_view>
#include <variant>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

namespace {

/// A setting that is wrong: its field in a file, its flag (empty: it has none), and its value.
struct Correction {
  std::string field, flag, value;
};

std::vector<Correction> list_corrections(const OrientationFault& fault,
                                         const PictureSource& corrected) {
  std::vector<Correction> corrections;
  const auto& camera = corrected.camera;
  if (fault.is_mirrored) {
    const auto direction = camera ? camera->direction : corrected.layout.direction;
    corrections.push_back({camera ? "direction" : "columns", camera ? "" : "--columns-run",
                           std::string(to_string(direction))});
  }
  if (fault.turn_rad == 0.0) return corrections;
  if (camera && !std::holds_alternative<EquirectangularModel>(camera->model)) {
    corrections.push_back(
        {"forward_angle_deg", "", format_fixed(degrees(camera->forward_angle_rad), 0)});
  } else {
    corrections.push_back(
        {"forward_column", camera ? "" : "--forward-column",
         format_fixed(camera ? camera->forward_column : corrected.layout.forward_column, 3)});
  }
  return corrections;
}

}  // namespace

std::string describe_orientation(const OrientationFault& fault, const OrientationEvidence& evidence,
                                 const PictureSource& source, const std::string& recording) {
  std::string text;
  if (fault.is_mirrored) {
    const auto stated = source.camera ? source.camera->direction : source.layout.direction;
    text = "The columns of the images do not run " + std::string(to_string(stated)) + ": " +
           (evidence.opposite_turns() > 0 ? std::to_string(evidence.opposite_turns()) + " of " +
                                                format_count(evidence.turns(), "turn") +
                                                " of the robot are in the opposite direction. "
                                          : "motions of the robot in several directions fit only "
                                            "the opposite. ");
  }
  if (fault.turn_rad != 0.0) {
    text += "Forward is " + format_fixed(degrees(std::abs(fault.turn_rad)), 0) +
            " degrees to the " + (fault.turn_rad < 0.0 ? "left" : "right") +
            " of the stated direction, as " + std::to_string(evidence.moves()) +
            " motions of the robot show. ";
  }
  const auto corrected = correct_orientation(source, fault);
  if (!corrected) return text + "Calibrate the two lenses again: panonav calibrate --help";
  const auto corrections = list_corrections(fault, *corrected);
  const auto file = std::filesystem::path(recording) / "dataset.toml";
  const bool has_flags = !source.camera && !std::filesystem::exists(file);
  std::string settings;
  for (const Correction& one : corrections) {
    if (has_flags) {
      settings += " " + one.flag + " " + one.value;
    } else {
      const bool is_word = one.value.find_first_not_of("-0123456789.") != std::string::npos;
      settings += (settings.empty() ? " " : ", ") + one.field + " = " +
                  (is_word ? "\"" + one.value + "\"" : one.value);
    }
  }
  return text + "Memorise the images into a new memory with" + settings +
         (has_flags       ? ""
          : source.camera ? " in the camera file"
                          : " in " + file.string());
}

ordered_json orientation_json(const std::optional<OrientationFault>& fault,
                              const OrientationEvidence& evidence) {
  if (!fault) return nullptr;
  return {{"columns_run_opposite", fault->is_mirrored},
          {"forward_turn_deg", degrees(fault->turn_rad)},
          {"turns", evidence.turns()},
          {"opposite_turns", evidence.opposite_turns()},
          {"moves", evidence.moves()}};
}

}  // namespace panonav::command
