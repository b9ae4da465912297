#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/simulation/renderer.hpp"

namespace panonav::command {

/// A view that was asked for, and what the memory said.
struct AskedView {
  Pose2 truth;
  PackedSignature signature;
  Localisation found;
};

/// What stands on the floor, seen from above: boxes of one row of small squares each.
struct FloorPlan {
  std::vector<std::vector<Point2>> boxes;
};
[[nodiscard]] FloorPlan floor_plan(const Renderer& renderer, Point2 low, Point2 high);

/// True places, and a line from each to where the memory says it is.
void draw_answers(const VisualMemory& memory, const FloorPlan& plan,
                  const std::vector<AskedView>& asked, const std::filesystem::path& path);

/// Where the robot may be after 1, 3, 6 and all components, side by side [M04 figure 9]. Gives the
/// areas of these levels in square metres.
std::vector<double> draw_areas(const VisualMemory& memory, const FloorPlan& plan,
                               const AskedView& asked, const std::filesystem::path& path);

/// How similar every remembered view is to the one asked for [M04 figure 8].
void draw_similarity(const VisualMemory& memory, double spacing_m, const AskedView& asked,
                     const std::filesystem::path& path);

}  // namespace panonav::command
