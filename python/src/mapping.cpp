#include "memories.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_merge.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_address.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

constexpr std::array<const char*, 3> link_names{"sequence", "neighbour", "closure"};

/// Returns rows of x_m, y_m, heading_rad, one per node.
template <class Nodes>
py::array_t<double> to_node_pose_rows(const Nodes& nodes) {
  std::vector<Pose2> poses;
  for (const auto& node : nodes) poses.push_back(node.pose);
  return to_pose_rows(poses);
}

MapperOptions make_mapper_options(const py::kwargs& keywords, SignatureOptions* signature) {
  MapperOptions options;
  Keywords parsed(keywords);
  parsed.options(options.mapping)
      .options(options.odometry)
      .options(options.closure, "closure")
      .options(options.graph, "graph");
  if (signature) parsed.options(*signature);
  parsed.finish();
  options.is_scale_known = keywords.contains("scale_m");
  return options;
}

/// Does the same as the verb `map`: appends views that are not in the file.
Mapper::Result make_map(const Dataset& recording, const std::filesystem::path& path,
                        const SignatureOptions& signature, const MapperOptions& options,
                        int threads) {
  InterruptibleExecutor executor(threads);
  const bool memory_existed = memory_exists(path);
  Mapper mapper(memory_existed ? MemoryFile::open(path, Access::read_write)
                               : MemoryFile::create(path, make_header_from_recording(
                                                              recording, signature, {}, executor)),
                recording.source, options);
  if (memory_existed) check_known_views(recording, mapper.memory(), mapper.encoder(), executor);
  return mapper.map(recording, executor);
}

void bind_maps(py::module_& m) {
  Record<TopologicalMap::Node>(m, "MapNode", "A node of a map: a view and its pose.")
      .field("view", &TopologicalMap::Node::view, "Its id in the memory.")
      .field("pose", &TopologicalMap::Node::pose, "In the frame of its connected component.")
      .field("component", &TopologicalMap::Node::component,
             "Index of its connected component; components have no common frame.");
  Record<TopologicalMap::Edge>(m, "MapEdge", "Two nodes and the motion between them.")
      .field("a", &TopologicalMap::Edge::a, "View of one node.")
      .field("b", &TopologicalMap::Edge::b, "View of the other node.")
      .field("a_from_b", &TopologicalMap::Edge::a_from_b, "Pose of b in the frame of a.")
      .field(
          "kind",
          [](const TopologicalMap::Edge& e) {
            return link_names[static_cast<std::size_t>(e.kind)];
          },
          "'sequence', 'neighbour' or 'closure'.")
      .field("weight", &TopologicalMap::Edge::weight, "Small if other edges contradict it.");
  Record<TopologicalMap>(m, "TopologicalMap", "A map of places with closed loops.")
      .field("nodes", &TopologicalMap::nodes, "Ascending by view.")
      .field("edges", &TopologicalMap::edges, "Each connects two nodes of the map.")
      .type()
      .def(
          "poses", [](const TopologicalMap& map) { return to_node_pose_rows(map.nodes); },
          "Returns (n, 3) of x_m, y_m, heading_rad, one row per node.");
  Record<Mapper::Result>(m, "MappedRun", "The map of a Mapper's observations.")
      .field("map", &Mapper::Result::map, "All nodes and edges.")
      .field("observations", &Mapper::Result::observations, "Index of each node's observation.")
      .field("skipped", &Mapper::Result::skipped, "Number of too similar observations.")
      .field("scale_m", &Mapper::Result::scale_m,
             "Metres per unit of visual length; None if not known.")
      .field(
          "unit", [](const Mapper::Result& result) { return to_string(result.unit); },
          "Unit of the map's lengths: 'm', or 'view steps' if no length is known.")
      .field("wheels", &Mapper::Result::wheels, "True if steps come from odometry.")
      .field("mapping_s", &Mapper::Result::mapping_s, "Duration of the mapping in seconds.");
  const std::string option_text = append_option_list(
      "", {options_of<MappingOptions>(), options_of<VisualOdometryOptions>(),
           options_of<LoopClosureOptions>("closure"), options_of<PoseGraphOptions>("graph")});
  using SharedMapper = Shared<Mapper>;
  py::class_<SharedMapper>(m, "Mapper",
                           "Makes a map of observations in the order in which they were taken, and "
                           "stores it in a memory file as \"map\".")
      .def(py::init([](const std::filesystem::path& memory,
                       const std::optional<PictureSource>& source, const py::kwargs& keywords) {
             const MapperOptions options = make_mapper_options(keywords, nullptr);
             return std::make_unique<SharedMapper>(MemoryFile::open(memory, Access::read_write),
                                                   source, options);
           }),
           py::arg("memory"), py::arg("source") = py::none(),
           ("`memory`: an existing memory file." + option_text).c_str())
      .def(
          "add",
          [](SharedMapper& mapper, const py::object& observation) {
            const Observation seen = to_observation(observation);
            return mapper.change([&](Mapper& one) { return one.add(seen); });
          },
          py::arg("observation"), "Adds the next observation; True if it became a node.")
      .def(
          "finish",
          [](SharedMapper& mapper) {
            return mapper.change([](Mapper& one) { return one.finish(); });
          },
          "Optimises and stores the map. More observations may follow.");
  m.def(
      "make_map",
      [](const std::filesystem::path& memory, const py::object& recording,
         const std::optional<PictureSource>& source, bool thumbnails, int threads,
         const py::kwargs& keywords) {
        SignatureOptions signature;
        MapperOptions options = make_mapper_options(keywords, &signature);
        options.thumbnails = thumbnails;
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        return make_map(dataset, memory, signature, options, threads);
      },
      py::arg("memory"), py::arg("recording"), py::arg("source") = py::none(),
      py::arg("thumbnails") = true, py::arg("threads") = 0,
      ("Makes a map of a recording in its order, like `panonav map`. `memory` is created if it "
       "does not exist; views that are not in it are appended." +
       option_text)
          .c_str());
}

void bind_lattices(py::module_& m) {
  Record<Lattice::Node>(m, "LatticeNode", "A view in an arrangement.")
      .field("view", &Lattice::Node::view, "Its id in the memory.")
      .field("pose", &Lattice::Node::pose, "In its component's frame.")
      .field("component", &Lattice::Node::component, "Index of its connected component.");
  Record<Lattice::Spring>(m, "LatticeSpring", "The relative position of two views.")
      .field("a", &Lattice::Spring::a, "Index of a node.")
      .field("b", &Lattice::Spring::b, "Index of the other node, larger than a.")
      .field("dissimilarity", &Lattice::Spring::dissimilarity,
             "Dissimilarity of the views, over the requested components.")
      .field("length", &Lattice::Spring::length, "Rest length.")
      .field("stiffness", &Lattice::Spring::stiffness, "Spring constant K [M04 eq. 5].")
      .field("weight", &Lattice::Spring::weight, "Near 0: an outlier.");
  Record<Lattice::Component>(m, "LatticeComponent", "Views that springs connect.")
      .field("views", &Lattice::Component::views, "Number of its nodes.")
      .field("handedness_known", &Lattice::Component::handedness_known,
             "False if the component may be mirrored.");
  Record<Lattice::Join>(m, "LatticeJoin", "Two components that were joined after the last round.")
      .field("views", &Lattice::Join::views, "Number of nodes of the smaller one.")
      .field("pairs", &Lattice::Join::pairs, "Number of pairs of views that agree on its pose.");
  Record<Lattice::Crossing>(m, "LatticeCrossing",
                            "Two views of different components between which a robot can cross by "
                            "homing.")
      .field("a", &Lattice::Crossing::a, "Index of a node.")
      .field("b", &Lattice::Crossing::b, "Index of the other node, larger than a.")
      .field("phases", &Lattice::Crossing::phases, "Relative pose of the two views.")
      .field("probability", &Lattice::Crossing::probability,
             "Probability that the direction is right.");
  Record<Lattice>(m, "Lattice", "Views and the poses computed from their springs.")
      .field("nodes", &Lattice::nodes, "One for each view, in the order of ids.")
      .field("springs", &Lattice::springs, "Ascending (a, b).")
      .field("components", &Lattice::components, "The largest first.")
      .field("joins", &Lattice::joins, "Components that were joined, in their order.")
      .field("crossings", &Lattice::crossings, "Between components; ascending (a, b).")
      .field("candidates", &Lattice::candidates,
             "Number of pairs of views that were compared; those that are no "
             "springs were rejected.")
      .field("metric", &Lattice::metric, "True if lengths are in metres.")
      .field("iterations", &Lattice::iterations, "Solver iterations, over all rounds.")
      .field("energy", &Lattice::energy,
             "Sum over springs of weight times squared strain in deviations.")
      .type()
      .def(
          "poses", [](const Lattice& lattice) { return to_node_pose_rows(lattice.nodes); },
          "Returns (n, 3) of x, y, heading_rad, one row per node.");
  m.def(
      "arrange",
      [](const py::object& memory, const py::object& odometry, bool save, int threads,
         const py::kwargs& keywords) {
        LatticeOptions options;
        CoarseMotionOptions motion;
        Keywords parsed(keywords);
        parsed.options(options);
        if (!odometry.is_none()) parsed.options(motion, "motion");
        parsed.finish();
        const auto path = to_path(memory, "memory");
        std::optional<Dataset> recording;
        if (!odometry.is_none()) recording = to_dataset(odometry, std::nullopt);
        const py::gil_scoped_release free;
        InterruptibleExecutor executor(threads);
        auto file = MemoryFile::open(path, save ? Access::read_write : Access::read_only);
        const VisualMemory views = file.load();
        const auto motions = recording ? make_coarse_motions(*recording, views, motion)
                                       : std::vector<CoarseMotion>{};
        Lattice lattice = arrange(views, options, motions, executor);
        if (save) store_lattice(lattice, views, file);
        return lattice;
      },
      py::arg("memory"), py::arg("odometry") = py::none(), py::kw_only(), py::arg("save") = true,
      py::arg("threads") = 0,
      append_option_list(
          "Computes the positions of all views of a memory file from their similarity "
          "alone, and with `save` stores the arrangement in it as \"lattice\". "
          "`odometry`: a Dataset or path with odometry between views, assigned by name; "
          "only then the options motion_* are allowed.",
          {options_of<LatticeOptions>(), options_of<CoarseMotionOptions>("motion")})
          .c_str());
  m.def(
      "read_map",
      [](SharedFile& memory, const std::string& name) {
        return memory.change([&](MemoryFile& file) { return file.map(name); });
      },
      py::arg("memory"), py::arg("name") = map_name, "A map of a MemoryFile, or None.");
}

void bind_merging(py::module_& m) {
  Record<SessionAlignment>(m, "SessionAlignment", "Relative pose of the maps of two sessions.")
      .field("first_from_second", &SessionAlignment::first_from_second,
             "Pose of the second map's frame in the frame of the first.")
      .field("places", &SessionAlignment::places, "Number of places that support this pose.")
      .field("other_places", &SessionAlignment::other_places, "Number for the second best pose.")
      .field("expected_places", &SessionAlignment::expected_places,
             "Number of places at which both maps overlap.")
      .field("confirmed_places", &SessionAlignment::confirmed_places, "Number of these that match.")
      .field("refuted", &SessionAlignment::refuted, "Matches that contradict this pose.");
  Record<MergedMemory>(m, "MergedMemory", "The result of merge_memories.")
      .field("views", &MergedMemory::views, "Number of views of the new memory.")
      .field("shared", &MergedMemory::shared, "Views that were in both, stored once.")
      .field("renamed", &MergedMemory::renamed,
             "Views and routes of the second that were renamed, as the first uses their names.")
      .field("alignment", &MergedMemory::alignment, "None if no common place was found.")
      .field("connected_components", &MergedMemory::connected_components, "Number in the new map.")
      .field("without_position", &MergedMemory::without_position,
             "Views of the second that lost their positions, as these are in another frame.");
  m.def(
      "merge_memories",
      [](const std::filesystem::path& first, const std::filesystem::path& second,
         const std::filesystem::path& memory, const py::kwargs& keywords) {
        SessionAlignmentOptions alignment;
        PoseGraphOptions graph;
        Keywords parsed(keywords);
        parsed.options(alignment).options(graph, "graph");
        parsed.finish();
        const py::gil_scoped_release free;
        return merge_memories(first, second, memory, alignment, graph, check_signals);
      },
      py::arg("first"), py::arg("second"), py::arg("memory"),
      append_option_list(
          "Merges two memory files into one, like `panonav merge`: common places are "
          "found by appearance, and the second is transformed to the frame of the first. "
          "Without any, both stay separate components, and the views of the second lose "
          "their positions.",
          {options_of<SessionAlignmentOptions>(), options_of<PoseGraphOptions>("graph")})
          .c_str());
}

}  // namespace

void bind_mapping(py::module_& m) {
  bind_maps(m);
  bind_merging(m);
  bind_lattices(m);
}

}  // namespace panonav::python
