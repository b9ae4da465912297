#include "runs/reproduced_paper.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

std::string lead_of_f11(const lab::ReproductionOptions& options) {
  return "Fernandez, Paya, Reinoso, Amoros 2011, run in " + std::to_string(options.scenes) +
         " variants of two simulated places; loops closed, which its authors left to later work; "
         "a corridor of identical doors, Gazebo worlds and recordings where they are at hand, "
         "maps of up to " +
         std::to_string(options.max_views) + " views. Published figures beside ours.";
}

std::string lead_of_m03(const lab::ReproductionOptions& options) {
  return "Menegatti, Zoccarato, Pagello, Ishiguro 2003, run in " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.variants * options.runs) +
         " runs in each, and what its authors announced: a corridor of identical doors and the "
         "open air; Gazebo worlds and recordings where they are at hand. Published figures beside "
         "ours. Few runs give wide intervals, and rows may then miss their target by chance.";
}

std::string lead_of_m04(const lab::ReproductionOptions& options) {
  std::string places;
  for (const lab::MissionGrid& grid : options.mission_grids) {
    places += (places.empty() ? "" : ", ") + grid.scene;
  }
  return "Menegatti, Maeda, Ishiguro 2004, run on " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.queries) +
         " questions in each; views that arrange themselves, and " + std::to_string(options.runs) +
         " missions over such maps in each kind of place (" + places +
         "). Published figures beside ours. Few offices and questions give wide intervals, and "
         "rows may then miss their target by chance.";
}

std::string lead_of_navigation(const lab::ReproductionOptions& options) {
  return "What Menegatti, Maeda, Ishiguro 2004, section 3.5, leave to later work: maps of drives, "
         "changes, a robot that is kidnapped, blocked edges. " +
         std::to_string(options.runs) +
         " missions from random starts to random goals in each kind of place, " +
         std::to_string(options.scenes) +
         " variants of each. The robot sees pictures and feels what is in its way; it knows "
         "neither where it is nor where its references were taken.";
}

std::string lead_of_elsewhere(const lab::ReproductionOptions& options) {
  return "What panonav does on ground where it was not made: " + std::to_string(options.scenes) +
         " variants of each built-in scene, and the Gazebo worlds and recordings that "
         "are at hand; places of one asked of the memory of all others, noise, robots "
         "that tilt, whole floors. Rivals see the same pictures in the same run.";
}

std::string lead_of_s06(const lab::ReproductionOptions& options) {
  return "Stürzl, Mallot 2006, run in " + std::to_string(options.scenes) +
         " simulated toy house arenas, each recorded twice with different noise and slightly "
         "different light, headings at random; pictures are of the first arena. Runs home and "
         "chains of snapshots in rooms and Gazebo worlds. Published figures beside ours.";
}

std::string lead_of_y03(const lab::ReproductionOptions& options) {
  return "Yagi, Imai, Yachida 2003, run in " + std::to_string(options.scenes) +
         " variants of a simulated lab seen through a mirror camera with its noise; pictures are "
         "of the first. Then routes of 60 m, each recorded once and repeated in closed loop, " +
         std::to_string(options.runs) +
         " runs in each place, and a real route; Gazebo worlds and the recording where they are "
         "at hand. Published figures beside ours.";
}

constexpr std::array<ReproducedPaper, 7> papers{{
    {.name = "f11",
     .title = "Visual odometry and topological maps: the experiments of [F11]",
     .subject = "visual odometry and maps",
     .runs = true,
     .data = true,
     .lead = lead_of_f11},
    {.name = "m03",
     .title = "Monte-Carlo localisation: the experiments of [M03]",
     .subject = "Monte-Carlo localisation",
     .runs = true,
     .rows = true,
     .data = true,
     .only = true,
     .single_scene = true,
     .lead = lead_of_m03},
    {.name = "m04",
     .title = "Image-based memory: the experiments of [M04]",
     .subject = "localisation and views that arrange themselves",
     .queries = true,
     .runs = true,
     .rows = true,
     .lead = lead_of_m04},
    {.name = "navigation",
     .title = "Going somewhere: what [M04] leaves to later work",
     .subject = "what m04 leaves to later work",
     .runs = true,
     .data = true,
     .lead = lead_of_navigation},
    {.name = "s06",
     .title = "Visual homing: the experiments of [S06]",
     .subject = "homing",
     .data = true,
     .lead = lead_of_s06},
    {.name = "y03",
     .title = "Route panoramas: the experiments of [Y03]",
     .subject = "routes",
     .runs = true,
     .data = true,
     .lead = lead_of_y03},
    {.name = "elsewhere",
     .title = "Elsewhere: scenes, worlds and recordings beside each other",
     .subject = "known and unknown places, recordings, rivals",
     .queries = true,
     .runs = true,
     .rows = true,
     .data = true,
     .single_scene = true,
     .lead = lead_of_elsewhere},
}};

}  // namespace

std::span<const ReproducedPaper> reproduced_papers() {
  return papers;
}

lab::ReproductionOptions reproduction_options(const ReproducedPaper& paper,
                                              const ReproduceArguments& arguments,
                                              const std::filesystem::path& out) {
  lab::ReproductionOptions options = lab::default_options(paper.name, arguments.quick);
  options.out = out;
  if (paper.data) options.data = data_folder(arguments);
  options.seed = arguments.seed.value_or(options.seed);
  if (!paper.single_scene) check_scenes(arguments);
  options.scenes = arguments.scenes.value_or(options.scenes);
  options.runs = arguments.runs.value_or(options.runs);
  options.queries = arguments.queries.value_or(options.queries);
  options.rows = arguments.rows.value_or(options.rows);
  options.only = arguments.only.value_or(options.only);
  if (paper.name == "navigation") options.scenes = std::min(options.scenes, options.runs);
  options.mission_scenes = std::min({options.mission_scenes, options.scenes, options.runs});
  options.swept = std::min(options.swept, options.scenes);
  return options;
}

std::filesystem::path data_folder(const ReproduceArguments& wanted) {
  if (wanted.data) {
    if (!std::filesystem::is_directory(*wanted.data)) {
      throw FileError(*wanted.data, "there is no such folder");
    }
    return *wanted.data;
  }
  const char* const folder = std::getenv("PANONAV_DATA");
  return folder == nullptr ? "" : folder;
}

void check_scenes(const ReproduceArguments& wanted) {
  if (wanted.scenes && *wanted.scenes < 2) {
    throw OptionError("--scenes is '" + std::to_string(*wanted.scenes) + "'; allowed for " +
                      wanted.paper + ": from 2");
  }
}

void refuse_meaningless(const ReproducedPaper& paper, const ReproduceArguments& wanted) {
  const auto refuse = [&](bool given, bool known, const std::string& flag) {
    if (given && !known) {
      throw OptionError(flag + " has no meaning for " + std::string(paper.name));
    }
  };
  refuse(wanted.queries.has_value(), paper.queries, "--queries");
  refuse(wanted.runs.has_value(), paper.runs, "--runs");
  refuse(wanted.rows.has_value(), paper.rows, "--rows");
  refuse(wanted.data.has_value(), paper.data, "--data");
  refuse(wanted.only.has_value(), paper.only, "--only");
  refuse(wanted.continues, false, "--continue");
}

}  // namespace panonav::command
