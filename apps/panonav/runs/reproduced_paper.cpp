#include "runs/reproduced_paper.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

std::string introduce_f11(const lab::ReproductionOptions& options) {
  return "Fernandez, Paya, Reinoso, Amoros 2011, run in " + std::to_string(options.scenes) +
         " variants of two simulated places; loops closed, which its authors left to later work; a "
         "corridor of identical doors, Gazebo worlds and recordings where they are available, maps "
         "of up to " +
         std::to_string(options.max_views) + " views. Published and measured figures.";
}

std::string introduce_m03(const lab::ReproductionOptions& options) {
  return "Menegatti, Zoccarato, Pagello, Ishiguro 2003, run in " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.variants * options.runs) +
         " runs in each, and what its authors announced: a corridor of identical doors and the "
         "open air; Gazebo worlds and recordings where they are available. Published and measured "
         "figures. Few runs give wide intervals, and rows may then miss their target by chance.";
}

std::string introduce_m04(const lab::ReproductionOptions& options) {
  std::string places;
  for (const lab::MissionGrid& grid : options.mission_grids) {
    places += (places.empty() ? "" : ", ") + grid.scene;
  }
  return "Menegatti, Maeda, Ishiguro 2004, run on " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.queries) +
         " questions in each; views that arrange themselves, and " + std::to_string(options.runs) +
         " missions over such maps in each kind of place (" + places +
         "). Published and measured figures. Few offices and questions give wide intervals, and "
         "rows may then miss their target by chance.";
}

std::string introduce_navigation(const lab::ReproductionOptions& options) {
  return "What Menegatti, Maeda, Ishiguro 2004, section 3.5, leave to later work: maps of drives, "
         "changes, a robot that is kidnapped, blocked edges. " +
         std::to_string(options.runs) +
         " missions from random starts to random goals in each kind of place, " +
         std::to_string(options.scenes) +
         " variants of each. The robot sees images and feels obstacles; it knows neither its "
         "position nor those of its references.";
}

std::string introduce_elsewhere(const lab::ReproductionOptions& options) {
  return "panonav in places for which it was not developed: " + std::to_string(options.scenes) +
         " variants of each built-in scene, and the Gazebo worlds and recordings that are "
         "available; queries from one place to the memory of all others, noise, robots that tilt, "
         "whole floors. Rivals see the same images in the same run.";
}

std::string introduce_s06(const lab::ReproductionOptions& options) {
  return "Stürzl, Mallot 2006, run in " + std::to_string(options.scenes) +
         " simulated toy house arenas, each recorded twice with different noise and slightly "
         "different light, headings at random; images are of the first arena. Runs home and chains "
         "of snapshots in rooms and Gazebo worlds. Published and measured figures.";
}

std::string introduce_y03(const lab::ReproductionOptions& options) {
  return "Yagi, Imai, Yachida 2003, run in " + std::to_string(options.scenes) +
         " variants of a simulated lab seen through a mirror camera with its noise; images are "
         "of the first. Then routes of 60 m, each recorded once and repeated in closed loop, " +
         std::to_string(options.runs) +
         " runs in each place, and a real route; Gazebo worlds and the recording where they are "
         "available. Published and measured figures.";
}

constexpr std::array<ReproducedPaper, 7> papers{{
    {.name = "f11",
     .title = "Visual odometry and topological maps: the experiments of [F11]",
     .subject = "visual odometry and maps",
     .runs = true,
     .data = true,
     .lead = introduce_f11},
    {.name = "m03",
     .title = "Monte-Carlo localisation: the experiments of [M03]",
     .subject = "Monte-Carlo localisation",
     .runs = true,
     .rows = true,
     .data = true,
     .only = true,
     .single_scene = true,
     .lead = introduce_m03},
    {.name = "m04",
     .title = "Image-based memory: the experiments of [M04]",
     .subject = "localisation and views that arrange themselves",
     .queries = true,
     .runs = true,
     .rows = true,
     .lead = introduce_m04},
    {.name = "navigation",
     .title = "Navigation: what [M04] leaves to later work",
     .subject = "what m04 leaves to later work",
     .runs = true,
     .data = true,
     .lead = introduce_navigation},
    {.name = "s06",
     .title = "Visual homing: the experiments of [S06]",
     .subject = "homing",
     .data = true,
     .lead = introduce_s06},
    {.name = "y03",
     .title = "Route panoramas: the experiments of [Y03]",
     .subject = "routes",
     .runs = true,
     .data = true,
     .lead = introduce_y03},
    {.name = "elsewhere",
     .title = "Elsewhere: scenes, worlds and recordings compared",
     .subject = "known and unknown places, recordings, rivals",
     .queries = true,
     .runs = true,
     .rows = true,
     .data = true,
     .single_scene = true,
     .lead = introduce_elsewhere},
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

std::filesystem::path data_folder(const ReproduceArguments& arguments) {
  if (arguments.data) {
    if (!std::filesystem::is_directory(*arguments.data)) {
      throw FileError(*arguments.data, "there is no such folder");
    }
    return *arguments.data;
  }
  const char* const folder = std::getenv("PANONAV_DATA");
  return folder == nullptr ? "" : folder;
}

void check_scenes(const ReproduceArguments& arguments) {
  if (arguments.scenes && *arguments.scenes < 2) {
    throw OptionError("--scenes is '" + std::to_string(*arguments.scenes) + "'; allowed for " +
                      arguments.paper + ": from 2");
  }
}

void refuse_meaningless(const ReproducedPaper& paper, const ReproduceArguments& arguments) {
  const auto refuse = [&](bool is_typed, bool known, const std::string& flag) {
    if (is_typed && !known) {
      throw OptionError(flag + " has no meaning for " + std::string(paper.name));
    }
  };
  refuse(arguments.queries.has_value(), paper.queries, "--queries");
  refuse(arguments.runs.has_value(), paper.runs, "--runs");
  refuse(arguments.rows.has_value(), paper.rows, "--rows");
  refuse(arguments.data.has_value(), paper.data, "--data");
  refuse(arguments.only.has_value(), paper.only, "--only");
  refuse(arguments.continues, false, "--continue");
}

}  // namespace panonav::command
