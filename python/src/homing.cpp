#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/catchment_survey.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav/relative_pose/view_pair.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

/// A homing result with the name of its image.
struct NamedHomingResult : HomingResult {
  std::string name;
};

void bind_vectors(py::module_& m) {
  Record<HomeVector>(m, "HomeVector", "The displacement and turn between two views.")
      .field("xi", &HomeVector::xi, "Displacement home along the robot's heading, in units of R.")
      .field("eta", &HomeVector::eta, "Displacement home to the robot's left, in units of R.")
      .field("heading_rad", &HomeVector::heading_rad, "Heading at home minus the current heading.")
      .field("correlation", &HomeVector::correlation, "Similarity of the views, -1 to 1.")
      .field("residual", &HomeVector::residual, "Share of the energy that stays unexplained.")
      .field("covariance", &HomeVector::covariance,
             "Nine numbers: of xi, eta and heading_rad, by the least squares.")
      .field("has_direction", &HomeVector::has_direction, "False at home.")
      .field("frequencies", &HomeVector::frequencies, "Effective number of frequencies.")
      .field("length", &HomeVector::length, "In units of R.")
      .field("direction_rad", &HomeVector::direction_rad, "In the current robot frame.");
  Record<PairEvidence>(m, "PairEvidence", "Relative pose of two views and how probable it is.")
      .field("vector", &PairEvidence::vector,
             "Displacement and turn from the current view to home.")
      .field("direction_deviation_rad", &PairEvidence::direction_deviation_rad,
             "Standard deviation of the direction, if it is right.")
      .field("turn_deviation_rad", &PairEvidence::turn_deviation_rad,
             "Standard deviation of the turn, if it is right.")
      .field("second", &PairEvidence::second,
             "The best solution with another turn, the second peak; None if there is no other.")
      .field("probability", &PairEvidence::probability,
             "That the direction is right within 45 degrees.");
  Record<PhaseReading>(m, "PhaseReading", "Relative pose of two views from their phases.")
      .field("turn_rad", &PhaseReading::turn_rad, "Heading of b minus heading of a.")
      .field("direction_a_rad", &PhaseReading::direction_a_rad, "Towards b, in the frame of a.")
      .field("direction_b_rad", &PhaseReading::direction_b_rad, "Towards a, in the frame of b.")
      .field("length", &PhaseReading::length, "In units of R.")
      .field("disagreement_rad", &PhaseReading::disagreement_rad,
             "Difference of the two directions.")
      .field("turn_disagreement_rad", &PhaseReading::turn_disagreement_rad,
             "Difference of the two turns.")
      .field("has_direction", &PhaseReading::has_direction, "False for images of one place.")
      .field("residual", &PhaseReading::residual,
             "Share of the energy of both views that is left unexplained, 0 to 1.");
  py::class_<HomingView>(m, "HomingView", "A view, prepared for homing.")
      .def(py::init([](const FourierSignature& signature, bool horizon) {
             return horizon ? horizon_view(signature) : homing_view(signature);
           }),
           py::arg("signature"), py::arg("horizon") = false,
           "Uses all rows of a signature, or the mean of those near the horizon.")
      .def_property_readonly("rows", &HomingView::rows,
                             "Number of rows, from the highest elevation to the lowest.")
      .def_property_readonly("components", &HomingView::components,
                             "Number of frequencies, from 0 on.");
  const std::string option_text = append_option_list("", {options_of<FourierHomingOptions>()});
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
      "pair_evidence",
      [](const HomingView& home, const HomingView& current, const py::kwargs& keywords) {
        FourierHomingOptions options;
        Keywords(keywords).options(options).finish();
        const py::gil_scoped_release free;
        return compute_pair_evidence(home, current, options);
      },
      py::arg("home"), py::arg("current"),
      ("Relative pose and its probability; None for views of two buildings." + option_text)
          .c_str());
  m.def(
      "image_difference",
      [](const HomingView& a, const HomingView& b, int highest) {
        return image_difference(a, b, highest);
      },
      py::arg("home"), py::arg("current"), py::arg("highest") = 0,
      "Difference at the best heading: 0 for the same place, about 1 for unrelated views.");
  m.def(
      "read_phases", [](const HomingView& a, const HomingView& b) { return read_phases(a, b); },
      py::arg("a"), py::arg("b"),
      "Relative pose from the phases of both views; None if a view has no structure.");
}

/// Makes a guide to the place of an image.
std::unique_ptr<HomingGuide> make_guide_to_image(const py::object& goal,
                                                 const std::optional<PictureSource>& source,
                                                 bool horizon, const py::kwargs& keywords) {
  FourierHomingOptions homing;
  HomingViewOptions views{.horizon = horizon};
  Keywords parsed(keywords);
  parsed.options(homing).options(views.signature).options(views.preprocessing).finish();
  const Observation observation = to_observation(goal);
  if (!source) throw ContractError("source", "None", "a PictureSource, without a memory");
  const py::gil_scoped_release free;
  return std::make_unique<HomingGuide>(observation, *source, views, homing);
}

/// Makes a guide to a view of a memory.
std::unique_ptr<HomingGuide> make_guide_to_view(const py::object& memory,
                                                const std::filesystem::path& goal,
                                                const std::optional<PictureSource>& source,
                                                bool horizon, const py::kwargs& keywords) {
  FourierHomingOptions homing;
  Keywords(keywords).options(homing).finish();
  const auto make = [&](const MemoryFile& file) {
    return std::make_unique<HomingGuide>(file, goal.string(), source, homing, 0, horizon);
  };
  if (py::isinstance<SharedFile>(memory)) return memory.cast<SharedFile&>().change(make);
  const auto path = to_path(memory, "memory");
  require_memory_first(path, py::str(goal.string()));
  const py::gil_scoped_release free;
  return make(MemoryFile::open(path, Access::read_only));
}

NamedHomingResult compute_homing_result(const HomingGuide& guide, const Observation& observation) {
  return {guide.home(observation), observation.name};
}

/// A survey with the names of its views.
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
  const Dataset& current_recording = current ? *current : homes;
  const auto places =
      current || turn_seed ? read_views(current_recording, options, turn_seed, executor) : goals;
  return {survey_catchment(goals, places, settings, current_recording.folder.string(), executor),
          goals.files, places.files};
}

void bind_catchment(py::module_& m) {
  Record<CatchmentResult::Bin>(m, "CatchmentBin", "Pairs of views in a range of distances.")
      .field(
          "distance_m", [](const CatchmentResult::Bin& b) { return b.homeward.distance_m; },
          "Middle of the range.")
      .field(
          "pairs", [](const CatchmentResult::Bin& b) { return b.homeward.pairs; },
          "Number of pairs of a place and a home.")
      .field(
          "homeward_component", [](const CatchmentResult::Bin& b) { return b.homeward.component; },
          "Mean cosine between home vector and true direction; nan without pairs.")
      .field("orientation_error_rad", &CatchmentResult::Bin::orientation_error_rad,
             "Circular standard deviation.");
  Record<NamedSurvey>(m, "CatchmentSurvey", "Distances from which views of a recording lead home.")
      .field("goal_names", &NamedSurvey::goal_names, "Names of the views that are homes.")
      .field("place_names", &NamedSurvey::place_names, "Names of the current views.")
      .field(
          "goals", [](const NamedSurvey& s) { return to_pose_rows(s.survey.goals); },
          "(goals, 3) of x_m, y_m, heading_rad.")
      .field(
          "places", [](const NamedSurvey& s) { return to_pose_rows(s.survey.places); },
          "(places, 3) of x_m, y_m, heading_rad, after random turns.")
      .field("spacing_m", &NamedSurvey::spacing_m, "Spacing of the places.")
      .field("typical_distance_m", &NamedSurvey::typical_distance_m,
             "Distance for a home vector of length 1, metres.")
      .field("pairs", &NamedSurvey::pairs, "Number of pairs at different places.")
      .field("homeward_component", &NamedSurvey::component,
             "Mean cosine between home vector and true direction: 1 is straight home, 0 random.")
      .field("orientation_error_rad", &NamedSurvey::orientation_error_rad,
             "Circular standard deviation.")
      .field("bins", &NamedSurvey::bins, "Results by distance.")
      .field("accepted_m", &NamedSurvey::accepted_m, "Distances of `areas`: 0 to 5 spacings.")
      .field("areas", &NamedSurvey::areas,
             "Mean number of places from which runs end within each distance of accepted_m.")
      .field(
          "homeward", [](const NamedSurvey& s) { return to_pair_matrix(s, s.survey.homeward); },
          "float32 of (goals, places): cosine between home vector and true direction; nan at home.")
      .field(
          "next", [](const NamedSurvey& s) { return to_pair_matrix(s, s.survey.next); },
          "uint32 of (goals, places): the place to which the step leads.")
      .field(
          "end_m", [](const NamedSurvey& s) { return to_pair_matrix(s, s.final_m); },
          "float32 of (goals, places): distance from home at the end of the run.")
      .type()
      .def(
          "places_within",
          [](const NamedSurvey& s, std::size_t goal, double accepted_m) {
            require(goal < s.survey.goals.size(), "goal", static_cast<double>(goal),
                    "0 to " + std::to_string(s.survey.goals.size() - 1));
            return count_places_in_catchment(s, goal, accepted_m);
          },
          py::arg("goal"), py::arg("accepted_m"),
          "Number of places from which runs end within accepted_m of this goal.");
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
        const Dataset homes = to_dataset(recording, source);
        std::optional<Dataset> second;
        if (!current.is_none()) second = to_dataset(current, source, homes.source);
        const py::gil_scoped_release free;
        return survey(homes, second, views, settings, turn_seed, threads);
      },
      py::arg("recording"), py::arg("current") = py::none(), py::arg("source") = py::none(),
      py::kw_only(), py::arg("horizon") = false, py::arg("published") = py::none(),
      py::arg("stages") = std::vector<int>{}, py::arg("up_to_m") = py::none(),
      py::arg("bin_m") = py::none(), py::arg("turn_seed") = py::none(), py::arg("threads") = 0,
      append_option_list(
          "Measures the distances from which views of a recording lead home, as `panonav "
          "catchment`: "
          "home vectors between all pairs of views, and runs from place to place.\n\n"
          "`current`: recording of the current views; None: the same recording. `horizon`: "
          "compare only the mean of the rows near the horizon. `published`: use the published rule "
          "with this number of frequencies instead of the homing options. `stages`: the highest "
          "frequency of each stage of a run. `up_to_m`: largest distance of pairs that are in "
          "the averages. `turn_seed`: seed for random rotations of the current views. If "
          "not set, max_step_m is twice the spacing of the places, obstacle_m is 0.8 times "
          "the spacing, and typical_distance_m is estimated from near pairs.",
          {options_of<FourierHomingOptions>(), options_of<SignatureOptions>(),
           options_of<PreprocessingOptions>(), options_of<HomingSurveyOptions>()})
          .c_str());
}

}  // namespace

void bind_homing(py::module_& m) {
  bind_vectors(m);
  bind_catchment(m);
  Record<NamedHomingResult>(m, "HomingResult", "The direction home computed from an observation.")
      .field("name", &NamedHomingResult::name, "Name of the image, if it has one.")
      .field(
          "known", [](const NamedHomingResult& r) { return r.known(); },
          "False: there is no answer.")
      .field("direction_rad", &NamedHomingResult::direction_rad,
             "In the robot frame; None if it is unknown or the robot is at home.")
      .field(
          "distance_r", [](const NamedHomingResult& r) { return r.distance_r(); }, "In units of R.")
      .field(
          "turn_rad", [](const NamedHomingResult& r) { return r.turn_rad(); },
          "Turn of the robot since the goal's view.")
      .field(
          "probability", [](const NamedHomingResult& r) { return r.probability(); },
          "That the direction is right within 45 degrees.")
      .field("evidence", &NamedHomingResult::evidence, "None if it is not known.");
  py::class_<HomingGuide>(m, "HomingGuide",
                          "Computes the direction to a goal from one observation. Several threads "
                          "may use it at the same time.")
      .def(
          py::init(&make_guide_to_view), py::arg("memory"), py::arg("goal"),
          py::arg("source") = py::none(), py::arg("horizon") = false,
          append_option_list(
              "`memory`: a path or a MemoryFile. `goal`: name or id of one of its views. `source`: "
              "layout of the robot's images; None: that of the memory. `horizon`: compare only "
              "the mean of the rows near the horizon.",
              {options_of<FourierHomingOptions>()})
              .c_str())
      .def(py::init(&make_guide_to_image), py::arg("goal"), py::arg("source") = py::none(),
           py::arg("horizon") = false,
           append_option_list(
               "`goal`: an observation made at the goal, or its image. `source`: layout of all "
               "images.",
               {options_of<FourierHomingOptions>(), options_of<SignatureOptions>(),
                options_of<PreprocessingOptions>()})
               .c_str())
      .def(
          "home",
          [](const HomingGuide& guide, const py::object& observation) {
            const Observation seen = to_observation(observation);
            const py::gil_scoped_release free;
            return compute_homing_result(guide, seen);
          },
          py::arg("observation"), "Computes the direction home for an observation.")
      .def(
          "home_all",
          [](const HomingGuide& guide, const py::object& recording,
             const std::optional<PictureSource>& source, int threads) {
            // The guide has the layout of its images; that of a list is not used.
            const auto unused = is_path(recording) ? std::nullopt : std::optional(PictureSource{});
            const Dataset dataset = to_dataset(recording, source, unused);
            const py::gil_scoped_release free;
            InterruptibleExecutor executor(threads);
            std::vector<NamedHomingResult> results;
            process_in_order(
                dataset.entries.size(), executor,
                [&](std::size_t i) {
                  return compute_homing_result(guide, read_observation(dataset.entries[i]));
                },
                [&](std::size_t, NamedHomingResult&& result) {
                  results.push_back(std::move(result));
                });
            return results;
          },
          py::arg("recording"), py::arg("source") = py::none(), py::arg("threads") = 0,
          "Does the same for each image of a Dataset, of a list, or of the recording at a path.");
}

}  // namespace panonav::python
