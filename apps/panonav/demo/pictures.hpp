#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "reporting/plot.hpp"

namespace panonav::command {

/// A view that was asked for, and what the memory said.
struct AskedView {
  Pose2 truth;
  PackedSignature signature;
  Localisation found;
};

/// True places, and a line from each to where the memory says it is, over the layers of the scene.
void draw_answers(const VisualMemory& memory, const std::vector<MapLayer>& scene,
                  const std::vector<AskedView>& asked, const std::filesystem::path& path);

/// Where the robot may be after 1, 3, 6 and all components, side by side [M04 figure 9]. Gives the
/// areas of these levels in square metres.
std::vector<double> draw_areas(const VisualMemory& memory, const std::vector<MapLayer>& scene,
                               const AskedView& asked, const std::filesystem::path& path);

/// How similar every remembered view is to the one asked for [M04 figure 8].
void draw_similarity(const VisualMemory& memory, double spacing_m, const AskedView& asked,
                     const std::filesystem::path& path);

}  // namespace panonav::command
