#include "bindings.hpp"
#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav/pipeline/memory_updater.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav/storage/memory_file.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

/// An answer and what was asked.
struct NamedPlace : Place {
  std::string name;
};
struct NamedEstimate : MonteCarloEstimate {
  std::string name;
};

void bind_places(py::module_& m) {
  Record<PlaceMatch>(m, "PlaceMatch", "A view of the memory that a picture resembles.")
      .field("name", &PlaceMatch::name, "Of the view.")
      .field("view", &PlaceMatch::view, "Its id.")
      .field("dissimilarity", &PlaceMatch::dissimilarity, "Integer L1 over packed magnitudes.")
      .field("column_difference", &PlaceMatch::column_difference,
             "Column by column, after turning.")
      .field("verified_features", &PlaceMatch::verified_features,
             "Local features that agree; None where they do not decide.")
      .field("heading_rad", &PlaceMatch::heading_rad, "Of the robot relative to this view.");
  Record<PositionEstimate>(m, "PlacePosition", "A position and how far off it may be.")
      .field("x_m", &PositionEstimate::x_m,
             "Along the x axis of the frame of the memory's positions.")
      .field("y_m", &PositionEstimate::y_m, "Along its y axis.")
      .field("radius_m", &PositionEstimate::radius_m,
             "The true position lies within it in 95 % of the cases.");
  Record<Circle>(m, "Circle", "A circle.")
      .field(
          "centre", [](const Circle& c) { return c.centre; }, "(x_m, y_m)")
      .field("radius_m", &Circle::radius_m, "0 for one point.");
  Record<LocalisationLevel>(m, "LocalisationLevel",
                            "The area where the robot may be after some components.")
      .field("components", &LocalisationLevel::components, "Compared.")
      .field("candidates", &LocalisationLevel::candidates, "Views that may still be the place.")
      .field("area_m2", &LocalisationLevel::area_m2, "Of the candidates' cells, or None.")
      .field("region", &LocalisationLevel::region, "A circle that covers them, or None.")
      .field("bytes_read", &LocalisationLevel::bytes_read, "By all levels so far.");
  Record<NamedPlace>(m, "Place", "The position and heading of an image.")
      .field("name", &NamedPlace::name, "Of the picture, where it has one.")
      .field("known", &NamedPlace::known, "Whether the place is one of the memory's.")
      .field("known_probability", &NamedPlace::known_probability, "That it is.")
      .field("position", &NamedPlace::position, "None: unknown.")
      .field("heading_rad", &NamedPlace::heading_rad, "None: unknown.")
      .field("matches", &NamedPlace::matches, "The best first; listed for unknown places, too.")
      .field("components", &NamedPlace::components, "Compared.")
      .field("bytes_read", &NamedPlace::bytes_read, "By the search.")
      .field("areas", &NamedPlace::areas, "From coarse to fine, where they were asked for.");
}

using SharedRecogniser = Shared<PlaceRecogniser>;

NamedPlace localise_one(const PlaceRecogniser& recogniser, const Observation& observation,
                        std::span<const std::string> excluded_names) {
  return {recogniser.localise(observation, excluded_names), observation.name};
}

PlaceRecogniserOptions recogniser_options(const std::optional<PictureSource>& source, bool areas,
                                          const py::kwargs& keywords) {
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

/// `memory`: a path or a MemoryFile.
std::unique_ptr<SharedRecogniser> make_recogniser(const py::object& memory,
                                                  const PlaceRecogniserOptions& options) {
  if (py::isinstance<SharedFile>(memory)) {
    auto& file = memory.cast<SharedFile&>();
    return file.change(
        [&](MemoryFile& f) { return std::make_unique<SharedRecogniser>(f, options); });
  }
  const auto path = memory.cast<std::filesystem::path>();
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
  const std::string option_text =
      with_options("", {options_of<LocaliserOptions>(), options_of<LocalisationAccuracy>("area")});
  py::class_<SharedRecogniser>(
      m, "PlaceRecogniser",
      "Tells from one picture where it was taken, by a memory file. Several threads may ask at a "
      "time.")
      .def(py::init([](const py::object& memory, const std::optional<PictureSource>& source,
                       bool areas, const py::kwargs& keywords) {
             return make_recogniser(memory, recogniser_options(source, areas, keywords));
           }),
           py::arg("memory"), py::arg("source") = py::none(), py::arg("areas") = false,
           ("`memory`: the path of a memory file, or a MemoryFile. `source`: how pictures lie; "
            "None: as the memory's own. `areas`: also tell the area where the robot may be; only "
            "then there are options area_*." +
            option_text)
               .c_str())
      .def(
          "localise",
          [](const SharedRecogniser& recogniser, const py::object& observation,
             const std::vector<std::string>& excluded_names) {
            const Observation seen = observation_from(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return localise_one(r, seen, excluded_names); });
          },
          py::arg("observation"), py::arg("excluded_names") = std::vector<std::string>{},
          "Where an observation was made: an Observation, a Panorama, an array of pixels, or the "
          "path of a picture. Views called `excluded_names` are not found.")
      .def(
          "localise_all",
          [](const SharedRecogniser& recogniser, const py::object& recording,
             bool exclude_same_file, int threads) {
            const auto source = recogniser.read(
                [](const PlaceRecogniser& r) { return r.encoder().header().source; });
            return localise_all(recogniser, dataset_from(recording, std::nullopt, source),
                                exclude_same_file, threads);
          },
          py::arg("recording"), py::kw_only(), py::arg("exclude_same_file") = false,
          py::arg("threads") = 0,
          "The same for each picture of a Dataset or of what lies at a path, on all threads.")
      .def(
          "packed",
          [](const SharedRecogniser& recogniser, const py::object& observation) {
            const Observation seen = observation_from(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return r.encoder().packed(seen); });
          },
          py::arg("observation"), "The signature that is compared.")
      .def(
          "panorama",
          [](const SharedRecogniser& recogniser, const py::object& observation) {
            const Observation seen = observation_from(observation);
            return recogniser.read(
                [&](const PlaceRecogniser& r) { return r.encoder().panorama(seen); });
          },
          py::arg("observation"), "The panorama as the memory has it.")
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
          "A view that can be found from now on; the file is not touched.");
  m.def(
      "localise",
      [](const py::object& memory, const py::object& observation, bool areas,
         const py::kwargs& keywords) {
        const auto recogniser =
            make_recogniser(memory, recogniser_options(std::nullopt, areas, keywords));
        const Observation seen = observation_from(observation);
        return recogniser->read(
            [&](const PlaceRecogniser& r) { return localise_one(r, seen, {}); });
      },
      py::arg("memory"), py::arg("observation"), py::arg("areas") = false,
      ("Tells from one picture where it was taken and which way the robot faced. Who asks more "
       "than once makes a PlaceRecogniser.\n\n"
       "`memory`: the path of a memory file, or a MemoryFile. `observation`: an Observation, a "
       "Panorama, an array of pixels (uint8), or the path of a picture, which lies as those of "
       "the memory." +
       option_text)
          .c_str());
}

std::vector<NamedEstimate> track_recording(Tracker& tracker, Dataset run, std::size_t every,
                                           int threads) {
  InterruptibleExecutor executor(threads);
  if (odometry_poses(run).empty()) {
    (void)add_visual_odometry(run, tracker.memory(), tracker.encoder(), executor);
  }
  std::vector<NamedEstimate> estimates;
  std::size_t moved = 0;
  process_in_order((run.entries.size() + every - 1) / every, executor,
                   [&](std::size_t i) {
                     return tracker.encoder().packed(read_observation(run.entries[i * every]));
                   },
                   [&](std::size_t i, PackedSignature&& view) {
                     for (; moved <= i * every; ++moved)
                       tracker.move_to(*run.entries[moved].odometry);
                     estimates.push_back({tracker.observe(view), run.entries[i * every].file});
                   });
  return estimates;
}

void bind_tracker(py::module_& m) {
  Record<PoseMode>(m, "PoseMode", "Particles that lie together.")
      .field("weight", &PoseMode::weight, "Sum over its particles.")
      .field("mean", &PoseMode::mean, "Weighted; the heading is the circular mean.")
      .field(
          "covariance",
          [](const PoseMode& mode) {
            return py::array_t<double>({3, 3}, mode.covariance.data());
          },
          "(3, 3) of x, y in m and heading in rad.")
      .field("spread_m", &PoseMode::spread_m,
             "Root mean square distance of the particles from the mean.")
      .field("heading_spread_rad", &PoseMode::heading_spread_rad, "The same of the headings.");
  Record<NamedEstimate>(m, "MonteCarloEstimate", "Where a tracked robot is.")
      .field("name", &NamedEstimate::name, "Of the picture, where it has one.")
      .field(
          "state", [](const NamedEstimate& e) { return name_of(e.state); },
          "'localised', 'ambiguous' or 'lost'.")
      .field("pose", &NamedEstimate::pose, "Mean of the heaviest mode; None when lost.")
      .field("inside", &NamedEstimate::inside, "Belief that the robot is in the memorised area.")
      .field("probability", &NamedEstimate::probability, "That it is at the heaviest mode.")
      .field("modes", &NamedEstimate::modes, "Heaviest first.")
      .field("spread_m", &NamedEstimate::spread_m,
             "Root mean square distance of all particles from their mean.")
      .field("particles", &NamedEstimate::particles,
             "Number of them; as many as KLD sampling asks for.")
      .field("effective_particles", &NamedEstimate::effective_particles,
             "Effective number of them, before resampling.")
      .field("resampled", &NamedEstimate::resampled,
             "Whether light particles were replaced by heavy ones.")
      .field("injected", &NamedEstimate::injected, "Particles that were replaced by new ones.")
      .field("difference_here", &NamedEstimate::difference_here,
             "Least column difference (0: equal, above about 0.6: unrelated) from the views near "
             "the particles, or None.")
      .field("difference_anywhere", &NamedEstimate::difference_anywhere,
             "The same from views anywhere, or None.");
  using SharedTracker = Shared<Tracker>;
  py::class_<SharedTracker>(
      m, "Tracker",
      "Follows a moving robot through its pictures and odometry by a memory file. The robot starts "
      "anywhere in the memorised area.")
      .def(py::init([](const py::object& memory, const std::optional<PictureSource>& source,
                       bool visual_odometry, const py::kwargs& keywords) {
             TrackerOptions options{.source = source};
             if (visual_odometry) options.odometry = visual_odometry_noise();
             Keywords(keywords).options(options.filter).options(options.odometry).finish();
             if (py::isinstance<SharedFile>(memory)) {
               return memory.cast<SharedFile&>().change(
                   [&](MemoryFile& f) { return std::make_unique<SharedTracker>(f, options); });
             }
             const auto path = memory.cast<std::filesystem::path>();
             const py::gil_scoped_release free;
             return std::make_unique<SharedTracker>(path, options);
           }),
           py::arg("memory"), py::arg("source") = py::none(), py::arg("visual_odometry") = false,
           with_options("`memory`: the path of a memory file, or a MemoryFile. `visual_odometry`: "
                        "the robot's motion is read from pictures, and as uncertain as that is.",
                        {options_of<MonteCarloOptions>(), options_of<OdometryNoise>()})
               .c_str())
      .def(
          "observe",
          [](SharedTracker& tracker, const py::object& observation) {
            const Observation seen = observation_from(observation);
            return tracker.change([&](Tracker& t) {
              return NamedEstimate{t.observe(seen), seen.name};
            });
          },
          py::arg("observation"),
          "Moves by the odometry, where the observation has one, and takes the picture into "
          "account.")
      .def(
          "move_to",
          [](SharedTracker& tracker, const Pose2& odometry) {
            tracker.change([&](Tracker& t) { t.move_to(odometry); });
          },
          py::arg("odometry"), "Odometry between pictures, absolute in its own frame.")
      .def(
          "start_anywhere",
          [](SharedTracker& tracker, std::optional<double> heading_rad) {
            tracker.change([&](Tracker& t) { t.start_globally(heading_rad); });
          },
          py::arg("heading_rad") = py::none(), "Forgets what is known of the robot.")
      .def(
          "start_at",
          [](SharedTracker& tracker, const Pose2& pose, double deviation_m,
             double heading_deviation_rad) {
            tracker.change(
                [&](Tracker& t) { t.start_at(pose, deviation_m, heading_deviation_rad); });
          },
          py::arg("pose"), py::arg("deviation_m"), py::arg("heading_deviation_rad"),
          "Around a known pose in the frame of the memory's positions; deviations of each "
          "coordinate, >= 0.")
      .def(
          "track",
          [](SharedTracker& tracker, const py::object& recording, int every, int threads) {
            require(every >= 1, "every", every, ">= 1");
            const auto source =
                tracker.read([](const Tracker& t) { return t.encoder().header().source; });
            Dataset run = dataset_from(recording, std::nullopt, source);
            return tracker.change([&](Tracker& t) {
              return track_recording(t, std::move(run), static_cast<std::size_t>(every), threads);
            });
          },
          py::arg("recording"), py::kw_only(), py::arg("every") = 1, py::arg("threads") = 0,
          "Follows the robot of a Dataset, or of what lies at a path, as `panonav track` does: "
          "moves "
          "with each picture's odometry and looks at every n-th picture. Without odometry motion "
          "is "
          "read from the pictures; a tracker for that is made with `visual_odometry`.")
      .def(
          "particles",
          [](const SharedTracker& tracker) {
            const Particles all =
                tracker.read([](const Tracker& t) { return t.localiser().particles(); });
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
          "(n, 4) of x_m, y_m, heading_rad, weight.");
}

void bind_updater(py::module_& m) {
  using Changes = MemoryUpdater::Changes;
  Record<Changes>(m, "MemoryUpdaterChanges", "Changes of a memory by a run.")
      .field("seen", &Changes::observations, "Observations with odometry.")
      .field("certain", &Changes::certain, "Of these, whose place was certain and new.")
      .field("reinforced", &Changes::reinforced,
             "Views of the memory that explained what the robot saw.")
      .field("added", &Changes::added, "Views of this run.")
      .field("replaced", &Changes::replaced, "Views that were dropped for added ones.")
      .field("forgotten", &Changes::forgotten,
             "Views that were dropped because they had failed for long.")
      .field("views", &Changes::views, "Of the memory now.");
  using SharedUpdater = Shared<MemoryUpdater>;
  py::class_<SharedUpdater>(
      m, "MemoryUpdater",
      "Keeps a memory file true while its places change: hears what a robot saw on a run and what "
      "the memory answered, and `finish` changes the file, in one step that MemoryFile.undo takes "
      "back. It is for one run; recognisers that were made before know the former views.")
      .def(py::init([](const std::filesystem::path& memory, const py::kwargs& keywords) {
             MemoryUpdateOptions options;
             Keywords(keywords).options(options).finish();
             const py::gil_scoped_release free;
             return std::make_unique<SharedUpdater>(memory, options);
           }),
           py::arg("memory"),
           with_options("`memory`: the path of a memory file that can be written, or the address "
                        "of a memory on a server.",
                        {options_of<MemoryUpdateOptions>()})
               .c_str())
      .def(
          "see",
          [](SharedUpdater& updater, const py::object& observation, const Panorama& panorama,
             const NamedPlace& place) {
            const Observation seen = observation_from(observation);
            updater.change([&](MemoryUpdater& u) { u.observe(seen, panorama, place); });
          },
          py::arg("observation"), py::arg("panorama"), py::arg("place"),
          "The next observation of the run, which needs its odometry (another says nothing and is "
          "left out), with its panorama (PlaceRecogniser.panorama) and its answer.")
      .def_property_readonly(
          "near_known_places",
          [](const SharedUpdater& updater) {
            return updater.read([](const MemoryUpdater& u) { return u.is_near_known_place(); });
          },
          "Whether the observation seen last is so near to one whose place was surely known that "
          "it will be placed by odometry.")
      .def(
          "finish",
          [](SharedUpdater& updater, const std::string& what) {
            return updater.change([&](MemoryUpdater& u) { return u.finish(what); });
          },
          py::arg("what"),
          "Changes the file and learns its models again. `what`: the run, for the file's history. "
          "Once.");
}

}  // namespace

void bind_localisation(py::module_& m) {
  bind_places(m);
  bind_recogniser(m);
  bind_tracker(m);
  bind_updater(m);
}

}  // namespace panonav::python
