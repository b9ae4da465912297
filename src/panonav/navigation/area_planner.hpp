#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// Options of areas and of plans over them.
struct PlannerOptions {
  FieldOptions field;    ///< of the directions within an area
  SubAreaOptions areas;  ///< of the areas' size
  /// Largest number of gates used between two areas, spread over their border. With more gates,
  /// paths through wide borders become shorter and planning becomes slower. 0: all, and every path
  /// is a shortest one.
  int gates_per_border = 4;
};
void visit_options(PlannerOptions& options, OptionVisitor& visitor);

/// Plans first over areas, then within each: the sub-goals of the outlook of [M04 section 3.5].
/// Computes the paths between the gates of an area once. A goal then costs a search in its own area
/// and one over the gates; the direction field of an area costs a search in that area. So a plan
/// uses only views of the areas that it crosses. Blocked edges stay blocked until `unblock_all`.
class AreaPlanner {
 public:
  /// Throws OptionError. Cost: that of `divide_into_areas`, and for each gate a search in each of
  /// its two areas.
  explicit AreaPlanner(NavigationGraph graph, const PlannerOptions& options = {});
  /// Uses areas made before. Throws ContractError if they do not belong to this graph.
  AreaPlanner(NavigationGraph graph, SubAreas areas, const PlannerOptions& options = {});

  /// Returns the graph that was passed to the constructor.
  [[nodiscard]] const NavigationGraph& graph() const noexcept { return graph_; }
  /// Made at construction, or as passed to the constructor.
  [[nodiscard]] const SubAreas& areas() const noexcept { return areas_; }
  /// Number of gates used, over all borders.
  [[nodiscard]] std::size_t used_gate_count() const noexcept;

  /// Throws ContractError when the view is not in the graph.
  void set_goal(ViewId goal);
  /// The view that plans lead to; nullopt before the first `set_goal`.
  [[nodiscard]] std::optional<ViewId> goal() const;

  /// Excludes edges from plans. Throws ContractError on an edge that the graph does not have. Cost:
  /// recomputes the paths between gates in the areas at both ends, and the plan over areas.
  void block(std::span<const std::size_t> edges);
  /// Allows all edges again. Cost: as `block`, for the areas of the blocked edges.
  void unblock_all();
  /// True if the edge of this number is excluded from plans.
  [[nodiscard]] bool is_blocked(std::size_t edge) const { return blocked_.at(edge) != 0; }
  /// Number of blocked edges.
  [[nodiscard]] std::size_t blocked_edge_count() const noexcept;

  /// Returns the guides of the area's nodes towards the goal, in the order of the nodes. Without a
  /// goal, all are unreachable. Throws ContractError if there is no such area.
  [[nodiscard]] std::vector<Guide> field(std::size_t area) const;

  /// Returns the nodes from `start` to the goal, both included; none if the goal cannot be reached.
  /// Computes the field of each area on the path.
  [[nodiscard]] std::vector<std::size_t> plan_path(std::size_t start) const;

 private:
  /// Two areas and the edges between them.
  struct Border {
    std::size_t low = 0, high = 0;  // areas
    std::vector<std::size_t> edges;
    std::vector<std::size_t> gates;  // the edges that are used
  };
  /// The nodes of an area at which gates end, and the paths between them.
  struct GateEnds {
    std::vector<std::size_t> borders;
    std::vector<std::size_t> nodes;       // ascending
    std::vector<double> path_lengths;     // matrix between `nodes`; infinite: no path
    std::vector<double> lengths_to_goal;  // of each of `nodes`
  };
  /// Returns the two nodes of an edge; the one in `area` comes first.
  [[nodiscard]] std::pair<std::size_t, std::size_t> ends_of(std::size_t edge,
                                                            std::size_t area) const;
  [[nodiscard]] std::vector<Guide> search_from(std::size_t area, std::size_t node) const;
  [[nodiscard]] std::optional<std::size_t> find_gate_end_beyond(
      std::size_t area, const NavigationGraph::Exit& exit) const;
  void choose_gates(Border& border) const;
  void compute_gate_paths(std::size_t area);
  void plan_over_areas();

  NavigationGraph graph_;
  SubAreas areas_;
  PlannerOptions options_;
  std::vector<std::uint8_t> blocked_;  // by edge
  std::vector<Border> borders_;
  std::vector<GateEnds> gate_ends_;  // by area
  std::optional<std::size_t> goal_;
};

}  // namespace panonav
