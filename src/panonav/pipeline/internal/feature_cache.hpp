#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <optional>

#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Caches the local features of up to `max_cached_views` views; reads them on first use through a
/// separate file handle. Several threads may use it concurrently.
class FeatureCache {
 public:
  /// Opens the memory again. Views with an id above `last_view` are treated as having no features;
  /// nullopt: no limit.
  explicit FeatureCache(const MemoryFile& memory, std::optional<ViewId> last_view = std::nullopt);

  /// Returns the features of a view; nullopt if it has none or was removed. Throws FileError if the
  /// memory cannot be read; the next call then opens it again.
  [[nodiscard]] std::optional<LocalFeatures> features(ViewId view);

 private:
  static constexpr std::size_t max_cached_views = 10000;  ///< chosen: some 100 MB
  std::mutex mutex_;
  MemoryFile file_;
  bool is_lost_ = false;  ///< the connection of `file_` to its server was lost
  std::optional<ViewId> last_view_;
  FeatureSource read_;  ///< reads from `file_`; empty: the memory has no features
  std::map<ViewId, std::optional<LocalFeatures>> views_;
};

}  // namespace panonav
