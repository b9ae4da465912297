#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "panonav/core/ids.hpp"
#include "panonav/signature/column_profiles.hpp"

namespace panonav {

/// The column profiles of the views that were requested last. Several threads may use one cache
/// concurrently. Signatures of views never change, so cached profiles do not either.
class ProfileCache {
 public:
  /// Holds at most `max_profiles` profiles, each of about 2.7 kB.
  explicit ProfileCache(std::size_t max_profiles) : max_profiles_(max_profiles) {}

  /// Returns the profiles of a view; null if they are not cached.
  [[nodiscard]] std::shared_ptr<const ColumnProfiles> find(ViewId view);
  /// Adds the profiles of a view, and drops those that were not requested for the longest time if
  /// there are too many.
  void insert(ViewId view, std::shared_ptr<const ColumnProfiles> profiles);
  /// Returns the number of cached profiles.
  [[nodiscard]] std::size_t size() const;

 private:
  struct Entry {
    ViewId view;
    std::shared_ptr<const ColumnProfiles> profiles;
  };
  std::size_t max_profiles_;
  mutable std::mutex mutex_;  // of the members below
  std::list<Entry> entries_;  // requested last first
  std::unordered_map<std::uint32_t, std::list<Entry>::iterator> by_view_;
};

}  // namespace panonav
