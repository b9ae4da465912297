#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace panonav {

/// A cell of a square grid; cells are ordered by x, then by y.
struct GridCell {
  std::int32_t x = 0;
  std::int32_t y = 0;
  friend auto operator<=>(const GridCell&, const GridCell&) = default;
};

/// Returns floor(`cells`), limited to -limit .. limit. Positions beyond any map and NaN get an
/// outermost cell.
[[nodiscard]] inline std::int32_t cell_index(double cells, double limit) noexcept {
  const double far = cells < limit ? (cells > -limit ? cells : -limit) : limit;
  const auto towards_zero = static_cast<std::int32_t>(far);  // faster than floor
  return towards_zero - (static_cast<double>(towards_zero) > far ? 1 : 0);
}

/// Hash table of the occupied cells of a grid, numbered from 0 in the order in which they were
/// added. Uses open addressing for speed, as it is searched for each particle.
class CellTable {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return cells_.size(); }
  [[nodiscard]] GridCell operator[](std::uint32_t number) const { return cells_[number]; }
  [[nodiscard]] std::optional<std::uint32_t> find(GridCell cell) const noexcept {
    const std::uint32_t number = slots_[slot_of(cell)];
    return number == none ? std::nullopt : std::optional(number);
  }
  /// Returns the number of the cell; adds the cell if it is missing.
  std::uint32_t find_or_add(GridCell cell) {
    const std::size_t slot = slot_of(cell);
    if (slots_[slot] != none) return slots_[slot];
    const auto added = static_cast<std::uint32_t>(cells_.size());
    slots_[slot] = added;
    cells_.push_back(cell);
    if (2 * cells_.size() > slots_.size()) {
      slots_.assign(2 * slots_.size(), none);
      for (std::uint32_t c = 0; c < cells_.size(); ++c) slots_[slot_of(cells_[c])] = c;
    }
    return added;
  }

 private:
  static constexpr std::uint32_t none = 0xFFFFFFFF;

  /// Returns the slot of the cell, or the free slot where it would be inserted.
  [[nodiscard]] std::size_t slot_of(GridCell cell) const noexcept {
    std::uint64_t hash = static_cast<std::uint32_t>(cell.x) * 0x9E3779B97F4A7C15ULL;
    hash = (hash ^ static_cast<std::uint32_t>(cell.y)) * 0xBF58476D1CE4E5B9ULL;
    std::size_t slot = (hash >> 32U) & (slots_.size() - 1);
    while (slots_[slot] != none && cells_[slots_[slot]] != cell) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slot;
  }

  std::vector<std::uint32_t> slots_ = std::vector(64, none);  ///< 2^n, at least half empty
  std::vector<GridCell> cells_;
};

}  // namespace panonav
