#include "panonav/mapping/topological_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/loop_closure_finder.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

/// Standard deviations of a step of length 0: the noise of the images.
constexpr double min_position_deviation_m = 0.005;
constexpr double min_heading_deviation_rad = 0.003;
/// Standard deviation of the position by a closure: per unit of its residual, in units of R, as
/// residuals shorten the displacement between views; and in metres without a residual.
constexpr double closure_deviation_per_residual = 1.0;
constexpr double closure_position_deviation_m = 0.02;
/// Standard deviation of the heading by a closure: in rad per metre between the views, and in rad
/// for views at one place.
constexpr double closure_heading_deviation_rad_per_m = 0.05;
constexpr double closure_heading_deviation_rad = 0.01;
/// Number of latest steps from which scale and turn error of the views are learnt; both change from
/// room to room. 10 to 40 give the same result (docs/decisions.md).
constexpr std::size_t max_kept_steps = 15;
/// Weight below which a closure is dropped: the rest of the map contradicts it by more than seven
/// standard deviations.
constexpr double min_closure_weight = 0.1;
/// Largest error of a closure, in standard deviations, without optimising the whole map: normal
/// errors exceed it once in 370 times.
constexpr double max_closure_deviations = 3.0;
/// The whole map is optimised again only after it has grown by one node for each of this number of
/// nodes, 1 %.
constexpr std::size_t min_growth_divisor = 100;

double length(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m);
}

template <class T>
void keep_latest(std::vector<T>& steps, const T& latest) {
  if (steps.size() == max_kept_steps) steps.erase(steps.begin());
  steps.push_back(latest);
}

double squared(double value) {
  return value * value;
}

}  // namespace

void visit_options(MappingOptions& options, OptionVisitor& visitor) {
  using T = MappingOptions;
  constexpr OptionTable table{
      option<&T::capture_difference>("store an image as a view if it differs from the last stored "
                                     "view by more than this; 0: store every image",
                                     0, 1),
      option<&T::close_loops>("search for loop closures"),
      option<&T::bridge_m>(
          "assumed length of a step that cannot be computed; 0: start a new component", 0, 1e6),
      option<&T::wheels>(
          "take the steps from the odometry, and correct their rotations with the images"),
      option<&T::step_deviation>(
          "standard deviation of the positions computed from images, per metre", above(0), 10),
      option<&T::turn_deviation>(
          "standard deviation of the headings computed from images (rad), per metre", above(0), 10),
  };
  table.visit(options, visitor);
}

class TopologicalMapper::Implementation {
 public:
  Implementation(const VisualMemory& memory, const MappingOptions& options,
                 const VisualOdometryOptions& odometry, const LoopClosureOptions& closure,
                 const PoseGraphOptions& graph)
      : memory_(&memory),
        options_(options),
        odometry_(odometry),
        graph_(graph),
        finder_(memory, closure, odometry) {
    validate(options);
    validate(graph);
  }

  [[nodiscard]] bool is_new(const OdometryView& view) const {
    const auto& last = odometry_.last();
    if (!last || options_.capture_difference == 0.0) return true;
    return image_difference(last->coefficients, view.coefficients) > options_.capture_difference;
  }

  TopologicalMapper::Update add(ViewId view, OdometryView image,
                                const std::optional<Pose2>& moved) {
    if (!memory_->contains(view) || (!nodes_.empty() && view <= nodes_.back().view)) {
      throw ContractError("view", static_cast<double>(view.value),
                          "a view of the memory, later than those of the map");
    }
    if (moved) {
      require(is_finite(*moved), "step of the wheels", length(*moved), "finite");
    }
    TopologicalMapper::Update update;
    update.step = odometry_.add(std::move(image));
    nodes_.push_back({view});
    if (nodes_.size() == 1) {
      poses_.emplace_back();
      update.new_component = true;
    } else {
      if (moved && update.step && options_.wheels) {
        keep_latest(known_lengths_, {update.step->length_in_views, length(*moved)});
      }
      add_step(update.step, moved, update);
    }
    if (options_.close_loops) close_loops(update);
    return update;
  }

  void finish() {
    if (changed_) optimise();
  }

  [[nodiscard]] TopologicalMap map() const {
    TopologicalMap map;
    std::map<std::size_t, std::size_t> number;
    for (std::size_t i = 0; i < size(); ++i) {
      const auto component = number.try_emplace(nodes_[i].component, number.size()).first->second;
      map.nodes.push_back({nodes_[i].view, poses_[i], component});
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const PoseEdge& edge = edges_[i];
      map.edges.push_back({nodes_[edge.a].view, nodes_[edge.b].view, edge.a_from_b,
                           edge.doubtful ? Link::Kind::closure : Link::Kind::sequence,
                           weights_[i]});
    }
    return map;
  }

  [[nodiscard]] double scale_m() const {
    return length_scale_m(known_lengths_).value_or(odometry_.scale_m());
  }

  [[nodiscard]] std::size_t size() const noexcept { return poses_.size(); }
  [[nodiscard]] std::span<const Pose2> poses() const noexcept { return poses_; }

 private:
  void add_step(const std::optional<VisualStep>& step, const std::optional<Pose2>& moved,
                TopologicalMapper::Update& update) {
    const std::size_t here = nodes_.size() - 1;
    if (!step && !moved && options_.bridge_m > 0.0) {
      constexpr double any_heading_rad = 1.0;
      edges_.push_back(
          {here - 1, here, {options_.bridge_m, 0.0, 0.0}, options_.bridge_m, any_heading_rad});
      weights_.push_back(1.0);
      poses_.push_back(poses_.back() * edges_.back().a_from_b);
      nodes_[here].component = nodes_[here - 1].component;
      nodes_[here].path_m = nodes_[here - 1].path_m + options_.bridge_m;
      return;
    }
    if (!step && !moved) {
      // The path length continues, so that the views before and after the break are no candidates
      // for loop closures with each other.
      update.new_component = true;
      nodes_[here].component = nodes_[here - 1].component + 1;
      poses_.emplace_back();
      nodes_[here].path_m = nodes_[here - 1].path_m;
      return;
    }
    const bool wheels = moved && (options_.wheels || !step);
    if (wheels) {
      edges_.push_back(fuse_wheel_step(*moved, step));
    } else {
      const Pose2& motion = step->before_from_after;
      edges_.push_back({here - 1, here, motion,
                        options_.step_deviation * length(motion) + min_position_deviation_m,
                        options_.turn_deviation * length(motion) + min_heading_deviation_rad});
    }
    const Pose2& motion = edges_.back().a_from_b;
    weights_.push_back(1.0);
    poses_.push_back(poses_.back() * motion);
    nodes_[here].component = nodes_[here - 1].component;
    nodes_[here].path_m = nodes_[here - 1].path_m + length(motion);
  }

  /// Returns the wheels' step from the node before, with the mean of the rotations by wheels and by
  /// views. Rotations by views are biased while one side of the scene is nearer, which only the
  /// wheels reveal.
  PoseEdge fuse_wheel_step(const Pose2& moved, const std::optional<VisualStep>& step) {
    const std::size_t here = nodes_.size() - 1;
    const double length_m = length(moved);
    const StepSampler error(moved, OdometryNoise{});
    PoseEdge edge{here - 1, here, moved, error.translation_deviation_m() + min_position_deviation_m,
                  error.rotation_deviation_rad() + min_heading_deviation_rad};
    if (!step) return edge;
    const double view_turn_rad = step->before_from_after.heading_rad;
    const double difference_rad = angle_difference(moved.heading_rad, view_turn_rad);
    keep_latest(turns_, {difference_rad, squared(edge.heading_deviation_rad),
                         squared(options_.turn_deviation * length_m + min_heading_deviation_rad)});
    TurnDifference sum{};
    for (const TurnDifference& each : turns_) {
      sum.difference_rad += each.difference_rad;
      sum.wheel_variance += each.wheel_variance;
      sum.view_variance += each.view_variance;
    }
    const double view_variance =
        std::max(sum.view_variance, squared(sum.difference_rad) - sum.wheel_variance);
    const double wheel_share = view_variance / (view_variance + sum.wheel_variance);
    edge.a_from_b.heading_rad = wrap_angle(view_turn_rad + wheel_share * difference_rad);
    edge.heading_deviation_rad *= std::sqrt(wheel_share);
    return edge;
  }

  void close_loops(TopologicalMapper::Update& update) {
    const double scale_m = this->scale_m();
    update.closures = finder_.find(nodes_, poses_, *odometry_.last(), scale_m);
    for (const LoopClosure& closure : update.closures) {
      join_components(closure);
      const double length_m = length(closure.earlier_from_later);
      edges_.push_back(
          {closure.earlier, closure.later, closure.earlier_from_later,
           closure_deviation_per_residual * closure.residual * scale_m +
               closure_position_deviation_m,
           closure_heading_deviation_rad_per_m * length_m + closure_heading_deviation_rad, true});
      weights_.push_back(1.0);
    }
    if (update.closures.empty()) return;
    changed_ = true;
    optimise_latest();
    for (std::size_t i = edges_.size() - update.closures.size(); i < edges_.size(); ++i) {
      if (normalised_residual(edges_[i], poses_) > max_closure_deviations)
        needs_optimisation_ = true;
    }
    if (needs_optimisation_ &&
        size() >=
            optimised_size_ + std::max<std::size_t>(1, optimised_size_ / min_growth_divisor)) {
      optimise();
      update.optimised = true;
    }
  }

  /// Optimises the nodes since the last closure, whose edges are at the end of the list.
  void optimise_latest() {
    const std::size_t first = last_closure_node_ + 1;
    last_closure_node_ = size() - 1;
    if (first >= size()) return;
    std::map<std::size_t, std::size_t> number;  // of nodes in the small graph
    std::vector<Pose2> poses;
    std::vector<std::uint8_t> fixed;
    const auto number_of = [&](std::size_t node) {
      const auto [found, added] = number.try_emplace(node, poses.size());
      if (added) {
        poses.push_back(poses_[node]);
        fixed.push_back(node < first ? 1 : 0);
      }
      return found->second;
    };
    std::vector<PoseEdge> edges;
    for (std::size_t i = edges_.size(); i-- > 0 && std::max(edges_[i].a, edges_[i].b) >= first;) {
      PoseEdge edge = edges_[i];
      edge.a = number_of(edge.a);
      edge.b = number_of(edge.b);
      edges.push_back(edge);
    }
    static_cast<void>(optimise_pose_graph(poses, edges, graph_, fixed));
    for (const auto& [node, at] : number) poses_[node] = poses[at];
  }

  void join_components(const LoopClosure& closure) {
    const std::size_t kept = nodes_[closure.earlier].component;
    const std::size_t joined = nodes_[closure.later].component;
    if (kept == joined) return;
    const Pose2 kept_from_joined =
        poses_[closure.earlier] * closure.earlier_from_later * inverse(poses_[closure.later]);
    for (std::size_t i = 0; i < size(); ++i) {
      if (nodes_[i].component != joined) continue;
      nodes_[i].component = kept;
      poses_[i] = kept_from_joined * poses_[i];
    }
  }

  void optimise() {
    weights_ = optimise_pose_graph(poses_, edges_, graph_).edge_weights;
    // Closures that the rest of the map refutes are dropped.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (edges_[i].doubtful && weights_[i] < min_closure_weight) continue;
      edges_[kept] = edges_[i];
      weights_[kept++] = weights_[i];
    }
    edges_.resize(kept);
    weights_.resize(kept);
    optimised_size_ = size();
    changed_ = false;
    needs_optimisation_ = false;
  }

  const VisualMemory* memory_;
  MappingOptions options_;
  VisualOdometry odometry_;
  PoseGraphOptions graph_;
  LoopClosureFinder finder_;
  std::vector<PathNode> nodes_;
  std::vector<Pose2> poses_;
  std::vector<PoseEdge> edges_;
  std::vector<double> weights_;
  std::vector<KnownLength> known_lengths_;
  /// The turn by the wheels minus that by the views, and the assumed variances of both.
  struct TurnDifference {
    double difference_rad, wheel_variance, view_variance;
  };
  std::vector<TurnDifference> turns_;
  std::size_t optimised_size_ = 0;     // nodes when the map was last optimised
  std::size_t last_closure_node_ = 0;  // the latest node of the closures so far
  bool changed_ = false;               // closures were added since then
  bool needs_optimisation_ = false;    // a closure contradicts the older map, too
};

TopologicalMapper::TopologicalMapper(const VisualMemory& memory, const MappingOptions& options,
                                     const VisualOdometryOptions& odometry,
                                     const LoopClosureOptions& closure,
                                     const PoseGraphOptions& graph)
    : implementation_(std::make_unique<Implementation>(memory, options, odometry, closure, graph)) {
}
TopologicalMapper::TopologicalMapper(TopologicalMapper&&) noexcept = default;
TopologicalMapper& TopologicalMapper::operator=(TopologicalMapper&&) noexcept = default;
TopologicalMapper::~TopologicalMapper() = default;

bool TopologicalMapper::is_new(const OdometryView& view) const {
  return implementation_->is_new(view);
}
TopologicalMapper::Update TopologicalMapper::add(ViewId view, OdometryView image,
                                                 const std::optional<Pose2>& moved) {
  return implementation_->add(view, std::move(image), moved);
}
void TopologicalMapper::finish() {
  implementation_->finish();
}
std::size_t TopologicalMapper::size() const noexcept {
  return implementation_->size();
}
std::span<const Pose2> TopologicalMapper::poses() const noexcept {
  return implementation_->poses();
}
TopologicalMap TopologicalMapper::map() const {
  return implementation_->map();
}
double TopologicalMapper::scale_m() const {
  return implementation_->scale_m();
}

}  // namespace panonav
