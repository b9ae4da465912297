#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// Stores the area of each view by the view's id, to find the views of changed areas. Memory: four
/// bytes for each view.
class AreasOfViews {
 public:
  void set(ViewId view, const std::optional<MemoryArea>& area) {
    if (view.value >= numbers_.size()) {
      numbers_.resize(std::max<std::size_t>(view.value + std::size_t{1}, numbers_.size() * 5 / 4));
    }
    numbers_[view.value] = area ? get_or_create_number(*area) : no_area;
  }
  void erase(ViewId view) {
    if (view.value < numbers_.size()) numbers_[view.value] = no_view;
  }
  [[nodiscard]] bool has(ViewId view) const {
    return view.value < numbers_.size() && numbers_[view.value] != no_view;
  }
  /// Returns the views of these areas, ascending. Cost: a pass over all ids.
  [[nodiscard]] std::vector<ViewId> find_views_in(const std::set<MemoryArea>& areas) const {
    std::vector<std::uint32_t> known;
    for (const MemoryArea& area : areas) {
      const auto found = areas_.find(area);
      if (found != areas_.end()) known.push_back(found->second);
    }
    std::ranges::sort(known);
    return select_views(
        [&](std::uint32_t number) { return std::ranges::binary_search(known, number); });
  }
  [[nodiscard]] std::vector<ViewId> all() const {
    return select_views([](std::uint32_t number) { return number != no_view; });
  }
  [[nodiscard]] std::uint64_t bytes() const { return numbers_.size() * sizeof(std::uint32_t); }

 private:
  static constexpr std::uint32_t no_view = 0;
  static constexpr std::uint32_t no_area = 1;
  std::uint32_t get_or_create_number(const MemoryArea& area) {
    return areas_.try_emplace(area, static_cast<std::uint32_t>(areas_.size()) + no_area + 1)
        .first->second;
  }
  template <class Condition>
  [[nodiscard]] std::vector<ViewId> select_views(const Condition& matches) const {
    std::vector<ViewId> views;
    for (std::size_t id = 0; id < numbers_.size(); ++id) {
      if (matches(numbers_[id])) views.push_back({static_cast<std::uint32_t>(id)});
    }
    return views;
  }
  std::vector<std::uint32_t> numbers_;  // area numbers by view id
  std::map<MemoryArea, std::uint32_t> areas_;
};

}  // namespace panonav::fleet
