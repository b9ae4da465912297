#pragma once

#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// The views of a memory that have positions, ascending.
struct PosedViews {
  explicit PosedViews(const VisualMemory& memory) {
    for (const ViewId view : memory.views()) {
      if (const auto position = find_position(memory.info(view))) {
        views.push_back(view);
        positions.push_back(plane.to_plane(*position));
      }
    }
  }
  std::vector<ViewId> views;
  FloorPlane plane;               // in which the floors lie apart
  std::vector<Point2> positions;  // in `plane`
};

}  // namespace panonav
