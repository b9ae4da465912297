#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/dissimilarity_curve.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

/// Options of an arrangement.
struct LatticeOptions {
  int neighbours = 12;  ///< number of most similar views to which each view gets springs
  int components = 0;   ///< number of compared Fourier components; 0: all
  bool phases = true;   ///< directions and headings from phases [M04 section 3.4]
  int landmarks = 150;  ///< landmark views of the multidimensional scaling
  int rounds = 3;       ///< number of times that curve and springs are computed
};
void visit_options(LatticeOptions& options, OptionVisitor& visitor);

/// The coarse motion of a robot from one view to another [M04 section 3.4].
struct CoarseMotion {
  ViewId from;                         ///< where the motion begins
  ViewId to;                           ///< where it ends
  Pose2 step;                          ///< pose of `to` in the frame of `from`, metres
  double distance_deviation_m = 0.06;  ///< above 0
  double direction_deviation_rad =
      0.2;                          ///< above 0, of the direction of travel in the frame `from`
  double turn_deviation_rad = 0.2;  ///< above 0
};

/// Standard deviations of a robot's motion; the defaults are for wheels that slip.
struct CoarseMotionOptions {
  double distance_deviation = 0.06;       ///< standard deviation, share of the distance
  double direction_deviation_rad = 0.15;  ///< of the direction of travel
  double turn_deviation_rad = 0.15;       ///< of the turn
};
void visit_options(CoarseMotionOptions& options, OptionVisitor& visitor);

/// Makes a motion with the standard deviations of the options. Steps below 1 cm get the distance
/// deviation of 1 cm, so that it is above 0. Throws OptionError.
[[nodiscard]] CoarseMotion make_coarse_motion(ViewId from, ViewId to, const Pose2& step,
                                              const CoarseMotionOptions& options = {});

/// Views, the springs between them and the poses computed from the springs [M04 section 3].
struct Lattice {
  /// A view in the arrangement.
  struct Node {
    ViewId view;                ///< an id of the memory
    Pose2 pose;                 ///< in its component's frame; heading 0 without phases
    std::size_t component = 0;  ///< index of its connected component
  };
  /// Two views and their distance, estimated from their dissimilarity.
  struct Spring {
    std::size_t a = 0;                   ///< nodes, a < b
    std::size_t b = 0;                   ///< the other node
    double dissimilarity = 0.0;          ///< of the two views, over the components of the options
    double length = 0.0;                 ///< rest length, read from the dissimilarity
    double stiffness = 1.0;              ///< K of [M04 eq. 5]
    double weight = 1.0;                 ///< robust weight, 0 .. 1; near 0: an outlier
    std::optional<PhaseReading> phases;  ///< nullopt without phases
    /// Correlation of the views less that with a mirrored view, which shows no place
    /// (`compute_excess_over_mirror`): large if the phases are right. 0 without phases.
    double excess_over_mirror = 0.0;
  };
  /// Standard deviations of springs, estimated from the arrangement. Lengths are in the unit of the
  /// arrangement.
  struct Errors {
    double length = 0.25;        ///< of the rest length of a spring of stiffness 1
    double direction_rad = 0.1;  ///< of a direction in which both views agree
    double turn_rad = 0.1;       ///< of a turn in which both views agree
    /// Length in the arrangement of one unit of the lengths that phases give.
    double phase_unit = 1.0;
    double phase_length = 0.25;  ///< relative standard deviation of lengths from phases
  };
  /// A connected component: views that springs connect. Each component has its own frame; the
  /// relative poses of components are unknown.
  struct Component {
    std::size_t views = 0;  ///< nodes of the component
    /// False if the component may be mirrored.
    bool handedness_known = false;
  };

  /// Two components that were joined after the last round, as several pairs of views agree on their
  /// relative pose. The springs of these pairs are weak.
  struct Join {
    std::size_t views = 0;  ///< of the smaller piece
    std::size_t pairs = 0;  ///< pairs of views that agree on its pose
  };

  /// Two views of different components that probably show the right direction to each other, by all
  /// pairs of views between the two. The evidence is too weak for a join; a robot can cross between
  /// the components by homing, and notices if it does not arrive.
  struct Crossing {
    std::size_t a = 0;         ///< nodes, a < b
    std::size_t b = 0;         ///< the other node
    PhaseReading phases;       ///< of the two views; has a direction
    double probability = 0.0;  ///< 0 .. 1, that the direction is right, by the two views alone
  };

  std::vector<Node> nodes;            ///< one for each view of the memory, in its order
  std::vector<Spring> springs;        ///< ascending (a, b)
  std::vector<Component> components;  ///< the largest first
  std::vector<Join> joins;            ///< in their order
  std::vector<Crossing> crossings;    ///< ascending (a, b)
  DissimilarityCurve curve{1.0};      ///< of the last round
  Errors errors;                      ///< of the last round
  /// Number of pairs of views that were measured; those that are no springs were rejected.
  std::size_t candidates = 0;
  /// True if lengths are in metres, from the coarse motion. Otherwise the unit is the median
  /// distance between a view and its nearest one.
  bool metric = false;
  double energy = 0.0;  ///< sum over springs of weight times squared strain in deviations
  int iterations = 0;   ///< of the solver, over all rounds
};

/// Called after each step of an arrangement with the pose and the component of each view, in the
/// memory's order. Poses are in the frame of their component; the unit of length changes between
/// steps. The spans are valid during the call only.
using LatticeStepCallback =
    std::function<void(std::span<const Pose2> poses, std::span<const std::size_t> components)>;

/// Arranges the views of a memory by their similarity alone [M04 section 3]:
/// 1. Each view gets springs to its `neighbours` most similar views.
/// 2. With phases and no motion, components grow from the most certain springs.
/// 3. Otherwise multidimensional scaling starts and the energy of the springs is minimised.
/// 4. The curve from dissimilarity to distance is fitted, near views get springs, and step 2 or 3
///    is repeated, `rounds` times in all.
///
/// `motion` [M04 section 3.4]: motions between views. With it lengths are in metres;
/// if it connects all views, only near views and those along a motion get springs. Throws
/// OptionError; ContractError on a motion with an unknown view. Same bits on any number of threads.
[[nodiscard]] Lattice arrange(const VisualMemory& memory, const LatticeOptions& options,
                              std::span<const CoarseMotion> motion, Executor& executor,
                              const LatticeStepCallback& step_callback = {});

/// Adds the views of the memory that the lattice does not have, one after the other. A view gets
/// springs to the most similar views of the lattice. Each spring proposes a pose; the one with the
/// least energy is used, then the view and its neighbours are adjusted. All other views are fixed.
/// Cost of a view: the search and one pass over the springs. A view joins the connected component
/// to which most of its springs lead; without springs it becomes a new one. Components are never
/// joined. The lattice must come from the same memory, to which views may have been added. Throws
/// OptionError, ContractError.
void extend(Lattice& lattice, const VisualMemory& memory, const LatticeOptions& options = {});

/// Converts the arrangement into a map that can be stored and exported: its views with their poses
/// and components, and its springs as edges of kind `neighbour` with the motion between the poses
/// and the weight of the spring; then its crossings, as edges between two components with the
/// motion by the phases and the probability as weight. Lengths are in the lattice's unit.
[[nodiscard]] TopologicalMap to_topological_map(const Lattice& lattice);

}  // namespace panonav
