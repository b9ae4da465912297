#include "panonav/localisation/internal/profile_cache.hpp"

#include <iterator>
#include <utility>

namespace panonav {

std::shared_ptr<const ColumnProfiles> ProfileCache::find(ViewId view) {
  const std::lock_guard lock(mutex_);
  const auto found = by_view_.find(view.value);
  if (found == by_view_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->profiles;
}

void ProfileCache::insert(ViewId view, std::shared_ptr<const ColumnProfiles> profiles) {
  if (max_profiles_ == 0) return;
  const std::lock_guard lock(mutex_);
  if (by_view_.contains(view.value)) return;  // another thread was faster
  if (entries_.size() == max_profiles_) {
    by_view_.erase(entries_.back().view.value);
    entries_.splice(entries_.begin(), entries_, std::prev(entries_.end()));
    entries_.front() = {view, std::move(profiles)};
  } else {
    entries_.push_front({view, std::move(profiles)});
  }
  by_view_.emplace(view.value, entries_.begin());
}

std::size_t ProfileCache::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

}  // namespace panonav
