#include "panonav/mapping/internal/component_layout.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"
#include "panonav/mapping/internal/join_evidence.hpp"

namespace panonav {

namespace {

/// Growth factor after which a component is averaged again; all averages together cost as much as
/// five of the whole.
constexpr double min_growth = 1.25;
/// Number of reweighted solutions in each average; 3 was chosen on simulated worlds.
constexpr int average_rounds = 3;
/// Residuals below these are squared in the cost, larger ones are not: 2 degrees, the resolution of
/// phases, and a tenth of the link's length.
constexpr double huber_angle_rad = 0.03;
constexpr double huber_gap_share = 0.1;

/// Minimises the absolute residuals of the links inside one component by iteratively reweighted
/// least squares. The first view does not move.
class ComponentAverage {
 public:
  ComponentAverage(const std::vector<std::size_t>& views, std::vector<std::size_t> inside,
                   std::span<const LatticeLink> links, std::vector<Pose2>& poses)
      : links_(links), inside_(std::move(inside)), poses_(poses) {
    for (const std::size_t view : views) {
      unknown_.emplace(view, static_cast<int>(unknown_.size()) - 1);
    }
  }

  /// False where the equations cannot be solved.
  bool average_headings() {
    const auto missing = [&](std::size_t k) {
      const LatticeLink& link = links_[k];
      return angle_difference(link.step.heading_rad,
                              poses_[link.b].heading_rad - poses_[link.a].heading_rad);
    };
    const auto weight = [&](std::size_t k) {
      return links_[k].probability / std::max(huber_angle_rad, std::abs(missing(k)));
    };
    for (int round = 0; round < average_rounds; ++round) {
      const auto change = solve(missing, weight);
      if (!change) return false;
      for (const auto& [view, i] : unknown_) {
        if (i >= 0) poses_[view].heading_rad = wrap_angle(poses_[view].heading_rad + (*change)(i));
      }
    }
    return true;
  }

  void average_positions() {
    const auto missing = [&](std::size_t k) {
      const Pose2 read = poses_[links_[k].a] * links_[k].step;
      const Pose2& b = poses_[links_[k].b];
      return Point2{read.x_m - b.x_m, read.y_m - b.y_m};
    };
    const auto weight = [&](std::size_t k) {
      const LatticeLink& link = links_[k];
      const Point2 gap = missing(k);
      return link.probability /
             (link.length * std::max(huber_gap_share * link.length, std::hypot(gap.x_m, gap.y_m)));
    };
    for (int round = 0; round < average_rounds; ++round) {
      const auto dx = solve([&](std::size_t k) { return missing(k).x_m; }, weight);
      const auto dy = solve([&](std::size_t k) { return missing(k).y_m; }, weight);
      if (!dx || !dy) return;
      for (const auto& [view, i] : unknown_) {
        if (i < 0) continue;
        poses_[view].x_m += (*dx)(i);
        poses_[view].y_m += (*dy)(i);
      }
    }
  }

 private:
  /// Solves for the changes of the unknowns. `missing(k)`: residual of link k; `weight(k)`:
  /// weight of its square.
  template <class Missing, class Weight>
  std::optional<Eigen::VectorXd> solve(const Missing& missing, const Weight& weight) {
    const int unknowns = static_cast<int>(unknown_.size()) - 1;
    equations_.reset(unknowns);
    for (int i = 0; i < unknowns; ++i) equations_.add(i, i, 1e-9);
    for (const std::size_t k : inside_) {
      const double w = weight(k);
      const double r = missing(k);
      const int a = unknown_.at(links_[k].a);
      const int b = unknown_.at(links_[k].b);
      if (a >= 0) {
        equations_.add(a, a, w);
        equations_.right(a) -= w * r;
      }
      if (b >= 0) {
        equations_.add(b, b, w);
        equations_.right(b) += w * r;
      }
      if (a >= 0 && b >= 0) equations_.add(a, b, -w);
    }
    equations_.assemble();
    return equations_.solve();
  }

  std::span<const LatticeLink> links_;
  std::vector<std::size_t> inside_;  // numbers of links
  std::vector<Pose2>& poses_;
  std::map<std::size_t, int> unknown_;  // of each view; -1: it stays
  SparseEquations equations_;
};

}  // namespace

ComponentLayout::ComponentLayout(std::size_t nodes, std::vector<LatticeLink> links,
                                 const LatticeLayout& start)
    : links_(std::move(links)),
      poses_(start.poses.empty() ? std::vector<Pose2>(nodes) : start.poses),
      component_(nodes),
      members_(nodes),
      links_of_(links_by_node(nodes, links_)),
      between_(nodes),
      size_at_last_average_(nodes, 1) {
  std::vector<double> lengths;
  for (const LatticeLink& link : links_) {
    if (link.probability > 0.5 && link.length > 0.0) lengths.push_back(link.length);
  }
  typical_length_ = lengths.empty() ? 1.0 : upper_median(lengths);
  // Links between images of one place have no direction and no length; they get a length of
  // adjacent views.
  for (LatticeLink& link : links_) {
    if (link.length == 0.0) link.length = adjacent_distance_in_links * typical_length_;
  }
  std::map<std::size_t, std::size_t> first;  // view of each component
  for (std::size_t i = 0; i < nodes; ++i) {
    const std::size_t component = start.components.empty() ? i : start.components[i];
    component_[i] = first.try_emplace(component, i).first->second;
    members_[component_[i]].push_back(i);
  }
  for (std::size_t i = 0; i < nodes; ++i) {
    size_at_last_average_[i] = std::max<std::size_t>(1, members_[i].size());
  }
  for (std::size_t k = 0; k < links_.size(); ++k) {
    const auto [p, q] = std::pair(component_[links_[k].a], component_[links_[k].b]);
    if (p == q) continue;
    between_[p][q].push_back(k);
    between_[q][p].push_back(k);
  }
}

ComponentLayout::Ends ComponentLayout::ends_of(std::size_t k, std::size_t p) const {
  const LatticeLink& link = links_[k];
  if (component_[link.a] == p) return {link.a, link.b, link.step};
  return {link.b, link.a, inverse(link.step)};
}

bool ComponentLayout::agrees_with(std::size_t k, const Ends& ends, const Pose2& p_from_q) const {
  return is_near(poses_[ends.in_p] * ends.step, p_from_q * poses_[ends.in_q],
                 position_tolerance * links_[k].length);
}

bool ComponentLayout::agrees_inside(const LatticeLink& link) const {
  return is_near(poses_[link.a] * link.step, poses_[link.b], position_tolerance * link.length);
}

void ComponentLayout::move_members(std::size_t p, std::size_t q, const Pose2& p_from_q) {
  for (const std::size_t view : members_[q]) {
    poses_[view] = p_from_q * poses_[view];
    component_[view] = p;
    members_[p].push_back(view);
  }
  members_[q].clear();
}

std::vector<std::size_t> ComponentLayout::join(std::size_t p, std::size_t q,
                                               const Pose2& p_from_q) {
  move_members(p, q, p_from_q);
  between_[p].erase(q);
  between_[q].erase(p);
  std::vector<std::size_t> changed;
  for (const auto& [other, links] : between_[q]) {
    auto& all = between_[p][other];
    all.insert(all.end(), links.begin(), links.end());
    between_[other][p] = all;
    between_[other].erase(q);
    changed.push_back(other);
  }
  between_[q].clear();
  if (static_cast<double>(members_[p].size()) >
      min_growth * static_cast<double>(size_at_last_average_[p])) {
    average(p);
    changed.clear();
    for (const auto& [other, links] : between_[p]) changed.push_back(other);
  }
  return changed;
}

void ComponentLayout::attach(std::size_t p, std::size_t view, const Pose2& p_from_view) {
  move_members(p, view, p_from_view);
  for (const auto& [other, unused] : between_[view]) between_[other].erase(view);
  between_[view].clear();
}

void ComponentLayout::average(std::size_t p) {
  const auto& views = members_[p];
  size_at_last_average_[p] = views.size();
  std::vector<std::size_t> inside;
  for (const std::size_t view : views) {
    for (const std::size_t k : links_of_[view]) {
      if (links_[k].a == view && component_[links_[k].b] == p && agrees_inside(links_[k])) {
        inside.push_back(k);
      }
    }
  }
  iterations_ += 2 * average_rounds;
  ComponentAverage average(views, std::move(inside), links_, poses_);
  if (average.average_headings()) average.average_positions();
}

}  // namespace panonav
