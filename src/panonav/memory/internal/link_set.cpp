#include "panonav/memory/internal/link_set.hpp"

#include <algorithm>

namespace panonav {

std::size_t LinkSet::find(ViewId a, ViewId b) const {
  const auto found = positions_.find(a);
  if (found != positions_.end()) {
    for (const std::size_t position : found->second) {
      const Link& link = links_[position];
      if ((link.a == a && link.b == b) || (link.a == b && link.b == a)) return position;
    }
  }
  return links_.size();
}

void LinkSet::insert(const Link& link) {
  const std::size_t position = find(link.a, link.b);
  if (position < links_.size()) {
    links_[position] = link;
    return;
  }
  links_.push_back(link);
  positions_[link.a].push_back(position);
  positions_[link.b].push_back(position);
}

void LinkSet::erase(ViewId a, ViewId b) {
  const std::size_t position = find(a, b);
  if (position < links_.size()) erase_at(position);
}

void LinkSet::erase_links_of(ViewId view) {
  for (auto found = positions_.find(view); found != positions_.end();
       found = positions_.find(view)) {
    erase_at(found->second.back());
  }
}

void LinkSet::erase_at(std::size_t position) {
  remove_position(links_[position].a, position);
  remove_position(links_[position].b, position);
  const std::size_t last = links_.size() - 1;
  if (position != last) {
    replace_position(links_[last].a, last, position);
    replace_position(links_[last].b, last, position);
    links_[position] = links_[last];
  }
  links_.pop_back();
}

void LinkSet::remove_position(ViewId view, std::size_t position) {
  const auto found = positions_.find(view);
  std::erase(found->second, position);
  if (found->second.empty()) positions_.erase(found);
}

void LinkSet::replace_position(ViewId view, std::size_t from, std::size_t to) {
  std::ranges::replace(positions_.at(view), from, to);
}

std::vector<ViewId> LinkSet::neighbours(ViewId view) const {
  std::vector<ViewId> result;
  const auto found = positions_.find(view);
  if (found == positions_.end()) return result;
  for (const std::size_t position : found->second) {
    const Link& link = links_[position];
    result.push_back(link.a == view ? link.b : link.a);
  }
  std::ranges::sort(result);
  return result;
}

}  // namespace panonav
