#include "panonav/memory/view_source.hpp"

namespace panonav {

MemoryViewSource::MemoryViewSource(const VisualMemory& memory) : memory_(&memory) {}

VisualMemory MemoryViewSource::load(std::span<const ViewId> views) const {
  VisualMemory part(memory_->shape(), memory_->full_scale(), memory_->elevations());
  for (const ViewId view : views)
    part.append_with_id(view, memory_->packed(view), memory_->info(view));
  return part;
}

}  // namespace panonav
