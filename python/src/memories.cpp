#include <cmath>

#include "bindings.hpp"
#include "memories.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_list.hpp"
#include "panonav_fleet/memory_synchronisation.hpp"

namespace panonav::python {

namespace {

constexpr std::array<const char*, 3> link_names{"sequence", "neighbour", "closure"};

Link::Kind parse_link_kind(const std::string& name) {
  for (std::size_t i = 0; i < link_names.size(); ++i) {
    if (name == link_names[i]) return static_cast<Link::Kind>(i);
  }
  throw ContractError("kind", "'" + name + "'", "'sequence', 'neighbour', 'closure'");
}

/// Converts a row of x_m, y_m, heading_rad, in which nan is unknown.
std::optional<ReferencePose> to_reference_pose(const double* row) {
  if (std::isnan(row[0]) && std::isnan(row[1])) return std::nullopt;
  return ReferencePose{row[0], row[1], std::isnan(row[2]) ? std::nullopt : std::optional(row[2])};
}

SearchResult search(const SharedMemory& memory, const PackedSignature& query, int top,
                    int components, const std::vector<ViewId>& excluded_views) {
  return memory.read([&](const VisualMemory& m) {
    return m.search(query, {.top = top, .components = components},
                    {.excluded_views = excluded_views, .allowed_rows = {}});
  });
}

/// Appends n views from arrays of (n, components, rows).
void extend(SharedMemory& memory, const py::object& given_magnitudes,
            const py::object& given_phases, const std::optional<std::vector<std::string>>& names,
            const py::object& given_poses) {
  const SignatureShape shape = memory.read([](const VisualMemory& m) { return m.shape(); });
  const auto magnitudes = require_exact_array<std::uint8_t>(given_magnitudes, "magnitudes",
                                                            {-1, shape.components, shape.rows});
  const py::ssize_t count = magnitudes.shape(0);
  const auto phases = require_exact_array<std::uint8_t>(given_phases, "phases",
                                                        {count, shape.components, shape.rows});
  std::optional<py::array_t<double, py::array::c_style>> poses;
  if (!given_poses.is_none()) poses = to_number_rows(given_poses, "poses", 3);
  const auto check = [&](std::size_t size, const char* what) {
    require(size == static_cast<std::size_t>(count), what, static_cast<double>(size),
            "one for each signature");
  };
  if (names) check(names->size(), "number of names");
  if (poses) check(static_cast<std::size_t>(poses->shape(0)), "number of poses");
  const std::uint8_t* const first_magnitude = magnitudes.data();
  const std::uint8_t* const first_phase = phases.data();
  const double* const first_pose = poses ? poses->data() : nullptr;
  memory.change([&](VisualMemory& m) {
    PackedSignature signature{shape, {}, {}};
    const std::size_t size = shape.size();
    std::size_t next = m.empty() ? 0 : m.views().back().value + std::size_t{1};
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      signature.magnitudes.assign(first_magnitude + i * size, first_magnitude + (i + 1) * size);
      signature.phases.assign(first_phase + i * size, first_phase + (i + 1) * size);
      m.append(signature,
               {.name = names ? (*names)[i] : std::to_string(next++),
                .pose = first_pose ? to_reference_pose(first_pose + 3 * i) : std::nullopt,
                .stamp_s = std::nullopt});
      if (i % 1024 == 0) check_signals();
    }
  });
}

/// Returns rows of x_m, y_m, heading_rad, one per view in the order of ids; nan is unknown.
py::array_t<double> make_pose_rows(const SharedMemory& memory) {
  std::vector<double> rows;
  memory.read([&](const VisualMemory& m) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    for (const ViewId view : m.views()) {
      const auto& pose = m.info(view).pose;
      rows.push_back(pose ? pose->x_m : unknown);
      rows.push_back(pose ? pose->y_m : unknown);
      rows.push_back(pose ? pose->heading_rad.value_or(unknown) : unknown);
    }
  });
  return py::array_t<double>({static_cast<py::ssize_t>(rows.size() / 3), py::ssize_t{3}},
                             rows.data());
}

void bind_visual_memory(py::module_& m) {
  Record<Match>(m, "Match", "A view that a search found.")
      .field("view", &Match::view, "Id of the view.")
      .field("dissimilarity", &Match::dissimilarity, "Integer L1 distance of magnitudes.");
  Record<SearchResult>(m, "SearchResult", "The result of an exact search.")
      .field("matches", &SearchResult::matches, "Ascending (dissimilarity, view).")
      .field("bytes_read", &SearchResult::bytes_read, "Bytes that the search read.")
      .field("bytes_in_full", &SearchResult::bytes_in_full, "Bytes that a full scan would read.")
      .field("views_in_full", &SearchResult::views_in_full, "Number of completely compared views.");
  Record<ReferenceInfo>(m, "ReferenceInfo", "Data of a view besides its signature.")
      .field("name", &ReferenceInfo::name, "Unique within a memory.")
      .field("pose", &ReferenceInfo::pose, "Pose at which it was taken, or None.")
      .field("stamp_s", &ReferenceInfo::stamp_s, "Seconds at which it was taken, or None.");
  Record<Link>(m, "Link", "Two views between which a robot can move.")
      .field("a", &Link::a, "Id of one view.")
      .field("b", &Link::b, "Id of the other view.")
      .field(
          "kind", [](const Link& l) { return link_names[static_cast<std::size_t>(l.kind)]; },
          "'sequence', 'neighbour' or 'closure'.");

  py::class_<SharedMemory, std::shared_ptr<SharedMemory>>(
      m, "VisualMemory",
      "The reference views of a robot, in RAM. Several threads may read at the same "
      "time; the id of a view never changes.")
      .def(py::init<SignatureShape, float, std::optional<ElevationBand>>(), py::arg("shape"),
           py::arg("full_scale"), py::arg("elevations") = py::none(),
           "`shape`: (rows, components); `full_scale`: the magnitude that is packed as 255.")
      .def_property_readonly(
          "shape",
          [](const SharedMemory& s) {
            return s.read([](const VisualMemory& memory) { return memory.shape(); });
          },
          "(rows, components)")
      .def_property_readonly(
          "full_scale",
          [](const SharedMemory& s) {
            return s.read([](const VisualMemory& v) { return v.full_scale(); });
          },
          "The magnitude that is packed as 255.")
      .def_property_readonly(
          "elevations",
          [](const SharedMemory& s) {
            return s.read([](const VisualMemory& v) { return v.elevations(); });
          },
          "(bottom, top) of the signatures' rows in radians; None: unknown.")
      .def("__len__",
           [](const SharedMemory& s) {
             return s.read([](const VisualMemory& v) { return v.size(); });
           })
      .def(
          "append",
          [](SharedMemory& s, const py::object& signature, const std::string& name,
             const std::optional<ReferencePose>& pose, std::optional<double> stamp_s) {
            ReferenceInfo info{name, pose, stamp_s};
            if (py::isinstance<PackedSignature>(signature)) {
              const auto& packed = signature.cast<const PackedSignature&>();
              return s.change([&](VisualMemory& v) { return v.append(packed, std::move(info)); });
            }
            const auto& own = signature.cast<const FourierSignature&>();
            return s.change([&](VisualMemory& v) { return v.append(own, std::move(info)); });
          },
          py::arg("signature"), py::arg("name"), py::arg("pose") = py::none(),
          py::arg("stamp_s") = py::none(), "Adds a view and returns its id; packs it if needed.")
      .def("extend", &extend, py::arg("magnitudes"), py::arg("phases"),
           py::arg("names") = py::none(), py::arg("poses") = py::none(),
           "Adds n views from uint8 arrays of (n, components, rows). `names`: None: the ids as "
           "names; `poses`: (n, 3) of x_m, y_m, heading_rad, nan if unknown. After an error, "
           "views that were added before it remain.")
      .def(
          "remove",
          [](SharedMemory& s, ViewId view) { s.change([&](VisualMemory& v) { v.remove(view); }); },
          py::arg("view"), "Removes the view and its links.")
      .def_property_readonly(
          "views",
          [](const SharedMemory& s) {
            return s.read([](const VisualMemory& v) {
              return std::vector<ViewId>(v.views().begin(), v.views().end());
            });
          },
          "All ids, ascending.")
      .def(
          "find",
          [](const SharedMemory& s, const std::string& name) {
            return s.read([&](const VisualMemory& v) { return v.find(name); });
          },
          py::arg("name"), "The id of a view, or None.")
      .def(
          "info",
          [](const SharedMemory& s, ViewId view) {
            return s.read([&](const VisualMemory& v) { return v.info(view); });
          },
          py::arg("view"), "Name, pose and stamp of a view.")
      .def(
          "set_pose",
          [](SharedMemory& s, ViewId view, const std::optional<ReferencePose>& pose) {
            s.change([&](VisualMemory& v) { v.set_pose(view, pose); });
          },
          py::arg("view"), py::arg("pose"),
          "Replaces what is known of the pose; None: it is unknown.")
      .def(
          "packed",
          [](const SharedMemory& s, ViewId view) {
            return s.read([&](const VisualMemory& v) { return v.packed(view); });
          },
          py::arg("view"), "Returns a copy of the view's packed signature.")
      .def(
          "signature",
          [](const SharedMemory& s, ViewId view) {
            return s.read([&](const VisualMemory& v) { return v.signature(view); });
          },
          py::arg("view"),
          "Returns the signature as real numbers, with the precision of the packed form.")
      .def("poses", &make_pose_rows,
           "(n, 3) of x_m, y_m, heading_rad by ascending id; nan: unknown.")
      .def(
          "link",
          [](SharedMemory& s, ViewId a, ViewId b, const std::string& kind) {
            const Link link{a, b, parse_link_kind(kind)};
            s.change([&](VisualMemory& v) { v.link(link); });
          },
          py::arg("a"), py::arg("b"), py::arg("kind") = "sequence",
          "Links two different views; replaces the link that they have. `kind`: 'sequence', "
          "'neighbour' or 'closure'.")
      .def(
          "unlink",
          [](SharedMemory& s, ViewId a, ViewId b) {
            s.change([&](VisualMemory& v) { v.unlink(a, b); });
          },
          py::arg("a"), py::arg("b"),
          "Removes the link of the two views, in either order; does nothing if there is "
          "none.")
      .def_property_readonly(
          "links",
          [](const SharedMemory& s) {
            return s.read([](const VisualMemory& v) {
              return std::vector<Link>(v.links().begin(), v.links().end());
            });
          },
          "All links, each once.")
      .def("search", &search, py::arg("query"), py::arg("top") = 10, py::arg("components") = 0,
           py::arg("excluded_views") = std::vector<ViewId>{},
           "Finds the most similar views by L1 of packed magnitudes, exactly as a full scan, "
           "ties by id. `components`: number of compared components; 0: all.")
      .def("__repr__", [](const SharedMemory& s) {
        return s.read([](const VisualMemory& v) {
          return "VisualMemory(" + std::to_string(v.size()) + " views, " +
                 std::to_string(v.shape().components) + " components, " +
                 std::to_string(v.shape().rows) + " rows)";
        });
      });
}

void bind_memory_file(py::module_& m) {
  Record<MemoryFile::Info>(m, "MemoryFileInfo", "Counts and sizes of a memory file.")
      .field("views", &MemoryFile::Info::views, "Reference views.")
      .field("views_with_position", &MemoryFile::Info::views_with_position,
             "Of these, with x and y.")
      .field("views_with_heading", &MemoryFile::Info::views_with_heading,
             "Of these, with a heading.")
      .field("links", &MemoryFile::Info::links, "Number of links.")
      .field("thumbnails", &MemoryFile::Info::thumbnails, "Views stored with a picture file.")
      .field("views_with_features", &MemoryFile::Info::views_with_features,
             "Views stored with local features.")
      .field("feature_bytes", &MemoryFile::Info::feature_bytes,
             "Packed local features of all views.")
      .field("maps", &MemoryFile::Info::maps, "Kept by name.")
      .field("routes", &MemoryFile::Info::routes, "Kept by name.")
      .field("file_bytes", &MemoryFile::Info::file_bytes, "Size including the write-ahead log.")
      .field("format_version", &MemoryFile::Info::format_version,
             "Version of the file format, >= 1.");
  Record<GroundScale>(m, "GroundScale", "Scale of a map, measured on the ground in its images.")
      .field("unit_m", &GroundScale::unit_m, "Metres per former unit; None if it is uncertain.")
      .field("measured", &GroundScale::measured, "Number of pairs of views that show the ground.")
      .field("tried", &GroundScale::tried, "Number of pairs that were compared.")
      .field("deviation", &GroundScale::deviation, "Relative standard deviation of `unit_m`.");
  Record<MemoryFile::Fault>(m, "MemoryFault", "A fault in a memory file.")
      .field("view", &MemoryFile::Fault::view, "Id of the view, or None.")
      .field("what", &MemoryFile::Fault::what, "Description in one line.");
  Record<MemoryFile::KeptChange>(m, "KeptChange", "A change of a memory that was kept for `undo`.")
      .field("what", &MemoryFile::KeptChange::what, "Description of the change.")
      .field("stamp_s", &MemoryFile::KeptChange::stamp_s, "Seconds since 1970, or None.")
      .field("bytes", &MemoryFile::KeptChange::bytes, "Bytes stored to revert it.")
      .field("undoable", &MemoryFile::KeptChange::undoable,
             "False if it is too old; only the description is stored then.");
  Record<MemoryHeader>(m, "MemoryHeader",
                       "Properties of all views of a memory file: how images become signatures.")
      .field(
          "shape", [](const MemoryHeader& h) { return h.shape; }, "(rows, components)")
      .field("full_scale", &MemoryHeader::full_scale, "The magnitude that is packed as 255.")
      .field(
          "elevations", [](const MemoryHeader& h) { return h.elevations; },
          "(bottom, top) in radians, or None.")
      .field("panorama_columns", &MemoryHeader::panorama_columns,
             "Columns of the panoramas from which signatures are computed.")
      .field("source", &MemoryHeader::source, "Layout of its images.")
      .field("created_s", &MemoryHeader::created_s, "Seconds since 1970, or None.");

  py::class_<SharedFile, std::shared_ptr<SharedFile>>(
      m, "MemoryFile",
      "A visual memory on disk. A change is on disk when its function returns, also if the "
      "process is killed then. All functions raise FileError.")
      .def(py::init([](const std::filesystem::path& path, bool write) {
             return std::make_shared<SharedFile>(
                 MemoryFile::open(path, write ? Access::read_write : Access::read_only));
           }),
           py::arg("path"), py::arg("write") = false, py::call_guard<py::gil_scoped_release>(),
           "Opens a memory file; with `write` it can be changed.")
      .def_property_readonly(
          "header",
          [](const SharedFile& s) {
            return s.read([](const MemoryFile& f) { return f.header(); });
          },
          "Properties with which the file was made.")
      .def_property_readonly(
          "path",
          [](const SharedFile& s) { return s.read([](const MemoryFile& f) { return f.path(); }); },
          "Path as given; for a server the address without password.")
      .def_property_readonly(
          "length_unit",
          [](SharedFile& s) {
            return s.change([](MemoryFile& f) { return to_string(read_length_unit(f)); });
          },
          "Unit of all positions: 'm', or 'view steps' (the median distance between consecutive "
          "views; of images in no order, between a view and the nearest one) if a map of images "
          "has no known length.")
      .def(
          "scale_to_metres",
          [](SharedFile& s, const std::string& first, const std::string& second,
             double distance_m) {
            return s.change([&](MemoryFile& f) {
              return scale_to_metres(f, find_view_by_name_or_id(f, first),
                                     find_view_by_name_or_id(f, second), distance_m,
                                     "scale by the distance of " + first + " and " + second);
            });
          },
          py::arg("first"), py::arg("second"), py::arg("distance_m"),
          "Makes metres of view steps by the known distance between two views of the map. Returns "
          "the metres per former unit.")
      .def(
          "scale_by_camera_height",
          [](SharedFile& s, double camera_height_m) {
            return s.change([&](MemoryFile& f) {
              const GroundScale ground = measure_ground_scale(f, camera_height_m);
              if (ground.unit_m) {
                scale_to_metres(f, *ground.unit_m,
                                "scale by a camera height of " + to_text(camera_height_m) + " m");
              }
              return ground;
            });
          },
          py::arg("camera_height_m"),
          "Makes metres of view steps by the height of the camera above level ground, like "
          "`panonav scale --camera-height-m`. Changes nothing if `unit_m` of the result is None.")
      .def(
          "load",
          [](SharedFile& s) {
            return s.change([](MemoryFile& f) { return std::make_shared<SharedMemory>(f.load()); });
          },
          "Loads all views and links into a VisualMemory, which no longer needs the file.")
      .def(
          "info", [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.info(); }); },
          "Counts and sizes; nothing is checked.")
      .def(
          "verify",
          [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.verify(); }); },
          "Returns all faults of the file; empty: intact.")
      .def(
          "names", [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.names(); }); },
          "Returns the names of all views, by ascending id.")
      .def(
          "find",
          [](SharedFile& s, const std::string& name) {
            return s.change([&](MemoryFile& f) { return f.find(name); });
          },
          py::arg("name"), "The id of a view, or None.")
      .def(
          "named",
          [](SharedFile& s, const std::string& name) {
            return s.change([&](MemoryFile& f) { return find_view_by_name_or_id(f, name); });
          },
          py::arg("name"), "Returns the id of a view by name, or by id as text.")
      .def(
          "thumbnail",
          [](SharedFile& s, ViewId view) -> py::object {
            const auto bytes = s.change([&](MemoryFile& f) { return f.thumbnail(view); });
            if (!bytes) return py::none();
            return py::bytes(reinterpret_cast<const char*>(bytes->data()), bytes->size());
          },
          py::arg("view"), "The bytes of its picture file (PNG or JPEG), or None.")
      .def(
          "set_pose",
          [](SharedFile& s, ViewId view, const std::optional<ReferencePose>& pose) {
            s.change([&](MemoryFile& f) { f.set_pose(view, pose); });
          },
          py::arg("view"), py::arg("pose"),
          "Replaces what is known of the pose; None: it is unknown.")
      .def(
          "rename",
          [](SharedFile& s, ViewId view, const std::string& name) {
            s.change([&](MemoryFile& f) { f.rename(view, name); });
          },
          py::arg("view"), py::arg("name"), "Renames a view; the name must be unused.")
      .def(
          "remove",
          [](SharedFile& s, const std::vector<ViewId>& views) {
            s.change([&](MemoryFile& f) { f.remove(views); });
          },
          py::arg("views"), "Removes all or none, with links, thumbnails and features.")
      .def(
          "undo", [](SharedFile& s) { s.change([](MemoryFile& f) { f.undo(); }); },
          "Reverts the newest change of `history`.")
      .def(
          "history",
          [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.history(); }); },
          "Returns the changes that `undo` can revert, newest first.")
      .def(
          "map_names",
          [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.map_names(); }); },
          "Returns the names of the maps, ascending.")
      .def(
          "route_names",
          [](SharedFile& s) { return s.change([](MemoryFile& f) { return f.route_names(); }); },
          "Returns the names of the routes, ascending.")
      .def(
          "learn_and_store_models",
          [](SharedFile& s) { s.change([](MemoryFile& f) { learn_and_store_models(f); }); },
          "Learns the models for localisation from the views and stores them in the file. Call it "
          "when views or poses have changed.")
      .def("__repr__", [](const SharedFile& s) {
        return s.read(
            [](const MemoryFile& f) { return "MemoryFile('" + f.path().string() + "')"; });
      });
}

void bind_synchronisation(py::module_& m) {
  using Report = fleet::SynchronisationReport;
  Record<Report>(m, "SynchronisationReport", "The changes made by synchronise_memory.")
      .field("views", &Report::views, "Number of views in the file afterwards.")
      .field("uploaded", &Report::uploaded, "Views added on the server.")
      .field("downloaded", &Report::downloaded, "Views added to the file.")
      .field("adopted", &Report::adopted, "Views that were in both, by name and signature.")
      .field("updated_on_server", &Report::updated_on_server,
             "Views whose name, pose or stamp changed on the server.")
      .field("updated_in_file", &Report::updated_in_file, "The same, in the file.")
      .field("removed_on_server", &Report::removed_on_server, "Views that the file had deleted.")
      .field("removed_in_file", &Report::removed_in_file, "Views that others had removed.")
      .field("renamed", &Report::renamed, "Views of the file whose names others use.")
      .field("conflicts", &Report::conflicts,
             "Changes of the file that were dropped, because others were first.")
      .field("withheld", &Report::withheld,
             "Changes of the file that the login may not make on the server.")
      .field("left", &Report::left, "Views that left the file, as they lie outside of its areas.")
      .field("links_uploaded", &Report::links_uploaded,
             "Links added, changed and removed on the server.")
      .field("links_downloaded", &Report::links_downloaded,
             "Links added, changed and removed in the file.")
      .field("restored", &Report::restored,
             "True if the server had lost views, which were uploaded again.")
      .field("seconds", &Report::seconds, "Duration.");
  using Areas = std::vector<std::pair<double, double>>;
  m.def(
      "areas_around",
      [](double x_m, double y_m, double radius_m) {
        Areas areas;
        for (const fleet::MemoryArea& area : fleet::areas_around(x_m, y_m, radius_m)) {
          areas.emplace_back(area.column, area.row);
        }
        return areas;
      },
      py::arg("x_m"), py::arg("y_m"), py::arg("radius_m"),
      "Returns (column, row) of the 10 m squares that touch the circle around a position.");
  m.def(
      "synchronise_memory",
      [](const std::filesystem::path& file, const std::string& server,
         const std::optional<Areas>& areas) {
        fleet::SynchronisationOptions options;
        if (areas) {
          options.areas.emplace();
          for (const auto& [column, row] : *areas) options.areas->push_back({column, row});
        }
        const py::gil_scoped_release free;
        return fleet::synchronise_memory(file, server, options,
                                         [](std::size_t) { check_signals(); });
      },
      py::arg("file"), py::arg("server"), py::arg("areas") = py::none(),
      "Synchronises a robot's memory file with a memory on a PostgreSQL server: views, links, "
      "names and poses, like `panonav synchronise`; if one of the two does not exist, it is "
      "created. `areas`: (column, row) of the 10 m squares that the file keeps; None: all. If "
      "the connection breaks, FileError is raised, nothing is lost, and the next call "
      "continues.");
}

}  // namespace

void bind_memories(py::module_& m) {
  bind_visual_memory(m);
  bind_memory_file(m);
  bind_synchronisation(m);
}

}  // namespace panonav::python
