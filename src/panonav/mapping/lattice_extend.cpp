#include <algorithm>
#include <cmath>
#include <map>

#include "panonav/core/error.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

/// Some nodes of the lattice, renumbered from 0, and the springs between them.
struct Neighbourhood {
  std::vector<std::size_t> nodes;
  std::vector<Pose2> poses;
  std::vector<SpringTerm> springs;
  std::vector<std::size_t> spring_numbers;
};

Neighbourhood make_neighbourhood(const Lattice& lattice, const std::vector<std::size_t>& nodes) {
  Neighbourhood result{.nodes = nodes};
  std::map<std::size_t, std::size_t> number;
  for (const std::size_t node : nodes) {
    number.emplace(node, result.poses.size());
    result.poses.push_back(lattice.nodes[node].pose);
  }
  for (std::size_t s = 0; s < lattice.springs.size(); ++s) {
    const Lattice::Spring& spring = lattice.springs[s];
    const auto a = number.find(spring.a);
    const auto b = number.find(spring.b);
    if (a == number.end() || b == number.end()) continue;
    SpringTerm term = make_spring_term(spring, lattice.errors, true);
    term.a = a->second;
    term.b = b->second;
    result.springs.push_back(term);
    result.spring_numbers.push_back(s);
  }
  return result;
}

class Extender {
 public:
  Extender(Lattice& lattice, const VisualMemory& memory, const LatticeOptions& options)
      : lattice_(lattice), memory_(memory), options_(options) {
    for (const Lattice::Node& node : lattice.nodes) {
      require(memory.contains(node.view), "view of the lattice", node.view.value,
              "a view of the memory");
      require(node_of_view_.empty() || node_of_view_.rbegin()->first < node.view,
              "view of the lattice", node.view.value, "later than the one before");
      node_of_view_.emplace(node.view, node_of_view_.size());
    }
    for (const ViewId view : memory.views()) {
      if (!node_of_view_.contains(view)) new_views_.push_back(view);
    }
    require(new_views_.empty() || node_of_view_.empty() ||
                node_of_view_.rbegin()->first < new_views_.front(),
            "new view", new_views_.empty() ? 0.0 : new_views_.front().value,
            "later than those of the lattice");
  }

  void add_all() {
    // The search must not find views that are not in the lattice yet.
    std::vector<ViewId> excluded = new_views_;
    for (const ViewId view : new_views_) {
      add_view(view, excluded);
      excluded.erase(excluded.begin());
    }
    std::ranges::sort(lattice_.springs, {}, [](const auto& s) { return NodePair{s.a, s.b}; });
  }

 private:
  void add_view(ViewId view, std::span<const ViewId> excluded) {
    const std::size_t node = lattice_.nodes.size();
    std::vector<Lattice::Spring> springs = make_springs(view, node, excluded);
    node_of_view_.emplace(view, node);
    std::map<std::size_t, std::size_t> links_to_component;
    for (const auto& spring : springs) ++links_to_component[lattice_.nodes[spring.a].component];
    if (links_to_component.empty()) {
      lattice_.nodes.push_back({view, {}, lattice_.components.size()});
      lattice_.components.push_back({.views = 1, .handedness_known = false});
      return;
    }
    const std::size_t component =
        std::ranges::max_element(links_to_component, {}, [](const auto& p) {
          return p.second;
        })->first;
    std::erase_if(springs,
                  [&](const auto& s) { return lattice_.nodes[s.a].component != component; });
    lattice_.nodes.push_back({view, {}, component});
    ++lattice_.components[component].views;
    lattice_.springs.insert(lattice_.springs.end(), springs.begin(), springs.end());
    place_node(node, springs);
    relax_around(node, springs);
  }

  [[nodiscard]] std::vector<Lattice::Spring> make_springs(ViewId view, std::size_t node,
                                                          std::span<const ViewId> excluded) const {
    std::vector<Lattice::Spring> springs;
    if (node == 0) return springs;
    const PackedSignature query = memory_.packed(view);
    const auto found = memory_.search(query, {options_.neighbours, options_.components},
                                      {.excluded_views = excluded});
    for (const Match& match : found.matches) {
      if (match.dissimilarity > lattice_.curve.max_dissimilarity()) continue;
      if (!are_on_one_floor(memory_, match.view, view)) continue;
      Lattice::Spring spring{.a = node_of_view_.at(match.view),
                             .b = node,
                             .dissimilarity = static_cast<double>(match.dissimilarity)};
      if (options_.phases) spring.phases = read_phases(homing(match.view), homing(view));
      if (!has_agreeing_views(spring)) continue;
      spring.length = lattice_.curve.distance(spring.dissimilarity);
      spring.stiffness = lattice_.curve.stiffness(spring.length);
      springs.push_back(spring);
    }
    return springs;
  }

  [[nodiscard]] HomingView homing(ViewId view) const {
    const HomingView coefficients = homing_view(memory_, view);
    return options_.components > 0 ? first_components(coefficients, options_.components)
                                   : coefficients;
  }

  /// Sets the pose of the node: of the poses that its springs propose, the one with the least
  /// energy.
  void place_node(std::size_t node, std::span<const Lattice::Spring> springs) {
    std::vector<std::size_t> nodes;
    for (const auto& spring : springs) nodes.push_back(spring.a);
    nodes.push_back(node);
    Neighbourhood around = make_neighbourhood(lattice_, nodes);
    std::vector<unsigned char> moving(nodes.size(), 0);
    moving.back() = 1;
    double min_energy = INFINITY;
    for (const auto& spring : springs) {
      Pose2 step{spring.length, 0.0, 0.0};
      if (spring.phases) {
        step = {spring.length * std::cos(spring.phases->direction_a_rad),
                spring.length * std::sin(spring.phases->direction_a_rad), spring.phases->turn_rad};
      }
      around.poses.back() = lattice_.nodes[spring.a].pose * step;
      const auto solution = solve_lattice(around.springs, around.poses, moving);
      if (solution.energy >= min_energy) continue;
      min_energy = solution.energy;
      lattice_.nodes[node].pose = around.poses.back();
    }
  }

  /// Relaxes the poses of the new node and its neighbours; the neighbours of its neighbours are
  /// fixed.
  void relax_around(std::size_t node, std::span<const Lattice::Spring> springs) {
    std::vector<unsigned char> role(lattice_.nodes.size(), 0);  // 1: fixed, 2: moves
    role[node] = 2;
    for (const auto& spring : springs) role[spring.a] = 2;
    for (const Lattice::Spring& spring : lattice_.springs) {
      if (role[spring.a] == 2 && role[spring.b] == 0) role[spring.b] = 1;
      if (role[spring.b] == 2 && role[spring.a] == 0) role[spring.a] = 1;
    }
    std::vector<std::size_t> nodes;
    std::vector<unsigned char> moving;
    for (std::size_t i = 0; i < role.size(); ++i) {
      if (role[i] == 0) continue;
      nodes.push_back(i);
      moving.push_back(role[i] == 2 ? 1 : 0);
    }
    Neighbourhood around = make_neighbourhood(lattice_, nodes);
    const auto solution = solve_lattice(around.springs, around.poses, moving);
    lattice_.iterations += solution.iterations;
    for (std::size_t i = 0; i < nodes.size(); ++i) lattice_.nodes[nodes[i]].pose = around.poses[i];
    for (std::size_t s = 0; s < around.spring_numbers.size(); ++s) {
      lattice_.springs[around.spring_numbers[s]].weight = solution.weights[s];
    }
  }

  Lattice& lattice_;
  const VisualMemory& memory_;
  LatticeOptions options_;
  std::map<ViewId, std::size_t> node_of_view_;
  std::vector<ViewId> new_views_;
};

}  // namespace

void extend(Lattice& lattice, const VisualMemory& memory, const LatticeOptions& options) {
  validate(options);
  Extender(lattice, memory, options).add_all();
}

}  // namespace panonav
