#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A direction of a spring in the frame of a robot.
struct SpringDirection {
  double from_a_rad = 0.0;           ///< towards b, in the frame of a
  std::optional<double> from_b_rad;  ///< towards a, in the frame of b; nullopt: not known
  double deviation_rad = 0.1;        ///< > 0
};
/// A turn of a spring.
struct SpringTurn {
  double turn_rad = 0.0;       ///< heading of b minus heading of a
  double deviation_rad = 0.1;  ///< > 0
};

/// A second measurement of a spring's length, next to the rest length.
struct SpringLength {
  double length = 1.0;     ///< >= 0
  double deviation = 0.1;  ///< > 0
};

/// One spring of the lattice as an equation of the solver: measurements of the motion from node a
/// to node b, each with its standard deviation.
struct SpringTerm {
  std::size_t a = 0;
  std::size_t b = 0;
  double length = 1.0;            ///< rest length, >= 0
  double length_deviation = 0.1;  ///< > 0
  std::optional<SpringDirection> direction;
  std::optional<SpringLength> along_direction;  ///< length from phases; nullopt: not known
  std::optional<SpringTurn> turn;
  bool is_certain = false;  ///< never rejected, however far it is stretched
};

/// The result of `solve_lattice`.
struct LatticeSolution {
  /// Robust weight of each spring, 0 .. 1, by its direction and turn or, without these, by its
  /// length. Near 0 the spring was rejected, as it contradicts the others.
  std::vector<double> weights;
  double energy = 0.0;  ///< sum over springs of weight times squared strain in deviations
  int iterations = 0;
};

/// Moves the poses so that the energy of the springs is minimal [M04 section 3.2], by damped sparse
/// non-linear least squares. Springs that contradict the rest are rejected gradually: Geman-
/// McClure loss whose width shrinks to three deviations (graduated non-convexity), so that the
/// result depends little on the start. Direction and turn are rejected together; lengths are
/// rejected with them, or alone if there is neither. `moving`: one entry per pose, 0 fixes the
/// pose; empty: all move. A component without a fixed pose hardly moves as a whole. `on_step`:
/// called after each step that moved the poses. Throws ContractError on indices or numbers out of
/// range. Deterministic. Cost per iteration: one sparse factorisation.
LatticeSolution solve_lattice(std::span<const SpringTerm> springs, std::span<Pose2> poses,
                              std::span<const unsigned char> moving = {},
                              const std::function<void()>& on_step = {});

}  // namespace panonav
