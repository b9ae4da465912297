#include "panonav/localisation/view_likelihood.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr std::size_t most_near = 12;  // a grid's square and the ring around it
constexpr double near_spacings = 2.0;  // beyond the border of the references too, twelve are near

// Mean distance of a place in a square of a grid from the nearest corner.
constexpr double nearest_spacings = 0.3826;

std::uint32_t hash_of(std::int32_t x, std::int32_t y) {
  auto h = static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32U |
           static_cast<std::uint32_t>(y);
  h *= 0x9E3779B97F4A7C15ULL;
  return static_cast<std::uint32_t>(h >> 32U);
}

// exp(-u) for u >= 0.
float decay(float u) {
  constexpr std::size_t steps = 512;
  constexpr float reach = 8.0F;
  static const auto table = [] {
    std::array<float, steps + 1> values{};
    for (std::size_t i = 0; i <= steps; ++i) {
      values[i] = std::exp(-reach * static_cast<float>(i) / steps);
    }
    return values;
  }();
  const float at = u * (steps / reach);
  if (!(at < steps)) return 0.0F;
  const auto i = static_cast<std::size_t>(at);
  return table[i] + (at - static_cast<float>(i)) * (table[i + 1] - table[i]);
}

float wrapped(float angle) {
  constexpr float turn = 2.0F * std::numbers::pi_v<float>;
  return angle - turn * std::nearbyint(angle * (1.0F / turn));
}

}  // namespace

ViewLikelihood::ViewLikelihood(const ColumnRanking& ranking, const ObservationModel& model,
                               bool compass)
    : ranking_(&ranking), model_(model), compass_(compass) {
  const VisualMemory& memory = ranking.memory();
  for (const ViewId view : memory.views()) {
    const auto& pose = memory.info(view).pose;
    if (!pose) continue;
    sites_.push_back({view, static_cast<float>(pose->x_m), static_cast<float>(pose->y_m),
                      std::numeric_limits<float>::quiet_NaN(), 0.0F, 0});
    views_.push_back(view);
    profiles_.push_back(ranking.profiles(view));
  }
  differences_.resize(sites_.size());
  require(!sites_.empty(), "views with a pose", 0.0, ">= 1");
  require(model.spacing_m > 0.0, "spacing of the references", model.spacing_m, "> 0 m");
  require(model.range_m > 0.0, "range of likeness", model.range_m, "> 0 m");
  index_sites();
}

void ViewLikelihood::index_sites() {
  cell_m_ = model_.spacing_m;
  const double reach_m =
      std::max(near_spacings * model_.spacing_m, std::min(model_.range_m, 4 * model_.spacing_m));
  const auto around = static_cast<std::int32_t>(std::ceil(reach_m / cell_m_));
  // (cell, distance from the cell's centre, site)
  std::vector<std::tuple<std::int32_t, std::int32_t, float, std::uint32_t>> entries;
  for (std::uint32_t s = 0; s < sites_.size(); ++s) {
    const auto x = static_cast<std::int32_t>(std::floor(sites_[s].x_m / cell_m_));
    const auto y = static_cast<std::int32_t>(std::floor(sites_[s].y_m / cell_m_));
    for (std::int32_t cx = x - around; cx <= x + around; ++cx) {
      for (std::int32_t cy = y - around; cy <= y + around; ++cy) {
        const double distance_m =
            std::hypot((cx + 0.5) * cell_m_ - sites_[s].x_m, (cy + 0.5) * cell_m_ - sites_[s].y_m);
        if (distance_m > reach_m + 0.5 * cell_m_) continue;
        entries.emplace_back(cx, cy, static_cast<float>(distance_m), s);
      }
    }
  }
  std::ranges::sort(entries);
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < entries.size();) {
    const auto [x, y, d, s] = entries[i];
    Cell cell{x, y, static_cast<std::uint32_t>(near_.size()), 0};
    std::size_t taken = 0;
    for (; i < entries.size() && std::get<0>(entries[i]) == x && std::get<1>(entries[i]) == y;
         ++i) {
      if (taken++ < most_near) near_.push_back(std::get<3>(entries[i]));
    }
    cell.end = static_cast<std::uint32_t>(near_.size());
    cells.push_back(cell);
  }
  table_.assign(std::bit_ceil(2 * cells.size() + 1), Cell{0, 0, 0, 0});
  const auto last = static_cast<std::uint32_t>(table_.size() - 1);
  for (const Cell& cell : cells) {
    std::uint32_t at = hash_of(cell.x, cell.y) & last;
    while (table_[at].end != 0) at = (at + 1) & last;
    table_[at] = cell;
  }
}

const ViewLikelihood::Cell* ViewLikelihood::cell_at(Point2 position) const noexcept {
  const double x = std::floor(position.x_m / cell_m_);
  const double y = std::floor(position.y_m / cell_m_);
  constexpr double limit = 2e9;
  if (!(std::abs(x) < limit && std::abs(y) < limit)) return nullptr;
  const auto cx = static_cast<std::int32_t>(x);
  const auto cy = static_cast<std::int32_t>(y);
  const auto last = static_cast<std::uint32_t>(table_.size() - 1);
  for (std::uint32_t at = hash_of(cx, cy) & last; table_[at].end != 0; at = (at + 1) & last) {
    if (table_[at].x == cx && table_[at].y == cy) return &table_[at];
  }
  return nullptr;
}

void ViewLikelihood::begin(const PackedSignature& view) {
  const SignatureShape shape = ranking_->memory().shape();
  require(view.shape == shape, "rows of the view's signature", view.shape.rows,
          to_text(shape.rows) + " with " + to_text(shape.components) + " components");
  asked_.emplace(view, ranking_->components());
  compared_sites_.clear();
  most_likeness_ = 0.0;
  blur_square_m2_ = 0.0F;
  ++number_;
}

double ViewLikelihood::compare(std::uint32_t site) {
  Site& s = sites_[site];
  if (s.compared_at == number_) return static_cast<double>(differences_[site]);
  const ColumnMatch match = match_columns(*asked_, profiles_[site]);
  const double far = model_.far_difference;
  s.compared_at = number_;
  s.likeness = static_cast<float>(std::max(0.0, far * far - match.difference * match.difference));
  if (static_cast<double>(s.likeness) > most_likeness_) {
    most_likeness_ = static_cast<double>(s.likeness);
    const double apart_m = model_.range_m * std::log(far * far / most_likeness_);
    const double nearest_m = nearest_spacings * model_.spacing_m;
    blur_square_m2_ = static_cast<float>(std::max(0.0, apart_m * apart_m - nearest_m * nearest_m));
  }
  const auto& heading = ranking_->memory().info(s.view).pose->heading_rad;
  s.heading_rad = heading ? static_cast<float>(*heading + match.heading_rad)
                          : std::numeric_limits<float>::quiet_NaN();
  differences_[site] = static_cast<float>(match.difference);
  compared_sites_.push_back(site);
  return match.difference;
}

std::optional<double> ViewLikelihood::least_difference(std::span<const std::uint32_t> sites) const {
  std::optional<double> least;
  for (const std::uint32_t site : sites) {
    if (!compared(site)) continue;
    const auto difference = static_cast<double>(differences_[site]);
    if (!least || difference < *least) least = difference;
  }
  return least;
}

double ViewLikelihood::log_ratio(const Pose2& pose) const noexcept {
  const Cell* const cell = cell_at(pose.position());
  if (cell == nullptr) return 0.0;
  const auto x = static_cast<float>(pose.x_m);
  const auto y = static_cast<float>(pose.y_m);
  const auto heading = static_cast<float>(pose.heading_rad);
  const auto per_metre = static_cast<float>(1.0 / model_.range_m);
  const auto per_square =
      static_cast<float>(0.5 / (model_.heading_width_rad * model_.heading_width_rad));
  float product = 0.0F;
  float square = 0.0F;
  for (std::uint32_t i = cell->begin; i < cell->end; ++i) {
    const Site& s = sites_[near_[i]];
    const float dx = s.x_m - x;
    const float dy = s.y_m - y;
    const float expected = decay(std::sqrt(dx * dx + dy * dy + blur_square_m2_) * per_metre);
    square += expected * expected;
    if (s.compared_at != number_ || !(s.likeness > 0.0F)) continue;
    float likeness = s.likeness;
    if (compass_ && !std::isnan(s.heading_rad)) {
      const float turn = wrapped(heading - s.heading_rad);
      likeness *= decay(turn * turn * per_square);
    }
    product += likeness * expected;
  }
  return square > 0.0F ? model_.sharpness * static_cast<double>(product * product / square) : 0.0;
}

std::span<const std::uint32_t> ViewLikelihood::sites_near(Point2 position) const noexcept {
  const Cell* const cell = cell_at(position);
  if (cell == nullptr) return {};
  return std::span(near_).subspan(cell->begin, cell->end - cell->begin);
}

std::optional<std::uint32_t> ViewLikelihood::site_of(ViewId view) const noexcept {
  const auto at = std::ranges::lower_bound(views_, view);
  if (at == views_.end() || *at != view) return std::nullopt;
  return static_cast<std::uint32_t>(at - views_.begin());
}

}  // namespace panonav
