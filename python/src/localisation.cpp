#include "bindings.hpp"
#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav/pipeline/memory_updater.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

constexpr const char* floor_text = "In whose frame the positions are; None: it has no name.";

std::optional<std::string> name_floor(std::string_view floor) {
  return floor.empty() ? std::nullopt : std::optional(std::string(floor));
}

/// A place with the name of its image.
struct NamedPlace : Place {
  std::string name;
};
struct NamedEstimate : MonteCarloEstimate {
  std::string name;
};

void bind_places(py::module_& m) {
  Record<PlaceMatch>(m, "PlaceMatch", "A view of the memory that is similar to an image.")
      .field("name", &PlaceMatch::name, "Name of the view.")
      .field("view", &PlaceMatch::view, "Id of the view.")
      .field("dissimilarity", &PlaceMatch::dissimilarity, "Integer L1 distance of magnitudes.")
      .field("column_difference", &PlaceMatch::column_difference,
             "Difference column by column at the same heading.")
      .field("verified_features", &PlaceMatch::verified_features,
             "Number of matching local features; None if they were not compared.")
      .field("heading_rad", &PlaceMatch::heading_rad, "Heading relative to this view.");
  Record<PositionEstimate::AlongRoute>(m, "AlongRoute", "What is known along a route.")
      .field("direction_rad", &PositionEstimate::AlongRoute::direction_rad,
             "Direction of the route.")
      .field("within_m", &PositionEstimate::AlongRoute::within_m,
             "Contains the error along the route in 95 % of cases.");
  Record<PositionEstimate>(m, "PlacePosition", "A position and its uncertainty.")
      .field("x_m", &PositionEstimate::x_m,
             "Along the x axis of the frame of the memory's positions.")
      .field("y_m", &PositionEstimate::y_m, "Along the y axis of the same frame.")
      .field("radius_m", &PositionEstimate::radius_m,
             "The true position is within this radius in 95 % of cases; None: not known.")
      .field("along_route", &PositionEstimate::along_route,
             "Along a line of views, the position is within this bound; None: no line.")
      .field(
          "covariance",
          [](const PositionEstimate& estimate) {
            const auto [xx, xy, yy] = estimate.covariance();
            return std::array{std::array{xx, xy}, std::array{xy, yy}};
          },
          "((xx, xy), (xy, yy)) in m^2; 1 km of deviation where nothing is known.");
  Record<Circle>(m, "Circle", "A circle.")
      .field(
          "centre", [](const Circle& c) { return c.centre; }, "(x_m, y_m)")
      .field("radius_m", &Circle::radius_m, "0 for one point.");
  Record<LocalisationLevel>(m, "LocalisationLevel",
                            "Area in which the robot may be, for a number of components.")
      .field("components", &LocalisationLevel::components, "Number of compared components.")
      .field("candidates", &LocalisationLevel::candidates, "Views at which the robot may be.")
      .field("area_m2", &LocalisationLevel::area_m2, "Area of the candidates' cells, or None.")
      .field("region", &LocalisationLevel::region, "A circle around the candidates, or None.")
      .field("bytes_read", &LocalisationLevel::bytes_read, "Bytes read up to this level.");
  Record<AlternativePlace>(m, "AlternativePlace", "Another place that the image may show.")
      .field("match", &AlternativePlace::match, "Its best match.")
      .field("probability", &AlternativePlace::probability, "That the image was taken there.")
      .field(
          "floor", [](const AlternativePlace& p) { return name_floor(p.floor()); }, floor_text)
      .field("position", &AlternativePlace::position, "None: unknown.")
      .field("heading_rad", &AlternativePlace::heading_rad, "None: unknown.");
  Record<NamedPlace>(m, "Place", "The position and heading of an image.")
      .field("name", &NamedPlace::name, "Name of the image, if it has one.")
      .field("known", &NamedPlace::known, "True if the place is in the memory.")
      .field("known_probability", &NamedPlace::known_probability, "Probability of `known`.")
      .field("probability", &NamedPlace::probability,
             "That the image was taken at `position`, not at one of `alternatives`.")
      .field("alternatives", &NamedPlace::alternatives,
             "Other places with at least 5 % of `known_probability`, most probable first.")
      .field(
          "floor", [](const NamedPlace& p) { return name_floor(p.floor()); }, floor_text)
      .field("position", &NamedPlace::position, "None: unknown.")
      .field("heading_rad", &NamedPlace::heading_rad, "None: unknown.")
      .field("matches", &NamedPlace::matches, "Best first; also given for unknown places.")
      .field("components", &NamedPlace::components, "Number of compared components.")
      .field("bytes_read", &NamedPlace::bytes_read, "Bytes that the search read.")
      .field("areas", &NamedPlace::areas, "Areas from coarse to fine, if requested.");
}

using SharedRecogniser = Shared<PlaceRecogniser>;

NamedPlace localise_one(const PlaceRecogniser& recogniser, const Observation& observation,
                        std::span<const std::string> excluded_names) {
  return {recogniser.localise(observation, excluded_names), observation.name};
}

PlaceRecogniserOptions make_recogniser_options(const std::optional<PictureSource>& source,
                                               bool areas, const py::kwargs& keywords) {
  PlaceRecogniserOptions options{.source = source};
  LocalisationAccuracy accuracy;
  Keywords parsed(keywords);
  parsed.options(options.localiser);
  if (areas) {
    parsed.options(accuracy, "area");
    options.areas = accuracy;
  }
  parsed.finish();
  return options;
}

/// Makes a recogniser. `memory` is a path or a MemoryFile.
std::unique_ptr<SharedRecogniser> make_recogniser(const py::object& memory,
                                                  const PlaceRecogniserOptions& options) {
  if (py::isinstance<SharedFile>(memory)) {
    auto& file = memory.cast<SharedFile&>();
    return file.change(
        [&](MemoryFile& f) { return std::make_unique<SharedRecogniser>(f, options); });
  }
  const auto path = to_path(memory, "memory");
  const py::gil_scoped_release free;
  return std::make_unique<SharedRecogniser>(path, options);
}

std::vector<NamedPlace> localise_all(const SharedRecogniser& recogniser, const Dataset& recording,
                                     bool exclude_same_file, int threads) {
  return recogniser.read([&](const PlaceRecogniser& r) {
    InterruptibleExecutor executor(threads);
    std::vector<NamedPlace> places;
    process_in_order(
        recording.entries.size(), executor,
        [&](std::size_t i) {
          const DatasetEntry& entry = recording.entries[i];
          return localise_one(r, read_observation(entry),
                              std::span(&entry.file, exclude_same_file ? 1 : 0));
        },
        [&](std::size_t, NamedPlace&& place) { places.push_back(std::move(place)); });
    return places;
  });
}

void bind_recogniser(py::module_& m) {
  const std::string option_text = append_option_list(
      "", {options_of<LocaliserOptions>(), options_of<LocalisationAccuracy>("area")});
  py::class_<SharedRecogniser>(
      m, "PlaceRecogniser",
      "Finds the place of an image in a memory file. Several threads may use it at the same "
      "time.")
      .def(py::init([](const py::object& memory, const std::optional<PictureSource>& source,
                       bool areas, const py::kwargs& keywords) {
             return make_recogniser(memory, make_recogniser_options(source, areas, keywords));
           }),
           py::arg("memory"), py::arg("source") = py::none(), py::arg("areas") = false,
           ("`memory`: the path of a memory file, or a MemoryFile. `source`: image layout; "
            "None: that of the memory. `areas`: also find the area in which the robot may be; only "
            "then the options area_* are allowed." +
            option_text)
               .c_str())
      .def(
          "localise",
          [](const SharedRecogniser& recogniser, const py::object& observation,
             const std::vector<std::string>& excluded_names) {
            const Observation seen = to_observation(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return localise_one(r, seen, excluded_names); });
          },
          py::arg("observation"), py::arg("excluded_names") = std::vector<std::string>{},
          "Finds the place of an Observation, a Panorama, an array of pixels, a PIL image, or the "
          "path of an image. Views with names in `excluded_names` are ignored.")
      .def_property_readonly(
          "length_unit",
          [](const SharedRecogniser& recogniser) {
            return recogniser.read(
                [](const PlaceRecogniser& r) { return to_string(r.length_unit()); });
          },
          "Unit of all positions, as `MemoryFile.length_unit`.")
      .def(
          "localise_all",
          [](const SharedRecogniser& recogniser, const py::object& recording,
             bool exclude_same_file, int threads) {
            const auto source = recogniser.read(
                [](const PlaceRecogniser& r) { return r.encoder().header().source; });
            return localise_all(recogniser, to_dataset(recording, std::nullopt, source),
                                exclude_same_file, threads);
          },
          py::arg("recording"), py::kw_only(), py::arg("exclude_same_file") = false,
          py::arg("threads") = 0,
          "Does the same for each image of a Dataset, of a list, or of the recording at a path.")
      .def(
          "packed",
          [](const SharedRecogniser& recogniser, const py::object& observation) {
            const Observation seen = to_observation(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return r.encoder().packed(seen); });
          },
          py::arg("observation"), "Returns the packed signature that is compared.")
      .def(
          "panorama",
          [](const SharedRecogniser& recogniser, const py::object& observation) {
            const Observation seen = to_observation(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return r.encoder().panorama(seen); });
          },
          py::arg("observation"), "Returns the panorama in the shape of the memory.")
      .def_property_readonly(
          "memory",
          [](const SharedRecogniser& recogniser) {
            return recogniser.read([](const PlaceRecogniser& r) {
              return std::make_shared<SharedMemory>(r.memory());
            });
          },
          "A copy of the views that can be found.")
      .def(
          "append",
          [](SharedRecogniser& recogniser, const PackedSignature& signature,
             const std::string& name, const std::optional<ReferencePose>& pose,
             std::optional<double> stamp_s) {
            recogniser.change([&](PlaceRecogniser& r) {
              r.append({.name = name, .pose = pose, .stamp_s = stamp_s}, signature);
            });
          },
          py::arg("signature"), py::arg("name"), py::arg("pose") = py::none(),
          py::arg("stamp_s") = py::none(),
          "Adds a view that can be found from now on; the file does not change.");
  m.def(
      "localise",
      [](const py::object& memory, const py::object& observation, bool areas,
         const py::kwargs& keywords) {
        if (is_path(memory)) {
          require_memory_first(to_path(memory, "memory"), observation);
        }
        const auto recogniser =
            make_recogniser(memory, make_recogniser_options(std::nullopt, areas, keywords));
        const Observation seen = to_observation(observation);
        return recogniser->read(
            [&](const PlaceRecogniser& r) { return localise_one(r, seen, {}); });
      },
      py::arg("memory"), py::arg("observation"), py::arg("areas") = false,
      ("Finds position and heading of one image. To localise several images, make "
       "a PlaceRecogniser.\n\n"
       "`memory`: the path of a memory file, or a MemoryFile. `observation`: an Observation, a "
       "Panorama, an array of pixels, a PIL image, or the path of an image, with the image layout "
       "of the memory." +
       option_text)
          .c_str());
}

std::vector<NamedEstimate> track_recording(Tracker& tracker, const Dataset& recorded,
                                           std::size_t every, int threads) {
  InterruptibleExecutor executor(threads);
  Dataset run = recorded;
  tracker.bridge_pauses(run, executor);
  const ViewEncoder& encoder = tracker.encoder();
  std::vector<NamedEstimate> estimates;
  process_in_order(
      run.entries.size(), executor,
      [&](std::size_t i) -> std::optional<FourierSignature> {
        if (i % every != 0 && !tracker.needs_view(run.entries, i)) return std::nullopt;
        return encoder.signature(read_observation(run.entries[i]));
      },
      [&](std::size_t i, std::optional<FourierSignature>&& view) {
        tracker.move(run.entries[i].odometry, view ? &*view : nullptr);
        if (i % every != 0) return;
        estimates.push_back(
            {tracker.observe(pack(*view, encoder.header().full_scale)), run.entries[i].file});
      });
  return estimates;
}

void bind_tracker(py::module_& m) {
  Record<PoseMode>(m, "PoseMode", "A cluster of particles.")
      .field("weight", &PoseMode::weight, "Sum of the weights of its particles.")
      .field(
          "floor", [](const PoseMode& mode) { return name_floor(mode.floor); }, floor_text)
      .field("mean", &PoseMode::mean, "Weighted mean; the heading is the circular mean.")
      .field(
          "covariance",
          [](const PoseMode& mode) {
            return py::array_t<double>({3, 3}, mode.covariance.data());
          },
          "(3, 3) of x, y in m and heading in rad.")
      .field("spread_m", &PoseMode::spread_m,
             "Root mean square distance of the particles from the mean.")
      .field("heading_spread_rad", &PoseMode::heading_spread_rad, "Same for the headings.");
  Record<NamedEstimate>(m, "MonteCarloEstimate", "Estimated pose of a tracked robot.")
      .field("name", &NamedEstimate::name, "Name of the image, if it has one.")
      .field(
          "state", [](const NamedEstimate& e) { return to_string(e.state); },
          "'localised', 'position_known', 'ambiguous' or 'lost'.")
      .field(
          "floor", [](const NamedEstimate& e) { return name_floor(e.floor()); }, floor_text)
      .field("pose", &NamedEstimate::pose,
             "Mean of the largest mode; None if lost or if the heading is unknown.")
      .field("position", &NamedEstimate::position, "(x_m, y_m) of the largest mode; None if lost.")
      .field("inside", &NamedEstimate::p_inside, "Probability that it is in the memory's area.")
      .field("probability", &NamedEstimate::probability, "That it is at the largest mode.")
      .field("modes", &NamedEstimate::modes, "Largest weight first.")
      .field("spread_m", &NamedEstimate::spread_m,
             "Root mean square distance of all particles from their mean.")
      .field("particles", &NamedEstimate::particles, "Number of particles, set by KLD sampling.")
      .field("effective_particles", &NamedEstimate::effective_particles,
             "Effective sample size before resampling.")
      .field("resampled", &NamedEstimate::resampled, "True if the particles were resampled.")
      .field("injected", &NamedEstimate::injected, "Number of particles replaced by new ones.")
      .field("difference_here", &NamedEstimate::difference_here,
             "Smallest column difference (0: equal, above about 0.6: unrelated) to views near "
             "the particles, or None.")
      .field("difference_anywhere", &NamedEstimate::difference_anywhere,
             "Smallest column difference to any view, or None.");
  using SharedTracker = Shared<Tracker>;
  py::class_<SharedTracker>(
      m, "Tracker",
      "Tracks a moving robot with images, odometry and a memory file. Without odometry, the motion "
      "is read from the images. The robot starts anywhere in the area of the memory.")
      .def(py::init([](const py::object& memory, const std::optional<PictureSource>& source,
                       const py::kwargs& keywords) {
             TrackerOptions options{.source = source};
             Keywords parsed(keywords);
             parsed.options(options.filter);
             OdometryNoise noise;
             const bool is_noise_set = parsed.has_unread();
             parsed.options(noise).finish();
             if (is_noise_set) options.odometry = noise;
             if (py::isinstance<SharedFile>(memory)) {
               return memory.cast<SharedFile&>().change(
                   [&](MemoryFile& f) { return std::make_unique<SharedTracker>(f, options); });
             }
             const auto path = to_path(memory, "memory");
             const py::gil_scoped_release free;
             return std::make_unique<SharedTracker>(path, options);
           }),
           py::arg("memory"), py::arg("source") = py::none(),
           append_option_list(
               "`memory`: the path of a memory file, or a MemoryFile. If no option of the noise is "
               "set (drive, translation_* and rotation_*), motion that is read from images has "
               "larger noise than these defaults.",
               {options_of<MonteCarloOptions>(), options_of<OdometryNoise>()})
               .c_str())
      .def(
          "observe",
          [](SharedTracker& tracker, const py::object& observation) {
            const Observation seen = to_observation(observation);
            return tracker.change([&](Tracker& t) {
              return NamedEstimate{t.observe(seen), seen.name};
            });
          },
          py::arg("observation"),
          "Moves the particles by the observation's odometry and weights them by the image. "
          "Without "
          "odometry, the motion is read from this image and the one before, unless `move_to` was "
          "called since.")
      .def(
          "move_to",
          [](SharedTracker& tracker, const Pose2& odometry) {
            tracker.change([&](Tracker& t) { t.move_to(odometry); });
          },
          py::arg("odometry"), "Moves the particles; `odometry` is a pose in the odometry frame.")
      .def(
          "start_anywhere",
          [](SharedTracker& tracker, std::optional<double> heading_rad) {
            tracker.change([&](Tracker& t) { t.start_globally(heading_rad); });
          },
          py::arg("heading_rad") = py::none(), "Starts again at an unknown position.")
      .def(
          "start_at",
          [](SharedTracker& tracker, const Pose2& pose, double deviation_m,
             double heading_deviation_rad) {
            tracker.change(
                [&](Tracker& t) { t.start_at(pose, deviation_m, heading_deviation_rad); });
          },
          py::arg("pose"), py::arg("deviation_m"), py::arg("heading_deviation_rad"),
          "Starts again around a pose in the memory's frame; standard deviations of each "
          "coordinate, >= 0.")
      .def(
          "track",
          [](SharedTracker& tracker, const py::object& recording, int every, int threads) {
            require(every >= 1, "every", every, ">= 1");
            const auto source =
                tracker.read([](const Tracker& t) { return t.encoder().header().source; });
            const Dataset run = to_dataset(recording, std::nullopt, source);
            return tracker.change([&](Tracker& t) {
              return track_recording(t, run, static_cast<std::size_t>(every), threads);
            });
          },
          py::arg("recording"), py::kw_only(), py::arg("every") = 1, py::arg("threads") = 0,
          "Tracks the robot of a Dataset, a list of images, or the recording at a path, like "
          "`panonav track`: "
          "moves with the odometry of each image, or without odometry by the motion read from all "
          "images, and observes every n-th image.")
      .def_property_readonly(
          "length_unit",
          [](const SharedTracker& tracker) {
            return tracker.read([](const Tracker& t) { return to_string(t.length_unit()); });
          },
          "Unit of all positions, as `MemoryFile.length_unit`.")
      .def(
          "particles",
          [](const SharedTracker& tracker) {
            const Particles all = tracker.read([](const Tracker& t) { return t.particles(); });
            py::array_t<double> rows({static_cast<py::ssize_t>(all.size()), py::ssize_t{4}});
            auto row = rows.mutable_unchecked<2>();
            for (std::size_t i = 0; i < all.size(); ++i) {
              const auto at = static_cast<py::ssize_t>(i);
              row(at, 0) = all.x_m[i];
              row(at, 1) = all.y_m[i];
              row(at, 2) = all.heading_rad[i];
              row(at, 3) = all.weight[i];
            }
            return rows;
          },
          "Returns (n, 4) of x_m, y_m, heading_rad, weight.");
}

void bind_updater(py::module_& m) {
  using Changes = MemoryUpdater::Changes;
  Record<Changes>(m, "MemoryUpdaterChanges", "Changes of a memory by a run.")
      .field("observations", &Changes::observations, "Number of observations with odometry.")
      .field("sure", &Changes::sure, "Number of these localised with a probability of 0.9 or more.")
      .field("certain", &Changes::certain, "Number of these whose place was certain and new.")
      .field("reinforced", &Changes::reinforced, "Number of views that matched the robot's images.")
      .field("added", &Changes::added, "Number of added views.")
      .field("replaced", &Changes::replaced, "Views that were replaced by added ones.")
      .field("forgotten", &Changes::forgotten,
             "Views that were deleted because they often did not match.")
      .field("views", &Changes::views, "Number of views in the memory now.");
  using SharedUpdater = Shared<MemoryUpdater>;
  py::class_<SharedUpdater>(
      m, "MemoryUpdater",
      "Updates a memory file when its places change. It collects observations of a run and their "
      "answers; `finish` then changes the file in one step, which MemoryFile.undo can "
      "revert. Use it for one run; recognisers that already exist keep the old views.")
      .def(py::init([](const std::filesystem::path& memory, const py::kwargs& keywords) {
             MemoryUpdateOptions options;
             Keywords(keywords).options(options).finish();
             const py::gil_scoped_release free;
             return std::make_unique<SharedUpdater>(memory, options);
           }),
           py::arg("memory"),
           append_option_list(
               "`memory`: the path of a memory file that can be written, or the address "
               "of a memory on a server.",
               {options_of<MemoryUpdateOptions>()})
               .c_str())
      .def(
          "observe",
          [](SharedUpdater& updater, const py::object& observation, const Panorama& panorama,
             const NamedPlace& place) {
            const Observation seen = to_observation(observation);
            updater.change([&](MemoryUpdater& u) { u.observe(seen, panorama, place); });
          },
          py::arg("observation"), py::arg("panorama"), py::arg("place"),
          "Adds the next observation of the run, which needs odometry (without it, it is "
          "ignored), with its panorama (PlaceRecogniser.panorama) and its answer.")
      .def_property_readonly(
          "is_near_known_place",
          [](const SharedUpdater& updater) {
            return updater.read([](const MemoryUpdater& u) { return u.is_near_known_place(); });
          },
          "True if the last observation is so near to one with a certain place that "
          "odometry gives its position.")
      .def(
          "finish",
          [](SharedUpdater& updater, const std::string& what) {
            return updater.change([&](MemoryUpdater& u) { return u.finish(what); });
          },
          py::arg("what"),
          "Changes the file and learns its models again. `what` names the run in the history. "
          "Call it once.");
}

}  // namespace

void bind_localisation(py::module_& m) {
  bind_places(m);
  bind_recogniser(m);
  bind_tracker(m);
  bind_updater(m);
}

}  // namespace panonav::python
