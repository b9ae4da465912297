#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace panonav {

/// Sets of the numbers 0 .. size - 1, each alone at first, that are joined two at a time (union and
/// find with halved paths). The smallest member stands for its set. Cost: about constant a call.
class DisjointSets {
 public:
  /// Numbers 0 .. size - 1, each a set of its own. Cost: O(size).
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  /// Returns the smallest member of the set of `i`, which must be below `size`; shortens the paths
  /// that it follows.
  [[nodiscard]] std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Joins two sets; false when they were one set before.
  bool join(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }
  /// Returns the number of each member's set, from 0 in the order of their smallest members.
  [[nodiscard]] std::vector<std::size_t> number_sets() {
    std::vector<std::size_t> number(parent_.size());
    std::size_t next = 0;
    for (std::size_t i = 0; i < number.size(); ++i) {
      const std::size_t first = find(i);
      number[i] = first == i ? next++ : number[first];
    }
    return number;
  }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace panonav
