#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Links between views, at most one per pair. Cost of a change: the links of the two views.
class LinkSet {
 public:
  /// A second link of the same two views replaces the first.
  void insert(const Link& link);
  /// Removes the link between the two, if there is one.
  void erase(ViewId a, ViewId b);
  void erase_links_of(ViewId view);

  [[nodiscard]] std::span<const Link> links() const noexcept { return links_; }
  /// Ascending.
  [[nodiscard]] std::vector<ViewId> neighbours(ViewId view) const;

 private:
  [[nodiscard]] std::size_t find(ViewId a, ViewId b) const;
  void erase_at(std::size_t position);
  void remove_position(ViewId view, std::size_t position);
  void replace_position(ViewId view, std::size_t from, std::size_t to);

  std::vector<Link> links_;
  std::unordered_map<ViewId, std::vector<std::size_t>> positions_;  // of each view's links
};

}  // namespace panonav
