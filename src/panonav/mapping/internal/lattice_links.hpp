#pragma once

#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "panonav/mapping/lattice.hpp"

namespace panonav {

/// Largest difference between a turn by phases and in the layout: three times the error of phases
/// between adjacent places.
inline constexpr double turn_tolerance_rad = 15.0 * std::numbers::pi / 180.0;
/// Largest position error of an agreeing link, as a share of its length; chosen on simulated
/// worlds.
inline constexpr double position_tolerance = 0.6;

/// Relative pose of two views by a spring on which both agree, with the probability that it is
/// right.
struct LatticeLink {
  std::size_t a, b;
  Pose2 step;  ///< a_from_b
  double length, residual;
  double probability;  ///< that the relative pose is right
};

/// True if two headings differ by at most the tolerance, and two positions by `max_distance`.
[[nodiscard]] bool is_near(const Pose2& a, const Pose2& b, double max_distance);

/// Makes links of the springs whose views agree. Probabilities are learnt from ranks of similarity
/// and closing triangles, and updated by the comparison with a mirrored view; lengths are rescaled
/// by the local spacing of views, and lengths of 0 stay 0.
[[nodiscard]] std::vector<LatticeLink> make_links(std::size_t nodes,
                                                  std::span<const Lattice::Spring> springs,
                                                  double unit);

/// Returns for each node the numbers of its links.
[[nodiscard]] std::vector<std::vector<std::size_t>> links_by_node(
    std::size_t nodes, std::span<const LatticeLink> links);

}  // namespace panonav
