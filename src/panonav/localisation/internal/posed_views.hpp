#pragma once

#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// The views of a memory that have positions, ascending.
struct PosedViews {
  explicit PosedViews(const VisualMemory& memory) {
    for (const ViewId view : memory.views()) {
      if (const auto& pose = memory.info(view).pose) {
        views.push_back(view);
        positions.push_back(pose->position());
      }
    }
  }
  std::vector<ViewId> views;
  std::vector<Point2> positions;
};

}  // namespace panonav
