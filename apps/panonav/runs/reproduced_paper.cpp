#include "runs/reproduced_paper.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

std::string describe_f11(const lab::ReproductionOptions& options) {
  return "Fernandez, Paya, Reinoso, Amoros 2011, run in " + std::to_string(options.scenes) +
         " variants of simulated places. Additional experiments: loop closures, which the "
         "authors left to future work; a corridor of identical doors; Gazebo worlds and recordings "
         "if they are available; maps of up to " +
         std::to_string(options.max_views) +
         " views. The tables compare published and measured results.";
}

std::string describe_m03(const lab::ReproductionOptions& options) {
  return "Menegatti, Zoccarato, Pagello, Ishiguro 2003, run in " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.variants * options.runs) +
         " runs in each. Additional experiments that the authors announced: a corridor of "
         "identical doors and outdoor scenes; Gazebo worlds and recordings if they are available. "
         "The tables compare published and measured results. Few runs give wide confidence "
         "intervals, so that a result can miss its target by chance.";
}

std::string describe_m04(const lab::ReproductionOptions& options) {
  std::string places;
  for (const lab::MissionGrid& grid : options.mission_grids) {
    places += (places.empty() ? "" : ", ") + grid.scene;
  }
  return "Menegatti, Maeda, Ishiguro 2004, run on " + std::to_string(options.scenes) +
         " simulated offices with a 25 cm grid of reference views, " +
         std::to_string(options.queries) + " queries in each; arrangements of views; and " +
         std::to_string(options.runs) + " missions over such maps in each kind of place (" +
         places +
         "). The tables compare published and measured results. Few offices and queries give wide "
         "confidence intervals, so that a result can miss its target by chance.";
}

std::string describe_navigation(const lab::ReproductionOptions& options) {
  return "Topics that Menegatti, Maeda, Ishiguro 2004, section 3.5, name as future work: maps of "
         "drives, changed scenes, a kidnapped robot, blocked paths. " +
         std::to_string(options.runs) +
         " missions from random starts to random goals in each kind of place, " +
         std::to_string(options.scenes) +
         " variants of each. The robot uses images and detects obstacles. It knows neither its own "
         "position nor the positions of its views.";
}

std::string describe_elsewhere(const lab::ReproductionOptions& options) {
  return "panonav in places that were not used for its development: " +
         std::to_string(options.scenes) +
         " variants of each built-in scene, Gazebo worlds and recordings if they are available. "
         "The experiments contain unknown places, noise, tilted robots and large buildings. Other "
         "methods process the same images in the same run.";
}

std::string describe_s06(const lab::ReproductionOptions& options) {
  return "Stürzl, Mallot 2006, run in " + std::to_string(options.scenes) +
         " simulated arenas of toy houses. Each arena is recorded twice with different noise, "
         "slightly different light and random headings. The images show the first arena. "
         "Additional experiments: drives home and chains of views in rooms and Gazebo worlds. The "
         "tables compare published and measured results.";
}

std::string describe_y03(const lab::ReproductionOptions& options) {
  return "Yagi, Imai, Yachida 2003, run in " + std::to_string(options.scenes) +
         " variants of a simulated lab with a mirror camera and its noise. The images show the "
         "first variant. Additional experiments: routes of 60 m, each recorded once and then "
         "driven again, " +
         std::to_string(options.runs) +
         " runs in each place; a real route; Gazebo worlds and recordings if they are available. "
         "The tables compare published and measured results.";
}

std::string describe_routes(const lab::ReproductionOptions& options) {
  return "Routes through simulated places, learnt once and driven again from the same pictures by "
         "snapshot chains, route panoramas, and six methods of others written from their papers: " +
         std::to_string(options.runs) +
         " routes of each length in each place. Odometry is 5 % wrong. Methods that cannot report "
         "an arrival need only pass the end of the route.";
}

constexpr std::array<ReproducedPaper, 8> papers{{
    {.name = "f11",
     .title = "Visual odometry and topological maps: the experiments of [F11]",
     .subject = "visual odometry and maps",
     .runs = true,
     .data = true,
     .lead = describe_f11},
    {.name = "m03",
     .title = "Monte-Carlo localisation: the experiments of [M03]",
     .subject = "Monte-Carlo localisation",
     .runs = true,
     .rows = true,
     .data = true,
     .only = true,
     .optics = true,
     .allows_single_scene = true,
     .lead = describe_m03},
    {.name = "m04",
     .title = "Image-based memory: the experiments of [M04]",
     .subject = "localisation and arrangement of views",
     .queries = true,
     .runs = true,
     .rows = true,
     .optics = true,
     .lead = describe_m04},
    {.name = "navigation",
     .title = "Navigation: topics that [M04] names as future work",
     .subject = "future work of m04",
     .runs = true,
     .data = true,
     .optics = true,
     .lead = describe_navigation},
    {.name = "s06",
     .title = "Visual homing: the experiments of [S06]",
     .subject = "homing",
     .data = true,
     .optics = true,
     .lead = describe_s06},
    {.name = "y03",
     .title = "Route panoramas: the experiments of [Y03]",
     .subject = "routes",
     .runs = true,
     .data = true,
     .lead = describe_y03},
    {.name = "elsewhere",
     .title = "More scenes, worlds and recordings",
     .subject = "known and unknown places, recordings, rivals",
     .queries = true,
     .runs = true,
     .rows = true,
     .data = true,
     .allows_single_scene = true,
     .lead = describe_elsewhere},
    {.name = "routes",
     .title = "Memories of routes and their rivals",
     .subject = "snapshot chains, route panoramas, rivals",
     .runs = true,
     .data = true,
     .allows_single_scene = true,
     .lead = describe_routes},
}};

}  // namespace

std::string describe_experiments(const ReproducedPaper& paper,
                                 const lab::ReproductionOptions& options) {
  std::string text = paper.lead(options);
  if (!paper.optics) return text;
  return text +
         (options.optics == lab::Optics::mirror
              ? " Views are unwarped from simulated images of a mirror camera, 640 x 480 (in "
                "missions 320 x 240)."
              : " Views are simulated panoramas without a mirror.");
}

std::span<const ReproducedPaper> list_reproduced_papers() {
  return papers;
}

lab::ReproductionOptions make_reproduction_options(const ReproducedPaper& paper,
                                                   const ReproduceArguments& arguments,
                                                   const std::filesystem::path& out) {
  lab::ReproductionOptions options = lab::default_options(paper.name, arguments.quick);
  options.out = out;
  if (paper.data) options.data = find_data_folder(arguments);
  options.seed = arguments.seed.value_or(options.seed);
  if (!paper.allows_single_scene) require_enough_scenes(arguments);
  options.scenes = arguments.scenes.value_or(options.scenes);
  options.runs = arguments.runs.value_or(options.runs);
  options.queries = arguments.queries.value_or(options.queries);
  options.rows = arguments.rows.value_or(options.rows);
  options.only = arguments.only.value_or(options.only);
  if (arguments.optics) {
    options.optics = *arguments.optics == "mirror" ? lab::Optics::mirror : lab::Optics::panorama;
  }
  if (paper.name == "navigation") options.scenes = std::min(options.scenes, options.runs);
  options.mission_scenes = std::min({options.mission_scenes, options.scenes, options.runs});
  options.swept = std::min(options.swept, options.scenes);
  return options;
}

std::filesystem::path find_data_folder(const ReproduceArguments& arguments) {
  if (arguments.data) {
    if (!std::filesystem::is_directory(*arguments.data)) {
      throw FileError(*arguments.data, "there is no such folder");
    }
    return *arguments.data;
  }
  const char* const folder = std::getenv("PANONAV_DATA");
  return folder == nullptr ? "" : folder;
}

void require_enough_scenes(const ReproduceArguments& arguments) {
  if (arguments.scenes && *arguments.scenes < 2) {
    throw OptionError("--scenes is '" + std::to_string(*arguments.scenes) + "'; allowed for " +
                      arguments.paper + ": from 2");
  }
}

void reject_meaningless_options(const ReproducedPaper& paper, const ReproduceArguments& arguments) {
  const auto refuse = [&](bool is_typed, bool known, const std::string& flag) {
    if (is_typed && !known) {
      throw OptionError(flag + " cannot be used with " + std::string(paper.name));
    }
  };
  refuse(arguments.queries.has_value(), paper.queries, "--queries");
  refuse(arguments.runs.has_value(), paper.runs, "--runs");
  refuse(arguments.rows.has_value(), paper.rows, "--rows");
  refuse(arguments.data.has_value(), paper.data, "--data");
  refuse(arguments.only.has_value(), paper.only, "--only");
  refuse(arguments.optics.has_value(), paper.optics, "--optics");
  refuse(arguments.continues, false, "--continue");
}

}  // namespace panonav::command
