#include "panonav/pipeline/internal/feature_cache.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"

namespace panonav {

FeatureCache::FeatureCache(const MemoryFile& memory, std::optional<ViewId> last_view)
    : file_(memory.reopen(Access::read_only)),
      last_view_(last_view),
      read_(make_feature_source(file_)) {}

std::optional<LocalFeatures> FeatureCache::features(ViewId view) {
  if (last_view_ && *last_view_ < view) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto found = views_.find(view);
  if (found != views_.end()) return found->second;
  std::optional<LocalFeatures> features;
  try {
    if (std::exchange(is_lost_, false)) {
      file_ = file_.reopen(Access::read_only);
      read_ = make_feature_source(file_);
    }
    if (read_) features = read_(view);
  } catch (const ContractError&) {  // somebody has removed the view since
  } catch (const FileError&) {
    is_lost_ = true;
    throw;
  }
  if (views_.size() >= max_cached_views) views_.clear();
  return views_.emplace(view, std::move(features)).first->second;
}

}  // namespace panonav
