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

/// How areas are made, and how plans lead over them.
struct PlannerOptions {
  FieldOptions field;    ///< of the directions within an area
  SubAreaOptions areas;  ///< of the areas' size
  /// Gates that count between two areas at most, spread over their border; more make ways through
  /// wide borders shorter and planning slower. 0: all, and every way is a shortest one.
  int gates_per_border = 4;
};
void visit_options(PlannerOptions& options, OptionVisitor& visitor);

/// Plans over areas first, then inside: the sub-goals of the outlook of [M04 section 3.5]. The ways
/// between the gates of an area are found once; a goal then costs a search in its own area and one
/// over the gates, and the field of an area a search in that area. So a plan does not look at
/// views outside the areas that it needs. Closed edges stay closed until they are opened.
class AreaPlanner {
 public:
  /// Throws OptionError. Cost: that of `divide`, and a search in its area for each gate.
  explicit AreaPlanner(NavigationGraph graph, const PlannerOptions& options = {});
  /// With areas made before. Throws ContractError when they are not those of this graph.
  AreaPlanner(NavigationGraph graph, SubAreas areas, const PlannerOptions& options = {});

  /// As it was given.
  [[nodiscard]] const NavigationGraph& graph() const noexcept { return graph_; }
  /// Made at construction, or as given.
  [[nodiscard]] const SubAreas& areas() const noexcept { return areas_; }
  /// Gates that count, of all borders.
  [[nodiscard]] std::size_t gates() const noexcept;

  /// Throws ContractError when the view is not in the graph.
  void set_goal(ViewId goal);
  /// The view that plans lead to; empty before the first `set_goal`.
  [[nodiscard]] std::optional<ViewId> goal() const;

  /// Edges that cannot be used now. Throws ContractError on one that there is not. Cost: the
  /// ways between gates of the areas at both ends are found anew, and the plan over areas.
  void close(std::span<const std::size_t> edges);
  /// All edges may be used again. Cost: as `close`, for the areas of the edges that were closed.
  void unblock_all();
  /// Whether an edge, by its number, cannot be used now.
  [[nodiscard]] bool is_blocked(std::size_t edge) const { return closed_.at(edge) != 0; }
  /// Number of edges that cannot be used now.
  [[nodiscard]] std::size_t closed() const noexcept;

  /// Guides towards the goal by place in the area; none is reachable without a goal. Throws
  /// ContractError when there is no such area.
  [[nodiscard]] std::vector<Guide> field(std::size_t area) const;

  /// The nodes from `start` to the goal, both included; empty when it cannot be reached. Makes the
  /// fields of the areas on the way.
  [[nodiscard]] std::vector<std::size_t> plan_path(std::size_t start) const;

 private:
  /// Two areas and the edges between them.
  struct Border {
    std::size_t low = 0, high = 0;    // areas
    std::vector<std::size_t> edges;   // all
    std::vector<std::size_t> chosen;  // those that count
  };
  /// Ends of gates within an area, and the ways between them.
  struct Ends {
    std::vector<std::size_t> borders;
    std::vector<std::size_t> nodes;  // ascending
    std::vector<double> ways;        // nodes.size() squared; infinite where there is none
    std::vector<double> to_goal;     // of each of `nodes`
  };
  /// Ends of an edge with the one in `area` first.
  [[nodiscard]] std::pair<std::size_t, std::size_t> ends_of(std::size_t edge,
                                                            std::size_t area) const;
  [[nodiscard]] std::vector<Guide> tree_from(std::size_t area, std::size_t node) const;
  [[nodiscard]] std::optional<std::size_t> end_beyond(std::size_t area,
                                                      const NavigationGraph::Exit& exit) const;
  void choose_gates(Border& border) const;
  void find_ways(std::size_t area);
  void plan_over_areas();

  NavigationGraph graph_;
  SubAreas areas_;
  PlannerOptions options_;
  std::vector<std::uint8_t> closed_;  // by edge
  std::vector<Border> borders_;
  std::vector<Ends> ends_;  // by area
  std::optional<std::size_t> goal_;
};

}  // namespace panonav
