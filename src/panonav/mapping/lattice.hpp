#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/dissimilarity_curve.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

struct LatticeOptions {
  int neighbours = 12;  ///< springs that each view asks for
  int components = 0;   ///< of the signatures; 0 takes all
  bool phases = true;   ///< directions and headings from phases [M04 section 3.4]
  int landmarks = 150;  ///< views from which the start is laid out
  int rounds = 3;       ///< how often curve and springs are made anew from the arrangement
};
void visit_options(LatticeOptions& options, OptionVisitor& visitor);

/// What a robot without good odometry knows of its way from one view to another [M04 section 3.4].
struct CoarseMotion {
  ViewId from;
  ViewId to;
  Pose2 step;                            ///< from_from_to, metres
  double distance_deviation_m = 0.06;    ///< > 0
  double direction_deviation_rad = 0.2;  ///< > 0, of the direction of travel in the frame `from`
  double turn_deviation_rad = 0.2;       ///< > 0
};

/// How far the motion of a robot is trusted; the defaults are those of wheels that slip.
struct CoarseMotionOptions {
  double distance_deviation = 0.06;       ///< standard deviation, share of the distance
  double direction_deviation_rad = 0.15;  ///< of the direction of travel
  double turn_deviation_rad = 0.15;       ///< of the turn
};
void visit_options(CoarseMotionOptions& options, OptionVisitor& visitor);

/// The motion with deviations as the options say; one centimetre of travel at least. Throws
/// OptionError.
[[nodiscard]] CoarseMotion coarse_motion(ViewId from, ViewId to, const Pose2& step,
                                         const CoarseMotionOptions& options = {});

/// A view in the arrangement.
struct LatticeNode {
  ViewId view;
  Pose2 pose;            ///< in the frame of its part; heading 0 where no phases were asked for
  std::size_t part = 0;  ///< index of its group
};

struct LatticeSpring {
  std::size_t a = 0;  ///< nodes, a < b
  std::size_t b = 0;
  double dissimilarity = 0.0;
  double length = 0.0;     ///< rest length, read from the dissimilarity
  double stiffness = 1.0;  ///< K of [M04 eq. 5]
  double weight = 1.0;     ///< what is left of it, 1 .. 0: near 0 it contradicts the others
  std::optional<PhaseReading> phases;
};

/// How far springs are off, as the arrangement itself tells; lengths in its unit.
struct SpringErrors {
  double length = 0.25;        ///< of the rest length of a spring of stiffness 1
  double direction_rad = 0.1;  ///< of a direction in which both views agree
  double turn_rad = 0.1;       ///< of a turn in which both views agree
  /// How long the unit of the lengths that phases tell is, and how far these are off, as a share.
  double phase_unit = 1.0;
  double phase_length = 0.25;
};

/// Views that springs hold together. Different parts lie in frames of their own: nothing is known
/// of how they lie to each other.
struct LatticePart {
  std::size_t views = 0;
  /// False: it may as well be the mirror image.
  bool handedness_known = false;
};

/// Views arranged as they lie in space.
struct Lattice {
  std::vector<LatticeNode> nodes;      ///< one for each view of the memory, in its order
  std::vector<LatticeSpring> springs;  ///< ascending (a, b)
  std::vector<LatticePart> parts;      ///< the largest first
  DissimilarityCurve curve{1.0};
  SpringErrors errors;
  /// True: metres, from the coarse motion. False: the unit is the median distance of a view to its
  /// nearest one.
  bool metric = false;
  double energy = 0.0;
  int iterations = 0;
};

/// Arranges the views of a memory by their likeness alone [M04 section 3], in whatever order they
/// came; poses that the memory may hold are not looked at.
///
/// 1. Each view asks for springs to its `neighbours` most alike views, so cost grows with the views
///    and not with their pairs.
/// 2. With phases, both views of a spring say where the other one lies and how it is turned. Pairs
///    whose answers differ by more than 45 degrees have nothing in common and get no spring; nor do
///    those of whose triangles with third views not more than half close.
/// 3. The start is deterministic: multidimensional scaling of the shortest ways along the springs.
///    A mirror image is told by the directions; without phases it cannot be.
/// 4. Springs and, with phases, directions and turns are brought to their least energy, and those
///    that contradict the others are given up (lattice_solver.hpp).
/// 5. The curve from dissimilarity to distance is fitted to the arrangement, pairs beyond its range
///    are left out, views that came to lie near each other get springs too, and 3 or 4 are done
///    again, `rounds` times in all.
///
/// `motion` [M04 section 3.4]: ways of the robot between views, any number. Views that it connects
/// are laid out by it first, and only what fits is taken from likeness: so places that look alike
/// are not mistaken for each other. It makes the map metric. Throws OptionError, and ContractError
/// on a motion with an unknown view or numbers that are not finite. The same input gives the same
/// bits on any number of threads.
[[nodiscard]] Lattice arrange(const VisualMemory& memory, const LatticeOptions& options,
                              std::span<const CoarseMotion> motion, Executor& executor);

/// Adds the views that the memory has and the lattice has not, one after the other: springs to the
/// most alike views of the lattice, the place of least energy among those that they point to, then
/// a few nodes around give way. Other views stay where they are, so the cost of a view does not
/// grow with the lattice but for the search (and one look at each spring). A view joins the one
/// part to which most of its springs lead; without springs it is a part of its own, which is last.
/// `arrange` joins parts, this does not. The lattice must come from the same memory, of which views
/// may only have been added. Throws OptionError, ContractError.
void extend(Lattice& lattice, const VisualMemory& memory, const LatticeOptions& options = {});

}  // namespace panonav
