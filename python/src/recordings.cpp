#include "recordings.hpp"

#include <map>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::python {

namespace {

Dataset open_with_warnings(const std::filesystem::path& path, const InputOptions& options) {
  Dataset opened = [&] {
    const py::gil_scoped_release free;
    return open_input(path, options);
  }();
  for (const std::string& warning : opened.warnings) {
    if (PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 1) != 0) throw py::error_already_set();
  }
  return opened;
}

/// Images in RAM, as a data set needs them.
class HeldPictures final : public PictureStore {
 public:
  [[nodiscard]] Image read(std::size_t index) const override { return images_.at(index); }
  std::size_t add(Image image) {
    images_.push_back(std::move(image));
    return images_.size() - 1;
  }

 private:
  std::vector<Image> images_;
};

/// Makes a data set of images: paths, which are read when they are needed, or observations and
/// whatever `to_observation` accepts. Images without a name get their number as name.
Dataset make_dataset_of_images(const py::list& images, const std::optional<PictureSource>& source) {
  if (images.empty()) throw ContractError("images", "empty", "one image or more");
  if (!source) throw ContractError("source", "None", "a PictureSource, for images without one");
  Dataset dataset;
  dataset.folder = "images";
  dataset.source = *source;
  const auto held = std::make_shared<HeldPictures>();
  for (const py::handle& one : images) {
    DatasetEntry& entry = dataset.entries.emplace_back();
    if (is_path(one)) {
      entry.path = to_path(one, "image");
      entry.file = entry.path.filename().string();
    } else {
      Observation seen = to_observation(one);
      auto* const image = std::get_if<Image>(&seen.picture);
      if (image == nullptr) throw ContractError("image", "a Panorama", "an image of the camera");
      entry = {.file = seen.name,
               .path = seen.file,
               .stamp_s = seen.stamp_s,
               .pose = seen.pose,
               .odometry = seen.odometry,
               .tilt = seen.tilt,
               .store = held,
               .store_index = held->add(std::move(*image))};
    }
    if (entry.file.empty()) {
      const std::string number = std::to_string(dataset.entries.size() - 1);
      entry.file =
          "image_" + std::string(5 - std::min<std::size_t>(5, number.size()), '0') + number;
    }
  }
  std::map<std::string, std::size_t> counts;
  for (const DatasetEntry& entry : dataset.entries) ++counts[entry.file];
  for (DatasetEntry& entry : dataset.entries) {
    if (counts[entry.file] > 1 && !entry.path.empty()) entry.file = entry.path.string();
  }
  return dataset;
}

}  // namespace

Dataset to_dataset(const py::handle& recording, const std::optional<PictureSource>& source,
                   const std::optional<PictureSource>& default_source) {
  if (is_path(recording)) {
    InputOptions options;
    options.source = source;
    options.default_source = default_source;
    return open_with_warnings(to_path(recording, "recording"), options);
  }
  if (!py::isinstance<Dataset>(recording)) {
    const bool are_several =
        py::isinstance<py::list>(recording) || py::isinstance<py::tuple>(recording);
    py::list images;
    if (are_several) images = py::list(py::reinterpret_borrow<py::object>(recording));
    if (!are_several) images.append(recording);
    return make_dataset_of_images(images, source ? source : default_source);
  }
  if (source) throw OptionError("a Dataset has its own image layout; leave out 'source'");
  return recording.cast<const Dataset&>();
}

void require_memory_first(const std::filesystem::path& memory, const py::handle& input) {
  const auto has_memory_name = [](const std::filesystem::path& path) {
    std::error_code ignored;
    return is_server_address(path) ||
           (path.extension() == ".panonav" && !std::filesystem::is_directory(path, ignored));
  };
  if (!is_path(input)) return;
  const auto path = to_path(input, "input");
  if (!has_memory_name(path) || has_memory_name(memory)) return;
  throw OptionError("the arguments are in the wrong order: '" + memory.string() + "', '" +
                    path.string() + "'; the memory comes first: '" + path.string() + "', '" +
                    memory.string() + "'");
}

Dataset to_dataset_for_memory(const std::filesystem::path& memory, const py::handle& recording,
                              const std::optional<PictureSource>& source) {
  require_memory_first(memory, recording);
  std::optional<PictureSource> stored;
  {
    const py::gil_scoped_release free;
    if (memory_exists(memory)) stored = MemoryFile::open(memory, Access::read_only).header().source;
  }
  return to_dataset(recording, source, stored);
}

namespace {

py::object get_picture(const Observation& observation) {
  if (const auto* panorama = std::get_if<Panorama>(&observation.picture))
    return py::cast(*panorama);
  return to_array(std::get<Image>(observation.picture));
}

void bind_observations(py::module_& m) {
  py::class_<Observation>(m, "Observation",
                          "An image of a robot's camera and the other data that are known for "
                          "it. An image alone is accepted, too.")
      .def(py::init([](const py::object& picture, const std::string& name,
                       std::optional<double> stamp_s, const std::optional<Pose2>& odometry,
                       const std::optional<ReferencePose>& pose, const std::optional<Tilt>& tilt,
                       const std::optional<PictureSource>& narrow_source) {
             if (narrow_source && narrow_source->kind != PictureKind::pinhole) {
               throw ContractError("narrow_source", to_string(narrow_source->kind), "'pinhole'");
             }
             Observation observation = to_observation(picture);
             if (!name.empty()) observation.name = name;
             observation.stamp_s = stamp_s;
             observation.odometry = odometry;
             observation.pose = pose;
             observation.tilt = tilt;
             observation.narrow_source = narrow_source;
             return observation;
           }),
           py::arg("picture"), py::kw_only(), py::arg("name") = "", py::arg("stamp_s") = py::none(),
           py::arg("odometry") = py::none(), py::arg("pose") = py::none(),
           py::arg("tilt") = py::none(), py::arg("narrow_source") = py::none(),
           "`picture`: a Panorama, or an image as the camera delivers it: an array of uint8 or "
           "uint16, a PIL image, or the path of a file. `odometry`: absolute, in a frame that "
           "drifts. `pose`: in the world "
           "frame, if it is known. `tilt`: (roll, pitch) in radians. `narrow_source`: layout of "
           "kind 'pinhole' of a picture that shows a part of the azimuth, for "
           "PlaceRecogniser.localise "
           "with a memory that stores features for it (narrow=True).")
      .def_property_readonly("picture", &get_picture, "A Panorama, or an array of pixels.")
      .def_readonly("name", &Observation::name, "Name of the image, and of its view in a memory.")
      .def_readonly("stamp_s", &Observation::stamp_s, "Seconds at which it was taken, or None.")
      .def_readonly("odometry", &Observation::odometry,
                    "Absolute, in a frame that drifts against the world, or None.")
      .def_readonly("pose", &Observation::pose,
                    "In the world frame, if known; localisation of this image does not use it.")
      .def_property_readonly(
          "tilt", [](const Observation& o) { return o.tilt; },
          "(roll, pitch) in radians as an inertial sensor measured it, or None.")
      .def_readonly("narrow_source", &Observation::narrow_source,
                    "Layout of a picture that shows a part of the azimuth, or None.")
      .def("__repr__", [](const Observation& o) { return "Observation('" + o.name + "')"; });
}

void bind_datasets(py::module_& m) {
  Record<DatasetEntry>(m, "DatasetEntry", "An image of a data set and its data.")
      .field("file", &DatasetEntry::file, "Name of the file in the data set; unique.")
      .field("stamp_s", &DatasetEntry::stamp_s,
             "Time at which it was taken, seconds of the recording's clock, or None.")
      .field("pose", &DatasetEntry::pose, "In the world frame, or None.")
      .field("odometry", &DatasetEntry::odometry, "In the odometry frame, or None.")
      .field(
          "tilt", [](const DatasetEntry& e) { return e.tilt; }, "(roll, pitch), or None.")
      .type()
      .def(
          "observation", [](const DatasetEntry& entry) { return read_observation(entry); },
          py::call_guard<py::gil_scoped_release>(), "Reads the picture. Raises FileError.");
  py::class_<Dataset>(m, "Dataset",
                      "A recording: images in order, which are read only when needed. "
                      "Iterating returns its observations.")
      .def(py::init([](const py::object& path, const std::optional<PictureSource>& source,
                       bool recursive, const std::optional<std::string>& image_topic,
                       const std::optional<std::string>& odometry_topic,
                       const std::optional<std::pair<std::string, std::string>>& odometry_frames,
                       const std::optional<std::string>& imu_topic, bool ignore_gpano) {
             InputOptions options;
             options.source = source;
             options.recursive = recursive;
             options.ignore_gpano = ignore_gpano;
             options.topics = {image_topic, odometry_topic, imu_topic, odometry_frames};
             if (is_path(path)) return open_with_warnings(to_path(path, "path"), options);
             if (recursive || image_topic || odometry_topic || imu_topic || odometry_frames ||
                 ignore_gpano) {
               throw OptionError(
                   "a list of images has no topics and folders, and its GPano data are not read; "
                   "leave out their options");
             }
             return to_dataset(path, source);
           }),
           py::arg("path"), py::arg("source") = py::none(), py::kw_only(),
           py::arg("recursive") = false, py::arg("image_topic") = py::none(),
           py::arg("odometry_topic") = py::none(), py::arg("odometry_frames") = py::none(),
           py::arg("imu_topic") = py::none(), py::arg("ignore_gpano") = false,
           "`path`: a path, or a list of images (paths, arrays, PIL images or Observations). "
           "`source` is the image layout; it is not allowed for a data set (with dataset.toml). It "
           "describes the images of a folder, a video, a recording of topics (MCAP, rosbag2, "
           "ROS 1 bag), or a single image. `recursive`: also read the subfolders of a "
           "folder. Topics that are not named are found by their types; "
           "`odometry_frames`: odometry from the transforms between these two frames. "
           "`ignore_gpano`: read images as if they had no GPano data (pitch, roll and crop), such "
           "as those that are already level. Skipped or "
           "suspicious data cause a UserWarning.")
      .def_readonly("source", &Dataset::source, "Layout of all images.")
      .def_readonly("entries", &Dataset::entries, "In the order in which they were taken.")
      .def_readonly("left_out", &Dataset::left_out, "Files of a folder that are no images.")
      .def("__len__", [](const Dataset& d) { return d.entries.size(); })
      .def(
          "__getitem__",
          [](const Dataset& d, py::ssize_t index) {
            const auto size = static_cast<py::ssize_t>(d.entries.size());
            if (index < -size || index >= size) throw py::index_error("no such picture");
            const auto& entry =
                d.entries[static_cast<std::size_t>(index < 0 ? index + size : index)];
            const py::gil_scoped_release free;
            return read_observation(entry);
          },
          py::arg("index"), "Reads an observation.")
      .def(
          "select",
          [](const Dataset& d, int every, std::optional<double> every_s,
             std::optional<double> from_s, std::optional<double> to_s) {
            Dataset part = d;
            select_pictures(part, {every, every_s, from_s, to_s});
            return part;
          },
          py::arg("every") = 1, py::kw_only(), py::arg("every_s") = py::none(),
          py::arg("from_s") = py::none(), py::arg("to_s") = py::none(),
          "Returns a part: every n-th image, or by seconds from the first.")
      .def("__repr__", [](const Dataset& d) {
        return "Dataset('" + d.folder.string() + "', " + std::to_string(d.entries.size()) +
               " pictures)";
      });
}

void bind_images(py::module_& m) {
  m.def(
      "read_image",
      [](const std::filesystem::path& path) {
        const Image image = [&] {
          const py::gil_scoped_release free;
          return read_image(path);
        }();
        return to_array(image);
      },
      py::arg("path"),
      "Reads a PNG or JPEG file, upright: uint8 of (rows, columns) or (rows, columns, 3).");
  m.def(
      "write_png",
      [](const std::filesystem::path& path, const py::object& picture) {
        const PictureArray pixels(picture, "picture");
        const py::gil_scoped_release free;
        write_png(path, pixels.view());
      },
      py::arg("path"), py::arg("picture"), "Writes a PNG file atomically.");
}

void bind_memorising(py::module_& m) {
  Record<Memoriser::Counts>(m, "MemorisedCounts", "Numbers of views added to a memory.")
      .field("appended", &Memoriser::Counts::appended, "Number of added views.")
      .field("known_before", &Memoriser::Counts::known_before,
             "Observations whose views were already stored.");
  const std::string option_text =
      append_option_list("", {options_of<SignatureOptions>(), options_of<PreprocessingOptions>()});
  const auto options_from = [](const std::optional<PictureSource>& source, bool thumbnails,
                               bool features, bool narrow, const py::kwargs& keywords) {
    MemoriserOptions options{
        .source = source, .thumbnails = thumbnails, .features = features, .narrow = narrow};
    Keywords(keywords).options(options.signature).options(options.preprocessing).finish();
    return options;
  };
  using SharedMemoriser = Shared<Memoriser>;
  py::class_<SharedMemoriser>(m, "Memoriser",
                              "Appends observations to a memory file, which is created if there is "
                              "none.")
      .def(py::init([=](const std::filesystem::path& memory,
                        const std::optional<PictureSource>& source, bool thumbnails, bool features,
                        bool narrow, const py::kwargs& keywords) {
             return std::make_unique<SharedMemoriser>(
                 memory, options_from(source, thumbnails, features, narrow, keywords));
           }),
           py::arg("memory"), py::arg("source") = py::none(), py::arg("thumbnails") = true,
           py::arg("features") = true, py::arg("narrow") = false,
           ("`source` is the image layout; a new file needs it. Options and `narrow` (also store "
            "features by which narrow pictures are localised) are those of a new file." +
            option_text)
               .c_str())
      .def(
          "add",
          [](SharedMemoriser& memoriser, const py::object& observation, const std::string& name) {
            Observation seen = to_observation(observation);
            if (!name.empty()) seen.name = name;
            memoriser.change([&](Memoriser& one) { one.add(std::move(seen)); });
          },
          py::arg("observation"), py::arg("name") = "",
          "The observation's name becomes the view's. A new file appears with its 32nd "
          "observation, or at `finish`; after that a view is on the disk when this returns.")
      .def(
          "finish",
          [](SharedMemoriser& memoriser) {
            return memoriser.change([](Memoriser& one) { return one.finish(); });
          },
          "Writes pending views and stores the models learnt from all views.");
  m.def(
      "memorise",
      [=](const std::filesystem::path& memory, const py::object& recording,
          const std::optional<PictureSource>& source, bool thumbnails, bool features, int threads,
          const std::string& floor, bool narrow, const py::kwargs& keywords) {
        Dataset dataset = to_dataset_for_memory(memory, recording, source);
        for (DatasetEntry& entry : dataset.entries) {
          entry.file = make_name_on_floor(floor, entry.file);
        }
        const auto options = options_from(dataset.source, thumbnails, features, narrow, keywords);
        const py::gil_scoped_release free;
        InterruptibleExecutor executor(threads);
        Memoriser memoriser(memory, options);
        memoriser.recognise_renamed(dataset);
        DatasetObservations observations(dataset, executor, PictureColours::grey);
        std::vector<Observation> batch;
        const auto add = [&] {
          if (!batch.empty()) memoriser.add(std::move(batch), executor);
          batch.clear();
        };
        while (auto seen = observations.next()) {
          batch.push_back(std::move(*seen));
          if (!observations.has_decoded()) add();
        }
        add();
        return memoriser.finish(executor);
      },
      py::arg("memory"), py::arg("recording"), py::arg("source") = py::none(),
      py::arg("thumbnails") = true, py::arg("features") = true, py::arg("threads") = 0,
      py::arg("floor") = "", py::arg("narrow") = false,
      ("Stores the images of a recording as views in a memory, like `panonav memorise`.\n\n"
       "`memory`: the file, new or existing; `recording`: a Dataset, a path or a list "
       "of images. An "
       "image that cannot be read raises FileError; those before it are stored. threads: 0: "
       "one per core; floor: where the images were taken, in whose frame the positions are." +
       option_text)
          .c_str());
}

}  // namespace

void bind_recordings(py::module_& m) {
  bind_observations(m);
  bind_datasets(m);
  bind_images(m);
  bind_memorising(m);
}

}  // namespace panonav::python
