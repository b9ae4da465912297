#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// The median; of an even number the larger of the two in the middle. Reorders `values`, of which
/// there must be at least one. Cost: O(n).
template <typename Value>
[[nodiscard]] Value upper_median_in_place(std::span<Value> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The same of a copy.
template <typename Value>
[[nodiscard]] Value upper_median(std::vector<Value> values) {
  return upper_median_in_place(std::span(values));
}

}  // namespace panonav
