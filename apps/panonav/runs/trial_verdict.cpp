#include <algorithm>
#include <string>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "runs/trial.hpp"

namespace panonav::command {

namespace {

std::string count_text(std::size_t count, std::size_t total) {
  return std::to_string(count) + " of " + std::to_string(total);
}

/// Returns the inputs as they are typed.
std::string list_inputs(const Trial& trial) {
  std::string inputs;
  for (const std::string& one : trial.inputs) {
    inputs += (inputs.empty() ? "" : " ") + quote_for_shell(one);
  }
  return inputs;
}

std::string format_band(const ElevationBand& kept) {
  return " --elevation-deg " + format_number(degrees(kept.bottom_rad)) + " " +
         format_number(degrees(kept.top_rad));
}

/// Returns the flags with which other verbs read the images.
std::string make_flags(const Trial& trial) {
  const PictureSource& source = *trial.guess.source;
  switch (trial.guess.form) {
    case PictureForm::sphere:
      return " --kind equirectangular" + format_band(*source.layout.kept_elevations);
    case PictureForm::strip:
      return " --kind panorama" + format_band(*source.layout.elevations);
    default:
      return " --kind mirror --camera " + quote_for_shell(trial.camera->string()) +
             (source.layout.kept_elevations ? format_band(*source.layout.kept_elevations) : "");
  }
}

/// True if the images are a walk whose motion is visible.
bool is_connected_walk(const Trial& trial) {
  return trial.is_in_order && 10 * trial.count_connected_steps() >= 9 * (trial.queries.size() - 1);
}

void add_image_findings(const Trial& trial, std::vector<std::string>& findings) {
  constexpr double max_lean_deg = 5.0;
  constexpr double min_brightness = 0.1;
  if (trial.example && trial.mean_brightness < min_brightness) {
    findings.push_back("The images are very dark (mean brightness " +
                       format_fixed(100.0 * trial.mean_brightness, 0) +
                       " %): use more light or a longer exposure.");
  }
  if (trial.lean && degrees(trial.lean->rad) > max_lean_deg) {
    const std::string degrees_text = format_fixed(degrees(trial.lean->rad), 0) + " degrees";
    findings.push_back(
        trial.lean->is_common
            ? "The camera leans by about " + degrees_text +
                  ", in the same direction in all images: mount it upright, because views are "
                  "compared row by row."
            : "The camera leans by about " + degrees_text +
                  ", in directions that differ between images: hold it upright, because views are "
                  "compared row by row.");
  }
  if (trial.carrier_top_rad) {
    findings.push_back("Below " + format_fixed(degrees(*trial.carrier_top_rad), 0) +
                       " degrees the images look the same everywhere: probably you or the robot. "
                       "These rows are left out.");
  }
  if (!trial.unread.empty()) {
    const bool is_one = trial.unread.size() == 1;
    findings.push_back(is_one ? trial.unread.front() + " cannot be read or has another size."
                              : format_count(trial.unread.size(), "image") +
                                    " cannot be read or have another size, such as " +
                                    trial.unread.front() + ".");
  }
  if (trial.camera) {
    findings.push_back("The calibration of the camera that was found is in " +
                       trial.camera->string() + ".");
  }
  const std::size_t tried = trial.queries.size();
  if (tried > 0 && trial.image_count > tried + trial.unread.size()) {
    findings.push_back(std::to_string(tried) + " of " + format_count(trial.image_count, "image") +
                       ", at equal intervals, " + (tried == 1 ? "was" : "were") + " tried.");
  }
}

void add_order_findings(const Trial& trial, std::vector<std::string>& findings) {
  const std::size_t steps = trial.queries.size() - 1;
  const std::size_t connected = trial.count_connected_steps();
  if (trial.is_arranged()) {
    findings.push_back(
        "The images are in no order, so they were arranged by their similarity: " +
        count_text(trial.map_summary->part_sizes.front(), trial.queries.size()) +
        " are in one part of the map. A route needs an order: for one, give the images names in "
        "the order in which they were taken, one every 20 to 50 cm, or use a video.");
    return;
  }
  if (!trial.is_in_order) {
    findings.emplace_back(
        "Images that follow each other look hardly more alike than any two of the images, so they "
        "are in no order, or too far apart. For a map, tracking and routes, give them names in the "
        "order in which they were taken, one every 20 to 50 cm, or use a video. Finding the most "
        "similar image needs no order.");
    return;
  }
  if (10 * connected < 9 * steps) {
    findings.push_back("The motion between consecutive images is visible for " +
                       count_text(connected, steps) +
                       " steps, so the images are too far apart. Take one every 20 to 50 cm, or a "
                       "video.");
  }
  if (!trial.map && trial.map_summary) {
    findings.push_back("No map was made: no " + std::to_string(ObservationModel::min_views) +
                       " images or more show the motion from one to the next.");
  } else if (trial.map_summary && trial.map_summary->part_sizes.size() > 1) {
    findings.push_back("The map has " + format_count(trial.map_summary->part_sizes.size(), "part") +
                       " that are not connected; the largest has " +
                       format_count(trial.map_summary->part_sizes.front(), "image") +
                       ". Parts are drawn beside each other, and distances between them "
                       "have no meaning.");
  }
}

/// Adds how many images were not recognised and how far apart they are, where that is too far.
void add_recognition_findings(const Trial& trial, std::vector<std::string>& findings) {
  const std::size_t images = trial.queries.size();
  if (10 * trial.count_known() >= 9 * images) return;
  const std::string reason = count_text(images - trial.count_known(), images) +
                             " images are not recognised among the others";
  findings.push_back(reason +
                     (trial.median_nearest_m
                          ? "; the nearest other image is " +
                                format_fixed(*trial.median_nearest_m, 2) + " m away (median)"
                          : "") +
                     ". Take images closer to each other, one every 20 to 50 cm, or a video.");
}

/// Adds whether recognition and tracking of these images can be expected in a later visit, too.
void add_use_findings(const Trial& trial, std::vector<std::string>& findings) {
  constexpr double close_step_m = 0.1;  // half of the shortest step that is recommended
  if (trial.median_step_m && *trial.median_step_m < close_step_m) {
    findings.push_back(
        "Consecutive images are " + format_fixed(100.0 * *trial.median_step_m, 1) +
        " cm apart (median), so each has others that show nearly the same. That they "
        "are recognised says little about a later visit: localise images of one.");
  }
  if (!trial.tracked) return;
  const std::string count = count_text(*trial.tracked, trial.queries.size());
  findings.push_back(trial.can_track()
                         ? "Tracking, tried with the same images, knows the position at " + count +
                               " images."
                         : "Tracking, tried with the same images, knows the position at " + count +
                               " images only: use localise or a route instead.");
}

std::vector<std::string> make_commands(const Trial& trial, bool is_good) {
  const std::string input = list_inputs(trial);
  const std::string memory = quote_for_shell(trial.memory.string());
  const std::string gallery = "panonav gallery " + memory + " -o " +
                              quote_for_shell(trial.memory.stem().string() + "_gallery");
  if (trial.is_standing()) return {gallery};
  if (!is_good) {
    const std::string flags = has_dataset_file(trial.inputs.front()) ? "" : make_flags(trial);
    return {gallery, "panonav memorise " + quote_for_shell(trial.memory.filename().string()) + " " +
                         input + flags};
  }
  std::vector<std::string> commands{"panonav localise " + memory + " " + input +
                                    " --report answers"};
  if (trial.can_track()) {
    commands.push_back("panonav track " + memory + " " + input + " --report tracked");
  }
  if (trial.has_positions || (trial.is_in_order && trial.has_large_part())) {
    commands.push_back("panonav route record " + memory + " " + input);
  }
  return commands;
}

TrialVerdict judge_unusable_images(const Trial& trial) {
  TrialVerdict verdict;
  verdict.headline = trial.guess.form == PictureForm::ordinary
                         ? "These are not omnidirectional images."
                         : "These images cannot be used as they are.";
  verdict.findings.push_back(trial.guess.explanation);
  if (trial.guess.form != PictureForm::two_lenses) return verdict;
  verdict.findings.emplace_back(
      "In the commands below, turned is a folder that contains only those four images. If the sky "
      "is at the outer side of both circles, add --left-roll-deg 90 --right-roll-deg -90 to the "
      "first command.");
  verdict.commands = {"panonav calibrate turned --profile dual-fisheye -o camera.toml",
                      "panonav memorise " +
                          quote_for_shell(choose_memory_name(trial.inputs.front())) + " " +
                          list_inputs(trial) + " --kind mirror --camera camera.toml" +
                          format_band(default_equirectangular_band)};
  return verdict;
}

}  // namespace

TrialVerdict judge_trial(const Trial& trial) {
  if (!trial.guess.source) return judge_unusable_images(trial);
  TrialVerdict verdict;
  if (trial.queries.size() < 2) {
    const bool is_one_image = trial.image_count == 1 && trial.unread.empty();
    verdict.headline = is_one_image ? "This is one image, and a trial needs a walk."
                                    : "There are fewer than two images that can be read.";
    verdict.findings.push_back(
        "Record a walk of 30 images or more, one every 20 to 50 cm, and try their folder or the "
        "video.");
    add_image_findings(trial, verdict.findings);
    verdict.findings.push_back(trial.guess.explanation);
    return verdict;
  }
  const std::size_t images = trial.queries.size();
  const std::size_t known = trial.count_known();
  verdict.headline = count_text(known, images) + " images were recognised among the others.";
  const bool is_connected = trial.has_positions || trial.is_arranged() || is_connected_walk(trial);
  verdict.is_good = 10 * known >= 9 * images && is_connected;
  constexpr std::size_t few_images = 10;
  if (images < few_images) {
    verdict.findings.push_back("These are only " + format_count(images, "image") +
                               ". Record a walk of 30 or more.");
    verdict.is_good = false;
  }
  if (trial.is_standing()) {
    verdict.is_good = false;
    verdict.headline = "The camera hardly moves: the images show one place.";
    verdict.findings.push_back(
        "If things around are 1.5 m away, two of the images are " +
        format_fixed(std::max(100.0 * *trial.median_distance_m, 1.0), 0) +
        " cm apart or less (median). Walk through the place, and take an image every 20 to 50 cm, "
        "or a video.");
  } else if (!trial.has_positions && images >= few_images) {
    add_order_findings(trial, verdict.findings);
  }
  if (!trial.is_standing()) add_recognition_findings(trial, verdict.findings);
  if (!trial.is_standing()) add_use_findings(trial, verdict.findings);
  add_image_findings(trial, verdict.findings);
  verdict.findings.push_back(trial.guess.explanation);
  if (trial.has_map() && trial.map_summary->unit == LengthUnit::view_steps) {
    verdict.findings.push_back(
        "Images alone do not show how long a metre is, so positions are in view steps: the " +
        std::string(trial.map_summary->view_step) + ". panonav scale makes metres of them.");
  }
  if (verdict.is_good) {
    verdict.findings.insert(verdict.findings.begin(),
                            trial.can_track() || !trial.tracked
                                ? "This recording works: panonav knows these places again."
                                : "panonav knows these places again, but this recording is not "
                                  "sufficient to track a robot.");
  } else {
    verdict.findings.emplace_back(
        "This recording does not work well. Record again as said above, and try the new images.");
  }
  verdict.commands = make_commands(trial, verdict.is_good);
  return verdict;
}

}  // namespace panonav::command
