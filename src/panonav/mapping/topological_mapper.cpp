#include "panonav/mapping/topological_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/loop_closure_finder.hpp"
#include "panonav/mapping/internal/path_variance.hpp"
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
/// Number of latest steps from which the scale of the views is learnt; it changes from room to
/// room. 10 to 40 give the same result (docs/decisions.md).
constexpr std::size_t max_kept_steps = 15;
/// Factors of the variances of steps before closures have shown their errors: of wheels with twice
/// the usual errors, and of images, whose errors are alike over some 64 steps, as those of the
/// scale in one room. With 16, a drive of 125 m whose headings drifted by 60 degrees closed few
/// loops.
constexpr double first_wheel_factor = 4.0;
constexpr double first_view_factor = 64.0;
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
          "take the steps from the odometry instead of the images; its rotations are "
          "corrected with the images as far as loop closures show it to be worse"),
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
    const OdometryView* last = odometry_.last();
    if (last == nullptr || options_.capture_difference == 0.0) return true;
    return image_difference(last->coefficients, view.coefficients) > options_.capture_difference;
  }

  TopologicalMapper::Update add(ViewId view, OdometryView image, const std::optional<Pose2>& moved,
                                std::size_t moved_nodes) {
    if (!memory_->contains(view) || (!nodes_.empty() && view <= nodes_.back().view)) {
      throw ContractError("view", static_cast<double>(view.value),
                          "a view of the memory, later than those of the map");
    }
    if (moved) {
      require(is_finite(*moved), "step of the wheels", length(*moved), "finite");
      require(moved_nodes >= 1 && (nodes_.empty() || moved_nodes <= nodes_.size()),
              "nodes since the wheels were known", static_cast<double>(moved_nodes),
              "1 .. number of nodes");
    }
    TopologicalMapper::Update update;
    update.step = odometry_.add(std::move(image));
    nodes_.push_back({view});
    if (nodes_.size() == 1) {
      poses_.emplace_back();
      update.new_component = true;
    } else {
      const bool is_same_step =
          moved && update.step && static_cast<std::size_t>(update.step->views) == moved_nodes;
      if (is_same_step && options_.wheels) {
        if (known_lengths_.size() == max_kept_steps) known_lengths_.erase(known_lengths_.begin());
        known_lengths_.push_back({update.step->length_in_views, length(*moved)});
      }
      add_step(update.step, moved, moved_nodes, update);
    }
    if (options_.close_loops) close_loops(update);
    return update;
  }

  void begin_path() {
    close_last_loops();
    odometry_.begin_path();
  }

  void finish() {
    close_last_loops();
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

  [[nodiscard]] bool is_metric() const { return has_wheel_steps_ || odometry_.is_metric(); }

  [[nodiscard]] std::size_t size() const noexcept { return poses_.size(); }
  [[nodiscard]] std::span<const Pose2> poses() const noexcept { return poses_; }

 private:
  void add_step(const std::optional<VisualStep>& step, const std::optional<Pose2>& moved,
                std::size_t moved_nodes, TopologicalMapper::Update& update) {
    const std::size_t here = nodes_.size() - 1;
    if (!step && !moved && options_.bridge_m > 0.0) {
      constexpr double any_heading_rad = 1.0;
      edges_.push_back(
          {here - 1, here, {options_.bridge_m, 0.0, 0.0}, options_.bridge_m, any_heading_rad});
      weights_.push_back(1.0);
      turns_.emplace_back();
      poses_.push_back(poses_.back() * edges_.back().a_from_b);
      nodes_[here].component = nodes_[here - 1].component;
      nodes_[here].path_m = nodes_[here - 1].path_m + options_.bridge_m;
      return;
    }
    if (!step && !moved) {
      // The path length continues, so that the views before and after the break are no candidates
      // for loop closures with each other.
      update.new_component = true;
      nodes_[here].component = next_component_++;
      poses_.emplace_back();
      nodes_[here].path_m = nodes_[here - 1].path_m;
      return;
    }
    const bool wheels = moved && (options_.wheels || !step);
    const std::size_t before =
        here - (wheels ? moved_nodes : static_cast<std::size_t>(step->views));
    if (wheels) {
      has_wheel_steps_ = true;
      const StepSampler error(*moved, OdometryNoise{});
      edges_.push_back({before, here, *moved,
                        error.translation_deviation_m() + min_position_deviation_m,
                        error.rotation_deviation_rad() + min_heading_deviation_rad});
    } else {
      Pose2 motion = step->before_from_after;
      if (!known_lengths_.empty() && length(motion) > 0.0) {
        // The wheels know the scale of steps that they miss.
        const double factor = scale_m() * step->length_in_views / length(motion);
        motion.x_m *= factor;
        motion.y_m *= factor;
      }
      edges_.push_back({before, here, motion,
                        options_.step_deviation * length(motion) + min_position_deviation_m,
                        options_.turn_deviation * length(motion) + min_heading_deviation_rad});
    }
    const Pose2& motion = edges_.back().a_from_b;
    weights_.push_back(1.0);
    const bool is_read_twice =
        wheels && step && static_cast<std::size_t>(step->views) == moved_nodes;
    turns_.push_back({motion.heading_rad, is_read_twice
                                              ? std::optional(step->before_from_after.heading_rad)
                                              : std::nullopt});
    poses_.push_back(poses_[before] * motion);
    nodes_[here].component = nodes_[before].component;
    nodes_[here].path_m = nodes_[here - 1].path_m + length(motion);
  }

  void close_loops(TopologicalMapper::Update& update) {
    const double scale_m = this->scale_m();
    std::optional<PathVariances> variances;
    const auto is_possible = [&](const LoopClosure& closure) {
      if (nodes_[closure.earlier].component != nodes_[closure.later].component) return true;
      if (!variances) variances.emplace(edges_, weights_, poses_, size() - 1, step_factor());
      return agrees_with_path(make_closure_edge(closure, scale_m),
                              variances->in_frame_of(closure.earlier));
    };
    update.closures = finder_.find(nodes_, poses_, *odometry_.last(), scale_m, is_possible);
    if (update.closures.empty()) return;
    add_closures(update.closures, scale_m);
    if (needs_optimisation_ &&
        size() >=
            optimised_size_ + std::max<std::size_t>(1, optimised_size_ / min_growth_divisor)) {
      optimise();
      update.optimised = true;
    }
  }

  /// Closes the loops of the last nodes of a path, which no later node can make certain.
  void close_last_loops() {
    if (!options_.close_loops) return;
    const auto closures = finder_.finish(nodes_, poses_);
    if (!closures.empty()) add_closures(closures, scale_m());
  }

  void add_closures(std::span<const LoopClosure> closures, double scale_m) {
    for (const LoopClosure& closure : closures) {
      join_components(closure);
      edges_.push_back(make_closure_edge(closure, scale_m));
      weights_.push_back(1.0);
    }
    changed_ = true;
    optimise_latest();
    for (std::size_t i = edges_.size() - closures.size(); i < edges_.size(); ++i) {
      if (normalised_residual(edges_[i], poses_) > max_closure_deviations)
        needs_optimisation_ = true;
    }
  }

  /// Sets the rotations of the wheels' steps to the mean of those by wheels and by views, weighted
  /// by variances: that of the wheels as closures have shown it, that of the views from the latest
  /// steps. Rotations by views are biased while one side of the scene is nearer, which only the
  /// wheels reveal.
  void fuse_turns() {
    if (!learnt_factor_) return;
    struct Difference {
      double rad, wheel_variance, view_variance;
    };
    std::deque<Difference> latest;
    for_each_step([&](PoseEdge& edge, const TurnReading& turn) {
      if (!turn.views_rad) return;
      const double view_deviation_rad =
          options_.turn_deviation * length(edge.a_from_b) + min_heading_deviation_rad;
      latest.push_back({angle_difference(turn.steps_rad, *turn.views_rad),
                        *learnt_factor_ * squared(edge.heading_deviation_rad),
                        squared(view_deviation_rad)});
      if (latest.size() > max_kept_steps) latest.pop_front();
      Difference sum{};
      for (const Difference& each : latest) {
        sum.rad += each.rad;
        sum.wheel_variance += each.wheel_variance;
        sum.view_variance += each.view_variance;
      }
      const double view_variance =
          std::max(sum.view_variance, squared(sum.rad) - sum.wheel_variance);
      const double wheel_share = view_variance / (view_variance + sum.wheel_variance);
      edge.a_from_b.heading_rad = wrap_angle(*turn.views_rad + wheel_share * latest.back().rad);
    });
  }

  /// Calls a function with each edge that is a step, and its turn as read.
  template <class Function>
  void for_each_step(const Function& function) {
    std::size_t number = 0;
    for (PoseEdge& edge : edges_) {
      if (!edge.doubtful) function(edge, turns_[number++]);
    }
  }

  static PoseEdge make_closure_edge(const LoopClosure& closure, double scale_m) {
    return {
        closure.earlier,
        closure.later,
        closure.earlier_from_later,
        closure_deviation_per_residual * closure.residual * scale_m + closure_position_deviation_m,
        closure_heading_deviation_rad_per_m * length(closure.earlier_from_later) +
            closure_heading_deviation_rad,
        true};
  }

  /// True if the error of a closure is one that the path between its nodes may have.
  [[nodiscard]] bool agrees_with_path(const PoseEdge& closure, const PathVariance& path) const {
    const Pose2 reached = inverse(poses_[closure.a]) * poses_[closure.b];
    const double off_m = distance(reached.position(), closure.a_from_b.position());
    const double off_rad = angle_difference(reached.heading_rad, closure.a_from_b.heading_rad);
    constexpr double max_square = max_closure_deviations * max_closure_deviations;
    return squared(off_m) <
               max_square * (path.position_m2 + squared(closure.position_deviation_m)) &&
           squared(off_rad) <
               max_square * (path.heading_rad2 + squared(closure.heading_deviation_rad));
  }

  /// Factor of the variances of steps, as the closures so far have shown them.
  [[nodiscard]] double step_factor() const {
    return learnt_factor_.value_or(has_wheel_steps_ ? first_wheel_factor : first_view_factor);
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
      PoseEdge edge = with_learnt_deviations(edges_[i]);
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

  /// Returns the edge with the deviations of steps that closures have shown.
  [[nodiscard]] PoseEdge with_learnt_deviations(PoseEdge edge) const {
    if (edge.doubtful) return edge;
    const double factor = std::sqrt(step_factor());
    edge.position_deviation_m *= factor;
    edge.heading_deviation_rad *= factor;
    return edge;
  }

  void optimise() {
    // Turns that the views have corrected would hide the errors of the wheels.
    for_each_step([](PoseEdge& edge, const TurnReading& turn) {
      edge.a_from_b.heading_rad = turn.steps_rad;
    });
    if (const auto factor = learn_step_factor(edges_, size())) learnt_factor_ = factor;
    fuse_turns();
    std::vector<PoseEdge> edges;
    for (const PoseEdge& edge : edges_) edges.push_back(with_learnt_deviations(edge));
    weights_ = optimise_pose_graph(poses_, edges, graph_).edge_weights;
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
  bool has_wheel_steps_ = false;  // a step came from the wheels
  struct TurnReading {
    double steps_rad = 0.0;           // by the wheels, or by the views without wheels
    std::optional<double> views_rad;  // by the views, where the wheels give the step
  };
  std::vector<TurnReading> turns_;       // of the edges that are not doubtful
  std::optional<double> learnt_factor_;  // of the variances of steps
  std::size_t next_component_ = 1;       // number that no component had yet
  std::size_t optimised_size_ = 0;       // nodes when the map was last optimised
  std::size_t last_closure_node_ = 0;    // the latest node of the closures so far
  bool changed_ = false;                 // closures were added since then
  bool needs_optimisation_ = false;      // a closure contradicts the older map, too
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
                                                 const std::optional<Pose2>& moved,
                                                 std::size_t moved_nodes) {
  return implementation_->add(view, std::move(image), moved, moved_nodes);
}
void TopologicalMapper::begin_path() {
  implementation_->begin_path();
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
bool TopologicalMapper::is_metric() const {
  return implementation_->is_metric();
}
double TopologicalMapper::scale_m() const {
  return implementation_->scale_m();
}

}  // namespace panonav
