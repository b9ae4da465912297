#pragma once

#include <span>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A source of views of a memory that is not in RAM as a whole, such as a large file.
class ViewSource {
 public:
  virtual ~ViewSource() = default;
  /// All views, ascending.
  [[nodiscard]] virtual std::span<const ViewId> views() const = 0;
  /// Returns a memory of these views with their ids, without links. `views` must ascend. Throws
  /// ContractError on an unknown view.
  [[nodiscard]] virtual VisualMemory load(std::span<const ViewId> views) const = 0;
};

/// Loads parts of a memory in RAM, which must outlive the source.
class MemoryViewSource final : public ViewSource {
 public:
  /// Keeps a reference to the memory; copies nothing.
  explicit MemoryViewSource(const VisualMemory& memory);
  [[nodiscard]] std::span<const ViewId> views() const override { return memory_->views(); }
  /// Copies the signatures.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const override;

 private:
  const VisualMemory* memory_;
};

}  // namespace panonav
