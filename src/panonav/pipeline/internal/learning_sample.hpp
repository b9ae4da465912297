#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "panonav/memory/view_index.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Largest number of views from which models are learnt (docs/scale.md).
inline constexpr std::size_t max_learnt_views = 20'000;

/// Returns the number of views, the first of a memory of this size, to which its models belong:
/// `views` rounded down to three significant digits. So models of large memories are learnt again
/// only when they have grown by 0.1 to 1 %, and do not depend on the steps in which they grew.
[[nodiscard]] std::size_t count_learnt_views(std::size_t views) noexcept;

/// The views of a memory from which its models are learnt: the first `count_learnt_views`, or of
/// these, if there are more than `max_learnt_views`, as `load_learning_sample` chooses.
class LearntViews {
 public:
  /// `memory` must outlive *this. Copies views unless all of them are learnt from.
  explicit LearntViews(const VisualMemory& memory);
  [[nodiscard]] const VisualMemory& memory() const noexcept { return part_ ? *part_ : *all_; }

 private:
  const VisualMemory* all_;
  std::optional<VisualMemory> part_;
};

/// Loads the views of a file from which its models are learnt, the same as `LearntViews`. Reads no
/// other signatures. `places`: of all views.
[[nodiscard]] VisualMemory load_learnt_views(const MemoryFile& file,
                                             std::span<const MemoryFile::ViewPlace> places);

/// Loads the views from which the models of a memory that is not held are learnt, at most
/// `max_views`: all views in square areas around the sampled views, or views of neighbouring ids if
/// a sampled view has no position. `views`: all of the memory, ascending; `sampled`: in the
/// order of sampling.
[[nodiscard]] VisualMemory load_learning_sample(ViewIndex& index, std::span<const ViewId> views,
                                                std::span<const ViewId> sampled,
                                                std::size_t max_views);

}  // namespace panonav
