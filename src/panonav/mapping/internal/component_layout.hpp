#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "panonav/mapping/internal/lattice_links.hpp"
#include "panonav/mapping/internal/lattice_start.hpp"

namespace panonav {

/// Views in growing connected components: their poses, each in the frame of its component, and the
/// links inside and between the components. A component has the number of one of its views.
class ComponentLayout {
 public:
  /// Starts with the components of `start`, or with single views if `start` is empty.
  ComponentLayout(std::size_t nodes, std::vector<LatticeLink> links, const LatticeLayout& start);

  /// A link between two components p and q.
  struct Ends {
    std::size_t in_p, in_q;
    Pose2 step;  ///< in_p_from_in_q
  };

  [[nodiscard]] std::span<const LatticeLink> links() const { return links_; }
  [[nodiscard]] std::span<const Pose2> poses() const { return poses_; }
  [[nodiscard]] std::span<const std::size_t> components() const { return component_; }
  [[nodiscard]] std::size_t size() const { return component_.size(); }
  [[nodiscard]] const std::vector<std::size_t>& members(std::size_t p) const { return members_[p]; }
  [[nodiscard]] const std::vector<std::size_t>& links_of(std::size_t view) const {
    return links_of_[view];
  }
  /// Numbers of the links from component p to each other component.
  [[nodiscard]] const std::map<std::size_t, std::vector<std::size_t>>& neighbours(
      std::size_t p) const {
    return between_[p];
  }
  [[nodiscard]] int iterations() const { return iterations_; }
  /// Median length of the links with a probability above one half.
  [[nodiscard]] double typical_length() const { return typical_length_; }

  [[nodiscard]] bool is_inside(const LatticeLink& link) const {
    return component_[link.a] == component_[link.b];
  }
  /// The ends of link k, that in component p first.
  [[nodiscard]] Ends ends_of(std::size_t k, std::size_t p) const;
  /// True if link k between two components agrees with their relative pose.
  [[nodiscard]] bool agrees_with(std::size_t k, const Ends& ends, const Pose2& p_from_q) const;
  /// True if a link inside a component agrees with the layout.
  [[nodiscard]] bool agrees_inside(const LatticeLink& link) const;

  /// Merges component q and its links into p. Averages p if it has grown by a quarter since its
  /// last average. Returns the components whose links to p have changed.
  std::vector<std::size_t> join(std::size_t p, std::size_t q, const Pose2& p_from_q);
  /// Adds a single view to p; drops its other links.
  void attach(std::size_t p, std::size_t view, const Pose2& p_from_view);
  /// Fits the headings, then the positions of a component to those of its inner links that agree
  /// with the layout.
  void average(std::size_t p);

 private:
  void move_members(std::size_t p, std::size_t q, const Pose2& p_from_q);

  std::vector<LatticeLink> links_;
  std::vector<Pose2> poses_;
  std::vector<std::size_t> component_;
  std::vector<std::vector<std::size_t>> members_;
  std::vector<std::vector<std::size_t>> links_of_;
  std::vector<std::map<std::size_t, std::vector<std::size_t>>> between_;
  std::vector<std::size_t>
      size_at_last_average_;  // number of views of each component at its last average
  int iterations_ = 0;
  double typical_length_ = 1.0;
};

}  // namespace panonav
