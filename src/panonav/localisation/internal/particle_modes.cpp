#include "panonav/localisation/internal/particle_modes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/internal/cell_table.hpp"

namespace panonav {

namespace {

struct Bin {
  GridCell grid_cell;
  std::int32_t heading;
  double weight;
  int mode;
};

/// Weighted sums over the particles of a mode, relative to the first one, so that precision is not
/// lost far from the origin.
struct Moments {
  Pose2 anchor;
  bool anchored = false;
  double weight = 0.0;
  std::array<double, 3> first{};
  std::array<double, 6> second{};  // xx xy xh yy yh hh

  void add(const Pose2& pose, double w) {
    if (!anchored) {
      anchor = pose;
      anchored = true;
    }
    const double x = pose.x_m - anchor.x_m;
    const double y = pose.y_m - anchor.y_m;
    const double h = wrap_angle(pose.heading_rad - anchor.heading_rad);
    weight += w;
    first[0] += w * x;
    first[1] += w * y;
    first[2] += w * h;
    second[0] += w * x * x;
    second[1] += w * x * y;
    second[2] += w * x * h;
    second[3] += w * y * y;
    second[4] += w * y * h;
    second[5] += w * h * h;
  }

  [[nodiscard]] PoseMode mode() const {
    PoseMode mode;
    mode.weight = weight;
    if (!(weight > 0.0)) return mode;
    const double x = first[0] / weight;
    const double y = first[1] / weight;
    const double h = first[2] / weight;
    mode.mean = {anchor.x_m + x, anchor.y_m + y, wrap_angle(anchor.heading_rad + h)};
    const double xx = std::max(0.0, second[0] / weight - x * x);
    const double xy = second[1] / weight - x * y;
    const double xh = second[2] / weight - x * h;
    const double yy = std::max(0.0, second[3] / weight - y * y);
    const double yh = second[4] / weight - y * h;
    const double hh = std::max(0.0, second[5] / weight - h * h);
    mode.covariance = {xx, xy, xh, xy, yy, yh, xh, yh, hh};
    mode.spread_m = std::sqrt(xx + yy);
    mode.heading_spread_rad = std::sqrt(hh);
    return mode;
  }
};

/// Bins by cell and sector of headings.
class BinTable {
 public:
  explicit BinTable(int headings) : headings_(static_cast<std::size_t>(headings)) {}

  [[nodiscard]] std::span<Bin> bins() { return bins_; }
  [[nodiscard]] std::optional<std::uint32_t> find(GridCell grid_cell, std::int32_t heading) const {
    const auto cell = cells_.find(grid_cell);
    if (!cell) return std::nullopt;
    const std::uint32_t bin = bin_of_[*cell * headings_ + static_cast<std::size_t>(heading)];
    return bin == none ? std::nullopt : std::optional(bin);
  }
  std::uint32_t find_or_add(GridCell grid_cell, std::int32_t heading) {
    // Successive particles are usually in the same cell, so the last cell is tried first.
    if (cells_.size() == 0 || cells_[last_] != grid_cell) {
      last_ = cells_.find_or_add(grid_cell);
      bin_of_.resize(cells_.size() * headings_, none);
    }
    std::uint32_t& bin = bin_of_[last_ * headings_ + static_cast<std::size_t>(heading)];
    if (bin == none) {
      bin = static_cast<std::uint32_t>(bins_.size());
      bins_.push_back({grid_cell, heading, 0.0, -1});
    }
    return bin;
  }

 private:
  static constexpr std::uint32_t none = 0xFFFFFFFF;

  std::size_t headings_;
  CellTable cells_;
  std::vector<std::uint32_t> bin_of_;  ///< each heading of each cell
  std::vector<Bin> bins_;
  std::uint32_t last_ = 0;
};

// Returns the index of a bin; positions beyond any map and NaN get an outermost one.
std::int32_t bin_index(double cells) {
  return cell_index(cells, 1e9);
}

/// Adds the particles' weights to their bins. Returns the bin of each particle and sets `sum` to
/// the total weight.
std::vector<std::uint32_t> fill_bins(const Particles& particles, const PoseBins& bins,
                                     BinTable& table, double& sum) {
  std::vector<std::uint32_t> bin_of(particles.size());
  const double cells_per_metre = 1.0 / bins.cell_m;
  const double sectors_per_radian = bins.headings / (2.0 * std::numbers::pi);
  sum = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const GridCell grid_cell{bin_index(particles.x_m[i] * cells_per_metre),
                             bin_index(particles.y_m[i] * cells_per_metre)};
    const auto sector =
        bin_index((particles.heading_rad[i] + std::numbers::pi) * sectors_per_radian);
    const std::int32_t heading = std::clamp(sector, 0, bins.headings - 1);
    bin_of[i] = table.find_or_add(grid_cell, heading);
    table.bins()[bin_of[i]].weight += particles.weight[i];
    sum += particles.weight[i];
  }
  return bin_of;
}

/// Assigns the bins around `seed` that do not yet belong to a mode to `mode`; returns their weight.
double assign_nearby_bins(BinTable& table, const PoseBins& bins, std::uint32_t seed, int mode) {
  const std::span<Bin> cells = table.bins();
  double weight = 0.0;
  const std::int32_t heading_reach = bins.headings > 2 * mode_reach ? mode_reach : 0;
  for (std::int32_t dx = -mode_reach; dx <= mode_reach; ++dx) {
    for (std::int32_t dy = -mode_reach; dy <= mode_reach; ++dy) {
      for (std::int32_t dh = -heading_reach; dh <= heading_reach; ++dh) {
        const std::int32_t heading = (cells[seed].heading + dh + bins.headings) % bins.headings;
        const GridCell grid_cell{cells[seed].grid_cell.x + dx, cells[seed].grid_cell.y + dy};
        const auto found = table.find(grid_cell, heading);
        if (!found || cells[*found].mode >= 0) continue;
        cells[*found].mode = mode;
        weight += cells[*found].weight;
      }
    }
  }
  return weight;
}

/// Gathers modes around the bins in descending order of weight, until no further mode can have the
/// weight `min_weight`. Returns the modes' weights.
std::vector<double> assign_bins_to_modes(BinTable& table, const PoseBins& bins, double min_weight) {
  const std::span<Bin> cells = table.bins();
  std::vector<std::uint32_t> order(cells.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    if (cells[a].weight != cells[b].weight) return cells[a].weight > cells[b].weight;
    return a < b;
  });
  std::vector<double> weights;
  for (const std::uint32_t seed : order) {
    if (cells[seed].mode >= 0) continue;
    // An upper bound of the weight of all later modes: each of their bins weighs at most as much as
    // this one.
    constexpr double max_bins = (2 * mode_reach + 1) * (2 * mode_reach + 1) * (2 * mode_reach + 1);
    if (cells[seed].weight * max_bins < min_weight) break;
    weights.push_back(assign_nearby_bins(table, bins, seed, static_cast<int>(weights.size())));
  }
  return weights;
}

/// Renumbers the modes in descending order of weight and drops those below `min_weight`. Returns
/// the number of modes left.
std::size_t renumber_by_weight(std::span<Bin> cells, const std::vector<double>& weights,
                               double min_weight) {
  std::vector<int> by_weight;
  for (std::size_t m = 0; m < weights.size(); ++m) {
    if (weights[m] >= min_weight) by_weight.push_back(static_cast<int>(m));
  }
  std::ranges::stable_sort(by_weight, std::greater{},
                           [&](int m) { return weights[static_cast<std::size_t>(m)]; });
  std::vector<int> ranks(weights.size(), -1);
  for (std::size_t r = 0; r < by_weight.size(); ++r) {
    ranks[static_cast<std::size_t>(by_weight[r])] = static_cast<int>(r);
  }
  for (Bin& bin : cells) {
    if (bin.mode >= 0) bin.mode = ranks[static_cast<std::size_t>(bin.mode)];
  }
  return by_weight.size();
}

}  // namespace

ParticleModes find_modes(const Particles& particles, const PoseBins& bins, double min_weight) {
  require(bins.cell_m > 0.0, "side of a bin", bins.cell_m, "> 0 m");
  require(bins.headings >= 1, "sectors of the circle", bins.headings, ">= 1");
  ParticleModes result;
  result.mode_of.assign(particles.size(), -1);
  BinTable table(bins.headings);
  double sum = 0.0;
  const std::vector<std::uint32_t> bin_of = fill_bins(particles, bins, table, sum);
  if (!(sum > 0.0)) return result;
  const std::span<Bin> cells = table.bins();
  const double share = sum / static_cast<double>(particles.size());
  for (const Bin& bin : cells) result.occupied_bins += bin.weight >= 0.5 * share ? 1 : 0;
  const std::vector<double> weights = assign_bins_to_modes(table, bins, min_weight * sum);
  std::vector<Moments> moments(renumber_by_weight(cells, weights, min_weight * sum));
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const int mode = cells[bin_of[i]].mode;
    result.mode_of[i] = mode;
    if (mode < 0) continue;
    moments[static_cast<std::size_t>(mode)].add(particles.pose(i), particles.weight[i]);
  }
  for (const Moments& m : moments) {
    result.modes.push_back(m.mode());
    result.modes.back().weight = std::min(1.0, result.modes.back().weight / sum);  // rounding
  }
  return result;
}

}  // namespace panonav
