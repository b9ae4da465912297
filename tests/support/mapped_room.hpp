#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "panonav/geometry/alignment.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/route/route_panorama.hpp"
#include "support/remembered_worlds.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {

inline constexpr double radius_m = 4.0;
inline constexpr int round_views = 110;

/// Rounds of 10 m, looking ahead, with a view every 9 cm.
inline std::vector<Pose2> rounds(int views) {
  std::vector<Pose2> poses;
  for (int i = 0; i < views; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / round_views;
    poses.push_back({1.6 * std::sin(angle), -1.6 * std::cos(angle), wrap_angle(angle)});
  }
  return poses;
}

inline FourierSignature empty_view() {
  return compute_signature(Panorama(round_room_shape.rows, 96, std::nullopt),
                           round_room_shape.components);
}

inline std::string name_view(std::size_t i) {
  return "view_" + std::to_string(1000 + i);
}

/// Memories of views in a round room, and their maps.
class MemoryMaps : public ::testing::Test {
 protected:
  MemoryFile make_memory() {
    MemoryHeader header;
    header.shape = round_room_shape;
    header.full_scale = 0.1F;
    header.panorama_columns = 96;
    return MemoryFile::create(folder / ("m" + std::to_string(count_++) + ".panonav"), header);
  }
  static void append(MemoryFile& memory, const FourierSignature& signature,
                     const std::optional<ReferencePose>& pose = std::nullopt) {
    const std::string name = name_view(memory.info().views);
    memory.append(NewView{{name, pose, std::nullopt}, pack(signature, 0.1F), {}, {}});
  }
  MemoryFile make_walk(const std::vector<Pose2>& poses) {
    MemoryFile memory = make_memory();
    for (const Pose2& pose : poses) append(memory, round_room_signature(world, pose));
    return memory;
  }
  static std::vector<Point2> positions(const MemoryFile& memory) {
    const VisualMemory views = memory.load();
    std::vector<Point2> points;
    for (const ViewId view : views.views()) points.push_back(views.info(view).pose->position());
    return points;
  }
  /// Stores a route of length 2.
  static void append_route(MemoryFile& memory, const std::string& name,
                           std::optional<double> assumed_unit_m, bool is_in_map_unit = false) {
    RoutePanorama route(16);
    const std::vector<float> line(16, 0.5F);
    route.append({0.0, 0.0, 0.0}, line);
    route.append({2.0, 0.0, 0.0}, line);
    memory.append_route(name, route);
    store_route_source(memory, name,
                       {.line = {.columns = 16},
                        .assumed_unit_m = assumed_unit_m,
                        .is_in_map_unit = is_in_map_unit,
                        .map_scale = is_in_map_unit ? read_map_scale(memory) : std::nullopt});
  }
  static double shape(const MemoryFile& memory, const std::vector<Pose2>& truth) {
    std::vector<Point2> points;
    for (const Pose2& pose : truth) points.push_back(pose.position());
    return shape_difference(positions(memory), points).value;
  }

  TemporaryFolder folder;
  const ToyWorld world = round_room(radius_m, 5);
  Executor executor;

 private:
  int count_ = 0;
};

}  // namespace panonav::testing
