#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/catchment_survey.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/relative_pose/chance_match.hpp"
#include "panonav/relative_pose/view_pair.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

/// An answer and what was asked.
struct NamedWay : HomingResult {
  std::string name;
};

void bind_vectors(py::module_& m) {
  Record<HomeVector>(m, "HomeVector", "The displacement and turn between two views.")
      .field("xi", &HomeVector::xi, "Towards home, ahead of the robot, in units of R.")
      .field("eta", &HomeVector::eta, "The same to its left.")
      .field("heading_rad", &HomeVector::heading_rad, "Heading of home minus the current one.")
      .field("correlation", &HomeVector::correlation, "Similarity of the views, -1 to 1.")
      .field("residual", &HomeVector::residual, "Share of the energy that is left unexplained.")
      .field("confidence", &HomeVector::confidence, "0 to 1; near 0 at home.")
      .field("frequencies", &HomeVector::frequencies, "Effective number of them.")
      .field("length", &HomeVector::length, "In units of R.")
      .field("direction_rad", &HomeVector::direction_rad, "In the current robot frame.");
  Record<ChanceMatch>(m, "ChanceMatch", "How well two views match, beside noise.")
      .field("match", &ChanceMatch::match,
             "Sum of the correlations of the home vectors there and back, -2 to 2.")
      .field("chance", &ChanceMatch::chance,
             "Mean of the same over noise with the spectrum of the current view.")
      .field("deviation", &ChanceMatch::deviation, "Standard deviation of that.")
      .field("beyond_chance", &ChanceMatch::is_beyond_chance, "The views have something in common.")
      .field("direction_probability", &ChanceMatch::direction_probability,
             "That the home vector points home within 45 degrees.");
  Record<PhaseReading>(m, "PhaseReading", "Relative pose of two views from their phases.")
      .field("turn_rad", &PhaseReading::turn_rad, "Heading of b minus heading of a.")
      .field("direction_a_rad", &PhaseReading::direction_a_rad, "Towards b, in the frame of a.")
      .field("direction_b_rad", &PhaseReading::direction_b_rad, "Towards a, in the frame of b.")
      .field("length", &PhaseReading::length, "In units of R.")
      .field("disagreement_rad", &PhaseReading::disagreement_rad, "Of the two directions.")
      .field("turn_disagreement_rad", &PhaseReading::turn_disagreement_rad, "Of the two turns.")
      .field("points", &PhaseReading::has_direction, "False for pictures of one place.")
      .field("residual", &PhaseReading::residual,
             "Share of the energy of both views that is left unexplained, 0 to 1.");
  py::class_<HomingView>(m, "HomingView", "A view as homing needs it.")
      .def(py::init([](const FourierSignature& signature, bool horizon) {
             return horizon ? horizon_view(signature) : homing_view(signature);
           }),
           py::arg("signature"), py::arg("horizon") = false,
           "All rows of a signature, or their mean near the horizon.")
      .def_property_readonly("rows", &HomingView::rows,
                             "Number of rows, from the highest elevation to the lowest.")
      .def_property_readonly("components", &HomingView::components,
                             "Number of frequencies, from 0 on.");
  const std::string option_text = with_options("", {options_of<FourierHomingOptions>()});
  m.def(
      "home_vector",
      [](const HomingView& home, const HomingView& current, const py::kwargs& keywords) {
        FourierHomingOptions options;
        Keywords(keywords).options(options).finish();
        return home_vector(home, current, options);
      },
      py::arg("home"), py::arg("current"),
      ("The home vector by Fourier homing." + option_text).c_str());
  m.def(
      "chance_match",
      [](const HomingView& home, const HomingView& current, const py::kwargs& keywords) {
        FourierHomingOptions options;
        Keywords(keywords).options(options).finish();
        const py::gil_scoped_release free;
        return compare_with_chance(home, current, options);
      },
      py::arg("home"), py::arg("current"),
      ("How well two views match, beside how well noise does." + option_text).c_str());
  m.def(
      "image_difference",
      [](const HomingView& a, const HomingView& b, int highest) {
        return image_difference(a, b, highest);
      },
      py::arg("home"), py::arg("current"), py::arg("highest") = 0,
      "0 for the same place, about 1 for unrelated views; at the heading that fits best.");
  m.def(
      "read_phases", [](const HomingView& a, const HomingView& b) { return read_phases(a, b); },
      py::arg("a"), py::arg("b"), "Reads both ways; None when either view has no structure.");
}

std::unique_ptr<HomingGuide> guide_to(const py::object& goal, const py::object& memory,
                                      const std::optional<PictureSource>& source, bool horizon,
                                      const py::kwargs& keywords) {
  FourierHomingOptions homing;
  HomingViewOptions views{.horizon = horizon};
  Keywords parsed(keywords);
  parsed.options(homing);
  if (memory.is_none()) {
    parsed.options(views.signature).options(views.preprocessing).finish();
    const Observation observation = observation_from(goal);
    if (!source) throw ContractError("source", "None", "a PictureSource, without a memory");
    const py::gil_scoped_release free;
    return std::make_unique<HomingGuide>(observation, *source, views, homing);
  }
  parsed.finish();
  const auto name = goal.cast<std::string>();
  const auto make = [&](const MemoryFile& file) {
    return std::make_unique<HomingGuide>(file, name, source, homing, 0, horizon);
  };
  if (py::isinstance<SharedFile>(memory)) return memory.cast<SharedFile&>().change(make);
  const auto path = memory.cast<std::filesystem::path>();
  const py::gil_scoped_release free;
  return make(MemoryFile::open(path, Access::read_only));
}

NamedWay way_from(const HomingGuide& guide, const Observation& observation) {
  return {guide.home(observation), observation.name};
}

/// A survey and the pictures that it is about.
struct NamedSurvey : CatchmentResult {
  std::vector<std::string> goal_names;
  std::vector<std::string> place_names;
};

/// Returns an array of (goals, places).
template <class Value>
py::array_t<Value> to_pair_matrix(const NamedSurvey& found, const std::vector<Value>& values) {
  return py::array_t<Value>({static_cast<py::ssize_t>(found.survey.goals.size()),
                             static_cast<py::ssize_t>(found.survey.places.size())},
                            values.data());
}

NamedSurvey survey(const Dataset& homes, const std::optional<Dataset>& current,
                   const HomingViewOptions& options, const CatchmentSettings& settings,
                   std::optional<std::uint64_t> turn_seed, int threads) {
  InterruptibleExecutor executor(threads);
  const auto goals = read_views(homes, options, std::nullopt, executor);
  const Dataset& there = current ? *current : homes;
  const auto places =
      current || turn_seed ? read_views(there, options, turn_seed, executor) : goals;
  return {survey_catchment(goals, places, settings, there.folder.string(), executor), goals.files,
          places.files};
}

void bind_catchment(py::module_& m) {
  Record<CatchmentResult::Bin>(m, "CatchmentBin", "Pairs of a range of distances.")
      .field(
          "distance_m", [](const CatchmentResult::Bin& b) { return b.homeward.distance_m; },
          "Middle of the range.")
      .field(
          "pairs", [](const CatchmentResult::Bin& b) { return b.homeward.pairs; },
          "Of a place and a home in the range.")
      .field(
          "homeward_component", [](const CatchmentResult::Bin& b) { return b.homeward.component; },
          "Mean cosine between home vector and true direction; nan without pairs.")
      .field("orientation_error_rad", &CatchmentResult::Bin::orientation_error_rad,
             "Circular standard deviation.");
  Record<NamedSurvey>(m, "CatchmentSurvey", "From how far the views of a recording lead home.")
      .field("goal_names", &NamedSurvey::goal_names, "Of the views that are homes.")
      .field("place_names", &NamedSurvey::place_names, "Of the views to go home from.")
      .field(
          "goals", [](const NamedSurvey& s) { return pose_rows(s.survey.goals); },
          "(goals, 3) of x_m, y_m, heading_rad.")
      .field(
          "places", [](const NamedSurvey& s) { return pose_rows(s.survey.places); },
          "(places, 3) of x_m, y_m, heading_rad, as the robot was turned.")
      .field("spacing_m", &NamedSurvey::spacing_m, "Of the places.")
      .field("typical_distance_m", &NamedSurvey::typical_distance_m,
             "Distance for a home vector of length 1, metres.")
      .field("pairs", &NamedSurvey::pairs, "At different places.")
      .field("homeward_component", &NamedSurvey::component,
             "Mean cosine between home vector and true direction: 1 straight home, 0 chance.")
      .field("orientation_error_rad", &NamedSurvey::orientation_error_rad,
             "Circular standard deviation.")
      .field("bins", &NamedSurvey::bins, "By distance.")
      .field("accepted_m", &NamedSurvey::accepted_m, "Distances of `areas`: 0 to 5 spacings.")
      .field("areas", &NamedSurvey::areas,
             "Mean number of places from which runs end so near, for each of accepted_m.")
      .field(
          "homeward", [](const NamedSurvey& s) { return to_pair_matrix(s, s.survey.homeward); },
          "float32 of (goals, places): cosine between home vector and true direction; nan at home.")
      .field(
          "next", [](const NamedSurvey& s) { return to_pair_matrix(s, s.survey.next); },
          "uint32 of (goals, places): the place to which the step leads.")
      .field(
          "end_m", [](const NamedSurvey& s) { return to_pair_matrix(s, s.final_m); },
          "float32 of (goals, places): how far from home the run from this place ends.")
      .type()
      .def(
          "places_within",
          [](const NamedSurvey& s, std::size_t goal, double accepted_m) {
            require(goal < s.survey.goals.size(), "goal", static_cast<double>(goal),
                    "0 to " + std::to_string(s.survey.goals.size() - 1));
            return count_places_in_catchment(s, goal, accepted_m);
          },
          py::arg("goal"), py::arg("accepted_m"),
          "Number of places from which runs to this goal end so near.");
  m.def(
      "survey_catchment",
      [](const py::object& recording, const py::object& current,
         const std::optional<PictureSource>& source, bool horizon, std::optional<int> published,
         const std::vector<int>& stages, std::optional<double> up_to_m, std::optional<double> bin_m,
         std::optional<std::uint64_t> turn_seed, int threads, const py::kwargs& keywords) {
        HomingViewOptions views{.horizon = horizon};
        CatchmentSettings settings{.stages = stages, .bin_m = bin_m, .up_to_m = up_to_m};
        Keywords parsed(keywords);
        settings.has_typical_distance = parsed.has("typical_distance_m");
        settings.has_longest_step = parsed.has("max_step_m");
        settings.has_obstacle = parsed.has("obstacle_m");
        parsed.options(views.signature).options(views.preprocessing).options(settings.run);
        parsed.options(settings.homing).finish();
        if (published) {
          const int iterations = std::exchange(settings.homing.iterations, 0);
          if (settings.homing != FourierHomingOptions{}) {
            throw ContractError("published", *published,
                                "no option of homing but iterations beside");
          }
          settings.homing = published_homing_options(*published, iterations);
        }
        const Dataset homes = dataset_from(recording, source);
        std::optional<Dataset> second;
        if (!current.is_none()) second = dataset_from(current, source, homes.source);
        const py::gil_scoped_release free;
        return survey(homes, second, views, settings, turn_seed, threads);
      },
      py::arg("recording"), py::arg("current") = py::none(), py::arg("source") = py::none(),
      py::kw_only(), py::arg("horizon") = false, py::arg("published") = py::none(),
      py::arg("stages") = std::vector<int>{}, py::arg("up_to_m") = py::none(),
      py::arg("bin_m") = py::none(), py::arg("turn_seed") = py::none(), py::arg("threads") = 0,
      with_options(
          "Measures from how far the views of a recording lead home, as `panonav catchment` does: "
          "home vectors between all pairs of views, and runs from place to place.\n\n"
          "`current`: the recording of the views to go home from; None: the same. `horizon`: "
          "compare the mean of the rows near the horizon alone. `published`: the rule as published "
          "with this many frequencies, in place of the options of homing. `stages`: the highest "
          "frequency of each stage of a run. `up_to_m`: leave pairs that are farther apart out of "
          "the averages. `turn_seed`: turn the robot before each current view at random. Where "
          "they are not given, max_step_m is twice the spacing of the places, obstacle_m 0.8 of "
          "it, and typical_distance_m is learnt from near pairs.",
          {options_of<FourierHomingOptions>(), options_of<SignatureOptions>(),
           options_of<PreprocessingOptions>(), options_of<HomingSurveyOptions>()})
          .c_str());
}

}  // namespace

void bind_homing(py::module_& m) {
  bind_vectors(m);
  bind_catchment(m);
  Record<NamedWay>(m, "WayHome", "The direction home computed from an observation.")
      .field("name", &NamedWay::name, "Of the picture, where it has one.")
      .field("known", &NamedWay::known, "Whether the views have more in common than chance gives.")
      .field("direction_rad", &NamedWay::direction_rad,
             "In the frame of the robot; None where nothing is known, and at home.")
      .field("distance_r", &NamedWay::distance_r, "In units of R.")
      .field("turn_rad", &NamedWay::turn_rad, "By which the robot has turned since.")
      .field("probability", &NamedWay::probability,
             "That the direction is right within 45 degrees.")
      .field("vector", &NamedWay::vector, "All that was found, known or not.");
  const std::string option_text =
      with_options("", {options_of<FourierHomingOptions>(), options_of<SignatureOptions>(),
                        options_of<PreprocessingOptions>()});
  py::class_<HomingGuide>(m, "HomingGuide",
                          "Tells the way back to a goal from one observation. Several threads may "
                          "ask at a time.")
      .def(py::init(&guide_to), py::arg("goal"), py::arg("memory") = py::none(),
           py::arg("source") = py::none(), py::arg("horizon") = false,
           ("`goal`: name or id of a view of `memory` (a path or a MemoryFile); without a memory "
            "an observation made there, and `source` says how pictures lie. `horizon`: compare the "
            "mean of the rows near the horizon alone. Options of signature and preprocessing go "
            "without a memory only." +
            option_text)
               .c_str())
      .def(
          "home",
          [](const HomingGuide& guide, const py::object& observation) {
            const Observation seen = observation_from(observation);
            const py::gil_scoped_release free;
            return way_from(guide, seen);
          },
          py::arg("observation"), "The way home from where an observation was made.")
      .def(
          "home_all",
          [](const HomingGuide& guide, const py::object& recording,
             const std::optional<PictureSource>& source, int threads) {
            const Dataset dataset = dataset_from(recording, source);
            const py::gil_scoped_release free;
            InterruptibleExecutor executor(threads);
            std::vector<NamedWay> ways;
            process_in_order(
                dataset.entries.size(), executor,
                [&](std::size_t i) {
                  return way_from(guide, read_observation(dataset.entries[i]));
                },
                [&](std::size_t, NamedWay&& way) { ways.push_back(std::move(way)); });
            return ways;
          },
          py::arg("recording"), py::arg("source") = py::none(), py::arg("threads") = 0,
          "The same for each picture of a Dataset or of what lies at a path.");
}

}  // namespace panonav::python
