#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <optional>

#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Caches local features of a memory's views, up to a number; reads them on first use through a
/// file handle of its own. Several threads may use it.
class FeatureCache {
 public:
  /// Opens the memory again. Views with an id above `last_view` are treated as having no features;
  /// empty: all views count.
  explicit FeatureCache(const MemoryFile& memory, std::optional<ViewId> last_view = std::nullopt);

  /// Returns the features of a view; empty if it has none or is removed. Throws FileError when the
  /// memory cannot be read; the next call opens it again.
  [[nodiscard]] std::optional<LocalFeatures> features(ViewId view);

 private:
  static constexpr std::size_t max_kept_views = 10000;  ///< chosen: some 100 MB
  std::mutex mutex_;
  MemoryFile file_;
  bool is_lost_ = false;  ///< `file_` has lost its server
  std::optional<ViewId> last_view_;
  FeatureSource read_;  ///< reads from `file_`; empty: the memory has no features
  std::map<ViewId, std::optional<LocalFeatures>> views_;
};

}  // namespace panonav
