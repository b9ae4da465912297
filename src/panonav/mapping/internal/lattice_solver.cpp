#include "panonav/mapping/internal/lattice_solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav {

namespace {

/// Final width of the robust losses in standard deviations; springs beyond it are rejected. Normal
/// errors exceed it once in 370 times.
constexpr double final_width = 3.0;
/// Largest number of steps at each width.
constexpr int max_steps_per_width = 20;
// Smallest relative decrease of the energy after which another step is made: below it positions
// move by less than 1e-4 of a spring. Before the last width a larger value suffices, as the steps
// at the next width continue.
constexpr double min_final_decrease = 1e-7;
constexpr double min_decrease_while_narrowing = 1e-3;

/// Derivatives by x, y, heading of a and of b.
using Row = std::array<double, 6>;

/// The measurements of a spring, in groups that are right or wrong together.
enum Group : std::size_t { phases, length, length_by_phases, groups };
/// Expected median of the squared strain of each group if the deviations are right (chi-squared
/// with two degrees of freedom, and with one).
constexpr std::array<double, groups> median_square{1.386, 0.455, 0.455};

/// The strain of one spring in deviations, and its derivatives.
struct Strain {
  struct Entry {
    Group group;
    double value;
    Row slope;
  };
  std::size_t rows = 0;
  std::array<Entry, 4> entries{};

  void add(Group group, double strain, Row slope, double deviation) {
    for (double& d : slope) d /= deviation;
    entries[rows++] = {group, strain / deviation, slope};
  }
  [[nodiscard]] std::span<const Entry> used() const { return std::span(entries).first(rows); }
  /// Returns the squared strain of each group; nullopt where the spring has none.
  [[nodiscard]] std::array<std::optional<double>, groups> sum_squares_by_group() const {
    std::array<std::optional<double>, groups> sums;
    for (const Entry& entry : used()) {
      sums[entry.group] = sums[entry.group].value_or(0.0) + entry.value * entry.value;
    }
    return sums;
  }
};

Strain compute_strain(const SpringTerm& spring, const Pose2& a, const Pose2& b) {
  Strain strain;
  const double dx = b.x_m - a.x_m;
  const double dy = b.y_m - a.y_m;
  if (spring.length == 0.0) {
    strain.add(length, dx, {-1.0, 0.0, 0.0, 1.0, 0.0, 0.0}, spring.length_deviation);
    strain.add(length, dy, {0.0, -1.0, 0.0, 0.0, 1.0, 0.0}, spring.length_deviation);
  } else {
    const double distance = std::hypot(dx, dy);
    // If the nodes coincide, any direction is right.
    const double ux = distance > 0.0 ? dx / distance : 1.0;
    const double uy = distance > 0.0 ? dy / distance : 0.0;
    const Row slope{-ux, -uy, 0.0, ux, uy, 0.0};
    strain.add(length, distance - spring.length, slope, spring.length_deviation);
    if (spring.along_direction) {
      strain.add(length_by_phases, distance - spring.along_direction->length, slope,
                 spring.along_direction->deviation);
    }
    if (spring.direction && distance > 0.0) {
      const SpringDirection& known = *spring.direction;
      double world_rad = a.heading_rad + known.from_a_rad;
      double share_a = 1.0;
      if (known.from_b_rad) {
        const double back_rad = b.heading_rad + *known.from_b_rad + std::numbers::pi;
        world_rad += 0.5 * wrap_angle(back_rad - world_rad);
        share_a = 0.5;
      }
      // The slope is computed at a minimum distance; otherwise nodes that nearly coincide would
      // rotate about each other endlessly.
      const double lever = std::max(distance, 0.1 * spring.length);
      strain.add(phases, wrap_angle(std::atan2(dy, dx) - world_rad),
                 {uy / lever, -ux / lever, -share_a, -uy / lever, ux / lever, share_a - 1.0},
                 known.deviation_rad);
    }
  }
  if (spring.turn) {
    const double error = angle_difference(b.heading_rad - a.heading_rad, spring.turn->turn_rad);
    strain.add(phases, error, {0.0, 0.0, -1.0, 0.0, 0.0, 1.0}, spring.turn->deviation_rad);
  }
  return strain;
}

void check(std::span<const SpringTerm> springs, std::span<const Pose2> poses,
           std::span<const unsigned char> moving) {
  require(moving.empty() || moving.size() == poses.size(), "size of moving",
          static_cast<double>(moving.size()), "0 or the number of poses");
  for (const Pose2& pose : poses) {
    const double sum = pose.x_m + pose.y_m + pose.heading_rad;
    require(std::isfinite(sum), "pose of a node", sum, "finite");
  }
  const auto require_positive = [](double value, const char* name) {
    require(std::isfinite(value) && value > 0.0, name, value, "finite and > 0");
  };
  for (const SpringTerm& spring : springs) {
    require(spring.a < poses.size() && spring.b < poses.size() && spring.a != spring.b,
            "node of a spring", static_cast<double>(spring.b), "another node");
    require(std::isfinite(spring.length) && spring.length >= 0.0, "length of a spring",
            spring.length, "finite and >= 0");
    require_positive(spring.length_deviation, "deviation of a length");
    if (spring.direction) {
      const double sum = spring.direction->from_a_rad + spring.direction->from_b_rad.value_or(0.0);
      require(std::isfinite(sum), "direction of a spring", sum, "finite");
      require_positive(spring.direction->deviation_rad, "deviation of a direction");
    }
    if (spring.along_direction) {
      require(
          std::isfinite(spring.along_direction->length) && spring.along_direction->length >= 0.0,
          "length along a direction", spring.along_direction->length, "finite and >= 0");
      require_positive(spring.along_direction->deviation,
                       "deviation of a length along a direction");
    }
    if (spring.turn) {
      require(std::isfinite(spring.turn->turn_rad), "turn of a spring", spring.turn->turn_rad,
              "finite");
      require_positive(spring.turn->deviation_rad, "deviation of a turn");
    }
  }
}

/// The energy of the springs as a problem for `minimise`: poses, robust weights and their widths.
class SpringEnergy {
 public:
  SpringEnergy(std::span<const SpringTerm> springs, std::span<Pose2> poses,
               std::span<const unsigned char> moving, const std::function<void()>& on_step)
      : on_step_(on_step), springs_(springs), poses_(poses), unknown_(poses.size(), -1) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (moving.empty() || moving[i] != 0) {
        unknown_[i] = unknowns_;
        unknowns_ += 3;
      }
    }
    length_weights_.resize(springs.size());
  }

  [[nodiscard]] bool has_unknowns() const { return unknowns_ > 0 && !springs_.empty(); }

  /// Widens the losses until every spring is within half of their width.
  void widen_losses() {
    widths_.fill(final_width);
    for (const SpringTerm& spring : springs_) {
      if (spring.is_certain) continue;
      const auto sum_squares_by_group = squared_strains(spring);
      for (std::size_t g = 0; g < groups; ++g) {
        widths_[g] = std::max(widths_[g], 2.0 * std::sqrt(sum_squares_by_group[g].value_or(0.0)));
      }
    }
  }

  /// Halves the widths, down to three deviations, or to more if the median strain shows that the
  /// deviations are too small. Returns false if no width has changed.
  bool narrow_losses() {
    std::array<std::vector<double>, groups> sum_squares_by_group;
    for (const SpringTerm& spring : springs_) {
      if (spring.is_certain) continue;
      const auto all = squared_strains(spring);
      for (std::size_t g = 0; g < groups; ++g) {
        if (all[g]) sum_squares_by_group[g].push_back(*all[g]);
      }
    }
    bool narrowed = false;
    for (std::size_t g = 0; g < groups; ++g) {
      double min_width = final_width;
      if (!sum_squares_by_group[g].empty()) {
        const double middle = upper_median_in_place(std::span(sum_squares_by_group[g]));
        min_width *= std::max(1.0, std::sqrt(middle / median_square[g]));
      }
      if (widths_[g] <= min_width) continue;
      widths_[g] = std::max(min_width, 0.5 * widths_[g]);
      narrowed = true;
    }
    return narrowed;
  }

  /// Returns the final weight of each spring, by its phases where it has them.
  [[nodiscard]] std::vector<double> weights() const {
    std::vector<double> result(springs_.size(), 1.0);
    for (std::size_t s = 0; s < springs_.size(); ++s) {
      const auto sum_squares_by_group = squared_strains(springs_[s]);
      const Group group = sum_squares_by_group[phases] ? phases : length;
      result[s] = weight(s, group, sum_squares_by_group[group].value_or(0.0));
    }
    return result;
  }

  bool linearise(SparseEquations& equations) {
    start_.assign(poses_.begin(), poses_.end());
    update_length_weights();
    equations.reset(unknowns_);
    // Every diagonal entry exists, also of nodes without springs.
    for (int i = 0; i < unknowns_; ++i) equations.add(i, i, 0.0);
    for (std::size_t s = 0; s < springs_.size(); ++s) add_spring(s, equations);
    equations.assemble();
    return true;
  }

  /// Returns the loss from which the weights derive.
  [[nodiscard]] double cost() const {
    double sum = 0.0;
    for (std::size_t s = 0; s < springs_.size(); ++s) {
      const auto sum_squares_by_group = squared_strains(springs_[s]);
      for (const Group group : {phases, length, length_by_phases}) {
        if (!sum_squares_by_group[group]) continue;
        const double width = widths_[group] * widths_[group];
        const double share = *sum_squares_by_group[group] / width;
        if (springs_[s].is_certain) {
          sum += *sum_squares_by_group[group];
        } else if (group == phases || !length_weights_[s]) {
          sum += *sum_squares_by_group[group] / (1.0 + share);
        } else {
          sum += *length_weights_[s] * 2.0 * width * (std::sqrt(1.0 + share) - 1.0);
        }
      }
    }
    return sum;
  }

  void move(const Eigen::VectorXd& change) {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const int base = unknown_[i];
      if (base < 0) continue;
      poses_[i].x_m += change(base);
      poses_[i].y_m += change(base + 1);
      poses_[i].heading_rad = wrap_angle(poses_[i].heading_rad + change(base + 2));
    }
  }
  void undo() { std::ranges::copy(start_, poses_.begin()); }
  void accept() {
    if (on_step_) on_step_();
  }

 private:
  [[nodiscard]] std::array<std::optional<double>, groups> squared_strains(
      const SpringTerm& spring) const {
    return compute_strain(spring, poses_[spring.a], poses_[spring.b]).sum_squares_by_group();
  }

  /// Returns the weight of a group of a spring's strains. If a spring has phases, their weight also
  /// limits that of its lengths, which are never rejected alone: otherwise a node could drift away
  /// along a direction.
  [[nodiscard]] double weight(std::size_t s, Group group, double square) const {
    if (springs_[s].is_certain) return 1.0;
    const double share = square / (widths_[group] * widths_[group]);
    if (group == phases || !length_weights_[s]) return geman_mcclure_weight(share);
    return *length_weights_[s] / std::sqrt(1.0 + share);
  }
  /// Updates the weights of the phases, which multiply the weights of lengths of the same spring.
  void update_length_weights() {
    for (std::size_t s = 0; s < springs_.size(); ++s) {
      const auto square = squared_strains(springs_[s])[phases];
      length_weights_[s] = square ? std::optional(weight(s, phases, *square)) : std::nullopt;
    }
  }

  void add_spring(std::size_t s, SparseEquations& equations) const {
    const SpringTerm& spring = springs_[s];
    const int first = unknown_[spring.a];
    const int second = unknown_[spring.b];
    if (first < 0 && second < 0) return;
    const Strain strain = compute_strain(spring, poses_[spring.a], poses_[spring.b]);
    const auto sum_squares_by_group = strain.sum_squares_by_group();
    const auto column = [&](int i) {
      const int base = i < 3 ? first : second;
      return base < 0 ? -1 : base + i % 3;
    };
    for (const auto& entry : strain.used()) {
      const double w = weight(s, entry.group, *sum_squares_by_group[entry.group]);
      for (int i = 0; i < 6; ++i) {
        const double si = entry.slope[static_cast<std::size_t>(i)];
        const int ci = column(i);
        if (ci < 0 || si == 0.0) continue;
        equations.right(ci) -= w * si * entry.value;
        for (int j = 0; j < 6; ++j) {
          const double sj = entry.slope[static_cast<std::size_t>(j)];
          const int cj = column(j);
          if (cj >= 0 && cj <= ci && sj != 0.0) equations.add(ci, cj, w * si * sj);
        }
      }
    }
  }

  const std::function<void()>& on_step_;
  std::span<const SpringTerm> springs_;
  std::span<Pose2> poses_;
  std::vector<Pose2> start_;  // before the present step
  std::vector<int> unknown_;  // index of the first unknown of each pose; -1: fixed
  int unknowns_ = 0;
  std::vector<std::optional<double>> length_weights_;  // of springs with phases
  std::array<double, groups> widths_{final_width, final_width, final_width};
};

}  // namespace

LatticeSolution solve_lattice(std::span<const SpringTerm> springs, std::span<Pose2> poses,
                              std::span<const unsigned char> moving,
                              const std::function<void()>& on_step) {
  check(springs, poses, moving);
  SpringEnergy energy(springs, poses, moving, on_step);
  LatticeSolution solution;
  SparseEquations equations;
  const auto relax = [&](double min_relative_decrease) {
    solution.iterations += minimise(energy, equations,
                                    {.max_steps = max_steps_per_width,
                                     .damping = 1e-6,  // small: springs determine most nodes well
                                     .min_relative_decrease = min_relative_decrease})
                               .steps;
  };
  if (energy.has_unknowns()) {
    energy.widen_losses();
    while (energy.narrow_losses()) relax(min_decrease_while_narrowing);
    relax(min_final_decrease);
  }
  solution.energy = energy.cost();
  solution.weights = energy.weights();
  return solution;
}

}  // namespace panonav
