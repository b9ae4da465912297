// Parts of the navigator: scales of similarity, views by area, obstacles, graphs from views.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/internal/area_views.hpp"
#include "panonav/navigation/internal/obstacle.hpp"
#include "panonav/navigation/internal/place_scale.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/view_pair.hpp"
#include "support/random_graphs.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

NavigationGraph graph_of_memory(const VisualMemory& memory, Executor& executor) {
  return graph_from_links(MemoryViewSource(memory), memory.links(), executor);
}

// A grid in a round room of 3 m, 0.5 m apart, headings at random.
struct Grid {
  ToyWorld room = round_room(3.0, 5);
  std::vector<Pose2> poses;
  VisualMemory memory;

  Grid() : memory(remember()) {}

 private:
  VisualMemory remember() {
    Random random(8);
    std::vector<FourierSignature> signatures;
    for (int i = 0; i < 36; ++i) {
      poses.push_back({-1.25 + 0.5 * (i % 6), -1.25 + 0.5 * (i / 6),
                       random.uniform(-std::numbers::pi, std::numbers::pi)});
      signatures.push_back(round_room_signature(room, poses.back()));
    }
    VisualMemory made = make_memory(signatures);
    for (std::size_t a = 0; a < poses.size(); ++a) {
      for (std::size_t b = a + 1; b < poses.size(); ++b) {
        if (distance(poses[a].position(), poses[b].position()) < 0.75) {
          made.link({made.views()[a], made.views()[b], Link::Kind::neighbour});
        }
      }
    }
    return made;
  }
};

TEST(NavigationGraph, PhasesAloneTellDirections) {
  const Grid grid;
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  ASSERT_EQ(graph.edges().size(), grid.memory.links().size());
  std::size_t counted = 0;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    if (!edge.a_from_b) continue;
    ++counted;
    const Pose2 truth = inverse(grid.poses[edge.a.value]) * grid.poses[edge.b.value];
    EXPECT_LT(std::abs(angle_difference(std::atan2(edge.a_from_b->y_m, edge.a_from_b->x_m),
                                        std::atan2(truth.y_m, truth.x_m))),
              radians(25.0));
    EXPECT_LT(std::abs(angle_difference(edge.a_from_b->heading_rad, truth.heading_rad)),
              radians(15.0));
  }
  EXPECT_GT(counted, graph.edges().size() * 9 / 10);
  Executor two(2);
  const NavigationGraph again = graph_of_memory(grid.memory, two);
  EXPECT_TRUE(std::ranges::equal(graph.edges(), again.edges()));

  // Whatever the goal, nearly all views send the robot nearer to it.
  int nearer = 0;
  int all = 0;
  for (std::size_t goal = 0; goal < graph.size(); goal += 7) {
    const auto guides = direction_field(graph, graph.view(goal));
    for (std::size_t node = 0; node < graph.size(); ++node) {
      if (node == goal) continue;
      ASSERT_TRUE(guides[node].is_reachable());
      if (!guides[node].direction_rad) continue;
      const Point2 end = inverse(grid.poses[node]) * grid.poses[goal].position();
      ++all;
      nearer += std::cos(*guides[node].direction_rad - std::atan2(end.y_m, end.x_m)) > 0.5;
    }
  }
  EXPECT_GE(nearer, all * 95 / 100);
}

TEST(NavigationGraph, AMapTellsWhatItsPosesTell) {
  const TopologicalMap map{{{ViewId{1}, {0, 0, 0.3}, 0},
                            {ViewId{4}, {2, 0, -1.0}, 0},
                            {ViewId{6}, {2, 1, 0.0}, 0},
                            {ViewId{9}, {0, 0, 0.0}, 1}},
                           {{ViewId{1}, ViewId{4}, {}, Link::Kind::sequence, 1.0},
                            {ViewId{4}, ViewId{6}, {}, Link::Kind::closure, 0.05},
                            {ViewId{6}, ViewId{9}, {}, Link::Kind::sequence, 1.0}}};
  const NavigationGraph graph = graph_from_map(map);
  ASSERT_EQ(graph.edges().size(), 1U);  // one contradicts the map, one leads to another frame
  EXPECT_NEAR(graph.edges()[0].length, 2.0, 1e-12);
  EXPECT_NEAR(graph.edges()[0].a_from_b->x_m, 2.0 * std::cos(0.3), 1e-12);
  EXPECT_NEAR(graph.edges()[0].a_from_b->y_m, -2.0 * std::sin(0.3), 1e-12);
  EXPECT_EQ(graph_from_map(map, 0.0).edges().size(), 2U);
}

TEST(NavigationGraph, ALatticeGivesLengthsAndPhasesGiveDirections) {
  const Grid grid;
  Executor executor(1);
  const Lattice lattice = arrange(grid.memory, {}, {}, executor);
  const NavigationGraph graph = graph_from_lattice(lattice);
  ASSERT_GT(graph.edges().size(), 60U);
  int right = 0;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    if (!edge.a_from_b) continue;
    const Pose2 truth = inverse(grid.poses[edge.a.value]) * grid.poses[edge.b.value];
    right += std::abs(angle_difference(std::atan2(edge.a_from_b->y_m, edge.a_from_b->x_m),
                                       std::atan2(truth.y_m, truth.x_m))) < radians(25.0);
  }
  EXPECT_GE(right, static_cast<int>(graph.edges().size()) * 9 / 10);
}

TEST(NavigationGraph, AStoredLatticeSaysTheSameAsTheLattice) {
  const Grid grid;
  Executor executor(1);
  const Lattice lattice = arrange(grid.memory, {}, {}, executor);
  const NavigationGraph graph = graph_from_lattice(lattice);
  const NavigationGraph stored = graph_from_stored_lattice(to_topological_map(lattice),
                                                           MemoryViewSource(grid.memory), executor);
  ASSERT_EQ(stored.size(), graph.size());
  // Springs may be longer than they came to lie, so the stored lattice has some edges more.
  ASSERT_GE(stored.edges().size(), graph.edges().size() * 9 / 10);
  std::size_t same = 0;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    const auto found = std::ranges::find_if(
        stored.edges(),
        [&](const NavigationGraph::Edge& other) { return other.a == edge.a && other.b == edge.b; });
    if (found == stored.edges().end()) continue;
    const bool both = found->a_from_b && edge.a_from_b;
    if (both) {
      EXPECT_NEAR(found->length, edge.length, 1e-9);
      EXPECT_NEAR(found->a_from_b->x_m, edge.a_from_b->x_m, 1e-9);
      EXPECT_NEAR(found->a_from_b->y_m, edge.a_from_b->y_m, 1e-9);
    }
    same += both == (found->a_from_b || edge.a_from_b) ? 1 : 0;
  }
  EXPECT_GE(same, graph.edges().size() * 9 / 10);
}

// A square grid of views, all with heading 0, laid out and seen without error.
Lattice exact_grid(std::size_t columns, std::size_t rows) {
  Lattice lattice;
  for (std::size_t i = 0; i < columns * rows; ++i) {
    lattice.nodes.push_back(
        {.view = ViewId{static_cast<std::uint32_t>(i)},
         .pose = {static_cast<double>(i % columns), static_cast<double>(i / columns), 0.0}});
  }
  return lattice;
}

// `b` is seen in the direction in which a view at `seen_b` would be, `a` from there.
void add_spring(Lattice& lattice, std::size_t a, std::size_t b, Point2 seen_b) {
  const Point2 from = lattice.nodes[a].pose.position();
  const double length = distance(from, seen_b);
  const double direction_rad = std::atan2(seen_b.y_m - from.y_m, seen_b.x_m - from.x_m);
  lattice.springs.push_back(
      {.a = a,
       .b = b,
       .length = length,
       .phases = PhaseReading{.direction_a_rad = direction_rad,
                              .direction_b_rad = wrap_angle(direction_rad + std::numbers::pi),
                              .length = 0.2 * length,
                              .has_direction = true}});
}

void add_springs_to_neighbours(Lattice& lattice, std::size_t first, std::size_t end) {
  for (std::size_t a = first; a < end; ++a) {
    for (std::size_t b = a + 1; b < end; ++b) {
      const Point2 there = lattice.nodes[b].pose.position();
      if (distance(lattice.nodes[a].pose.position(), there) < 2.1) add_spring(lattice, a, b, there);
    }
  }
}

bool has_edge(const NavigationGraph& graph, std::size_t a, std::size_t b) {
  return std::ranges::any_of(graph.exits(a), [&](const auto& exit) { return exit.node == b; });
}

// Two pieces of an arrangement, of 5 x 5 views each, that no spring connects.
TEST(NavigationGraph, ACrossingLeadsFromOnePieceToTheOther) {
  Lattice lattice = exact_grid(5, 10);
  add_springs_to_neighbours(lattice, 0, 25);
  add_springs_to_neighbours(lattice, 25, 50);
  for (std::size_t i = 25; i < 50; ++i) lattice.nodes[i].component = 1;
  AreaPlanner apart(graph_from_lattice(lattice));
  apart.set_goal(ViewId{48});
  EXPECT_TRUE(apart.plan_path(0).empty());

  add_spring(lattice, 22, 27, lattice.nodes[27].pose.position());
  lattice.crossings.push_back({22, 27, *lattice.springs.back().phases, 0.9});
  lattice.springs.pop_back();
  const NavigationGraph graph = graph_from_lattice(lattice);
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    EXPECT_EQ(edge.is_crossing, edge.a == ViewId{22} && edge.b == ViewId{27});
  }
  AreaPlanner planner(graph);
  planner.set_goal(ViewId{48});
  const auto path = planner.plan_path(0);
  const auto before = std::ranges::find(path, std::size_t{22});
  ASSERT_NE(before, path.end());
  EXPECT_EQ(*(before + 1), 27U);

  const TopologicalMap stored = to_topological_map(lattice);
  EXPECT_EQ(stored.edges.size(), lattice.springs.size() + 1);
  EXPECT_EQ(stored.edges.back().a, ViewId{22});
  EXPECT_EQ(stored.edges.back().weight, 0.9);
}

TEST(NavigationGraph, LengthsAreInSpacingsOfTheReferences) {
  Lattice lattice = exact_grid(9, 5);
  add_springs_to_neighbours(lattice, 0, lattice.nodes.size());
  const NavigationGraph graph = graph_from_lattice(lattice);
  ASSERT_EQ(graph.edges().size(), lattice.springs.size());
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    const Pose2 truth =
        inverse(lattice.nodes[edge.a.value].pose) * lattice.nodes[edge.b.value].pose;
    EXPECT_NEAR(edge.length, std::hypot(truth.x_m, truth.y_m), 1e-9);
    ASSERT_TRUE(edge.a_from_b.has_value());
    EXPECT_NEAR(edge.a_from_b->x_m, truth.x_m, 1e-9);
    EXPECT_NEAR(edge.a_from_b->y_m, truth.y_m, 1e-9);
  }
}

// Two places far apart that look alike: the arrangement holds springs between them.
TEST(NavigationGraph, LeavesOutEdgesToPlacesThatLookAlike) {
  constexpr std::size_t columns = 14;
  Lattice lattice = exact_grid(columns, 6);
  add_springs_to_neighbours(lattice, 0, lattice.nodes.size());
  const std::size_t here = 2 * columns + 2;
  const std::size_t alike = 2 * columns + 11;
  const Pose2 beside = lattice.nodes[here + 1].pose;
  add_spring(lattice, here, alike, beside.position());
  add_spring(lattice, here + columns, alike + columns, {beside.x_m, beside.y_m + 1.0});
  // They came to lie as near to each other as these springs say.
  for (Lattice::Node& node : lattice.nodes) {
    const auto column = static_cast<double>(node.view.value % columns);
    if (column >= 7.0) node.pose = {14.0 - column, node.pose.y_m, node.pose.heading_rad};
  }
  const NavigationGraph graph = graph_from_lattice(lattice);
  EXPECT_FALSE(has_edge(graph, here, alike));
  EXPECT_FALSE(has_edge(graph, here + columns, alike + columns));
  // All others, but those that the fold has bent.
  EXPECT_TRUE(has_edge(graph, here, here + 1));
  EXPECT_TRUE(has_edge(graph, alike, alike + columns));
}

// Edges that are left out for that come back where nothing else joins two components.
TEST(NavigationGraph, KeepsTheOnlyEdgeBetweenTwoParts) {
  constexpr std::size_t side = 6;
  Lattice lattice = exact_grid(side, 2 * side);
  const std::size_t half = side * side;
  add_springs_to_neighbours(lattice, 0, half);
  add_springs_to_neighbours(lattice, half, 2 * half);
  const std::size_t door = half - 3;
  for (const std::size_t beyond : {door + side, door + side + 1}) {
    add_spring(lattice, door, beyond, lattice.nodes[beyond].pose.position());
  }
  const NavigationGraph graph = graph_from_lattice(lattice);
  EXPECT_TRUE(has_edge(graph, door, door + side));
  EXPECT_FALSE(has_edge(graph, door, door + side + 1));
  const auto guides = direction_field(graph, ViewId{0});
  EXPECT_TRUE(std::ranges::all_of(guides, [](const Guide& guide) { return guide.is_reachable(); }));
}

TEST(PlaceScale, TellsNeighboursFromStrangers) {
  const Grid grid;
  const MemoryViewSource source(grid.memory);
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  const PlaceScale scale = learn_place_scale(source, graph);
  EXPECT_GT(scale.neighbour_difference, 0.0);
  EXPECT_LT(scale.neighbour_difference, scale.max_difference());
  EXPECT_LT(scale.max_difference(), scale.distant_pair_difference);
  EXPECT_THROW((void)learn_place_scale(source, graph, 0, 0), ContractError);
}

TEST(PlaceScale, ArrivalMeansHalfTheSpacing) {
  const Grid grid;
  const MemoryViewSource source(grid.memory);
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  Random random(2);
  for (const std::size_t node : {std::size_t{7}, std::size_t{14}, std::size_t{21}}) {
    const ArrivalScale scale = learn_arrival_scale(source, graph, graph.view(node));
    ASSERT_TRUE(scale.is_learnt);
    const HomingView home = homing_view(grid.memory.signature(graph.view(node)));
    int near_arrived = 0;
    int far_arrived = 0;
    for (int i = 0; i < 20; ++i) {
      const double direction = random.uniform(-std::numbers::pi, std::numbers::pi);
      const auto arrived_at = [&](double way_m) {
        const Pose2 pose{grid.poses[node].x_m + way_m * std::cos(direction),
                         grid.poses[node].y_m + way_m * std::sin(direction),
                         random.uniform(-std::numbers::pi, std::numbers::pi)};
        const HomingView view = homing_view(round_room_signature(grid.room, pose));
        return image_difference(home, view) <= scale.max_difference &&
               home_vector(home, view).length() <= scale.max_length;
      };
      near_arrived += arrived_at(0.1);
      far_arrived += arrived_at(0.5);
    }
    EXPECT_EQ(near_arrived, 20);
    EXPECT_EQ(far_arrived, 0);
  }
  const NavigationGraph alone({ViewId{0}}, {});
  EXPECT_FALSE(learn_arrival_scale(source, alone, ViewId{0}).is_learnt);
  EXPECT_THROW((void)learn_arrival_scale(source, alone, ViewId{1}), ContractError);
}

TEST(AreaViews, HoldsAnAreaAndFindsWhatTheWholeMemoryFinds) {
  const Grid grid;
  const MemoryViewSource source(grid.memory);
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  const SubAreas areas = divide_into_areas(graph, {.views_per_area = 6});
  ASSERT_GT(areas.nodes.size(), 3U);
  AreaViews views(source, 1);
  EXPECT_THROW((void)views.read_coefficients(grid.memory.views()[0]), ContractError);
  for (std::size_t area = 0; area < areas.nodes.size(); ++area) {
    views.enter(graph, areas, area);
    EXPECT_EQ(views.area(), area);
    EXPECT_LT(views.size(), grid.memory.size());
    for (const std::size_t node : areas.nodes[area]) {
      EXPECT_TRUE(views.holds(graph.view(node)));
      for (const auto& exit : graph.exits(node)) EXPECT_TRUE(views.holds(graph.view(exit.node)));
      // Between references, in any heading.
      const Pose2 pose = grid.poses[node] * Pose2{0.08, 0.05, 1.0};
      const FourierSignature seen = round_room_signature(grid.room, pose);
      const QueryView view(seen, grid.memory.full_scale());
      const auto found = views.find_nearest(graph, view);
      const auto match = grid.memory.search(view.packed, {.top = 1}).matches.front();
      ASSERT_TRUE(found.has_value());
      if (views.holds(match.view)) {
        EXPECT_EQ(graph.view(found->node), match.view);
        EXPECT_EQ(found->dissimilarity, match.dissimilarity);
      }
      const std::size_t one[] = {node};
      EXPECT_EQ(views.find_nearest(graph, one, view)->node, node);
      const auto anywhere = search_whole_memory(source, graph, areas, seen);
      ASSERT_TRUE(anywhere.has_value());
      EXPECT_LT(distance(grid.poses[anywhere->node].position(), pose.position()), 0.4);
    }
  }
}

TEST(AreaViews, WhatIsLoadedAheadNeedNotBeLoadedAgain) {
  const Grid grid;
  // Counts what is asked for.
  struct Counting final : ViewSource {
    explicit Counting(const VisualMemory& memory) : source(memory) {}
    [[nodiscard]] std::span<const ViewId> views() const override { return source.views(); }
    [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const override {
      loaded += views.size();
      return source.load(views);
    }
    MemoryViewSource source;
    mutable std::size_t loaded = 0;
  } source(grid.memory);
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  const SubAreas areas = divide_into_areas(graph, {.views_per_area = 12});
  ASSERT_GT(areas.nodes.size(), 2U);
  AreaViews at_once(source, 1);
  at_once.enter(graph, areas, 1);
  const std::size_t whole = source.loaded;
  AreaViews views(source, 1);
  views.enter(graph, areas, 0);
  const std::size_t first = views.size();
  source.loaded = 0;
  views.prefetch(graph, areas, 0, 100);  // is here
  EXPECT_EQ(source.loaded, 0U);
  views.prefetch(graph, areas, 2, 3);  // not entered after all
  views.prefetch(graph, areas, 1, 5);
  EXPECT_EQ(views.size(), first + 5);
  EXPECT_EQ(views.area(), 0U);
  views.prefetch(graph, areas, 1, 4);
  EXPECT_EQ(source.loaded, 3U + 9U);
  views.enter(graph, areas, 1);
  EXPECT_EQ(source.loaded, 3U + whole);
  EXPECT_EQ(views.size(), whole);
  for (const std::size_t node : areas.nodes[1]) {
    const QueryView seen(grid.memory.signature(graph.view(node)), grid.memory.full_scale());
    EXPECT_EQ(views.find_nearest(graph, seen)->node, at_once.find_nearest(graph, seen)->node);
    EXPECT_EQ(views.read_coefficients(graph.view(node)),
              at_once.read_coefficients(graph.view(node)));
  }
}

TEST(AreaViews, FewComponentsReadLess) {
  const Grid grid;
  const MemoryViewSource source(grid.memory);
  Executor executor(1);
  const NavigationGraph graph = graph_of_memory(grid.memory, executor);
  const SubAreas areas = make_single_area(graph);
  std::uint64_t read[2] = {0, 0};
  for (const int components : {0, 5}) {
    AreaViews views(source, 0);
    views.enter(graph, areas, 0);
    EXPECT_EQ(views.bytes_read(), 0U);
    for (std::size_t node = 0; node < graph.size(); ++node) {
      const QueryView seen(grid.memory.signature(graph.view(node)), grid.memory.full_scale(),
                           components);
      const auto found = views.find_nearest(graph, areas.nodes[0], seen);
      EXPECT_EQ(found->node, node);
      EXPECT_EQ(found->dissimilarity, 0U);
      EXPECT_NEAR(views.read_compass(graph.view(node), seen)->heading_rad, 0.0, 1e-3);
    }
    read[components == 0 ? 0 : 1] = views.bytes_read();
  }
  EXPECT_EQ(read[0] * 5, read[1] * 15);
  EXPECT_THROW(QueryView(grid.memory.signature(graph.view(0)), 1.0F, 2), ContractError);
}

TEST(Obstacle, ClosesAllThatCrossesItAndNothingElse) {
  std::vector<Pose2> poses;
  Random random(3);
  for (int i = 0; i < 25; ++i)
    poses.push_back(
        {i % 5 + 0.0, i / 5 + 0.0, random.uniform(-std::numbers::pi, std::numbers::pi)});
  const NavigationGraph graph = posed_graph(poses, 1.5, [](Point2, Point2) { return true; });
  // From the middle, the way to the east is shut over one spacing either way.
  const std::size_t node = 12;
  const double direction = angle_difference(0.0, poses[node].heading_rad);
  const auto across = find_crossed_edges(graph, {node, direction, 0.5, 1.0});
  std::size_t expected = 0;
  for (std::size_t p = 0; p < graph.edges().size(); ++p) {
    const Point2 a = poses[*graph.node_of(graph.edges()[p].a)].position();
    const Point2 b = poses[*graph.node_of(graph.edges()[p].b)].position();
    const bool crosses = std::min(a.x_m, b.x_m) == 2.0 && std::max(a.x_m, b.x_m) == 3.0 &&
                         std::abs(0.5 * (a.y_m + b.y_m) - 2.0) <= 1.0 + 1e-9;
    // The bar ends on edges at its rim: both answers are right there.
    const bool at_rim = std::abs(std::abs(0.5 * (a.y_m + b.y_m) - 2.0) - 1.0) < 1e-6;
    if (!at_rim) {
      EXPECT_EQ(std::ranges::binary_search(across, p), crosses);
    }
    expected += crosses && !at_rim;
  }
  EXPECT_EQ(expected, 5U);
  EXPECT_THROW((void)find_crossed_edges(graph, {99, 0.0, 0.5, 1.0}), ContractError);
  EXPECT_THROW((void)find_crossed_edges(graph, {0, 0.0, -0.5, 1.0}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
