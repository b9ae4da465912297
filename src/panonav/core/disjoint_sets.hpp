#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace panonav {

/// A partition of the numbers 0 .. size - 1 into disjoint sets that can be joined (union-find with
/// path halving). The smallest member represents its set. Cost: almost constant per call.
class DisjointSets {
 public:
  /// Makes a set of each of the numbers 0 .. size - 1. Cost: O(size).
  explicit DisjointSets(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  /// Returns the smallest member of the set of `i`. The caller guarantees i < size. Shortens the
  /// internal paths, so it is not const.
  [[nodiscard]] std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Joins the sets of `a` and `b`; false if they were already the same set.
  bool join(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }
  /// Numbers the sets from 0 in the order of their smallest members; returns the set number of each
  /// member.
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
