#include "simulated_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <string_view>

#include "panonav/core/random.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::bench {

namespace {

constexpr double spacing_m = 0.1;
constexpr double camera_height_m = 0.6;
constexpr int columns = 64;
// Each component of a 512-column view averages eight times as many pixels.
const double noise = 0.02 / std::sqrt(512.0 / columns);

struct Room {
  simulation::Scene scene;
  simulation::Renderer renderer;
  explicit Room(std::string_view name, std::uint64_t seed)
      : scene(simulation::make_scene(name, {.seed = seed})), renderer(scene) {}

  /// Nothing within 15 cm of the camera, the floor free below it.
  [[nodiscard]] bool is_free(Point2 p) const {
    if (p.x_m < scene.floor_low.x_m || p.x_m > scene.floor_high.x_m ||
        p.y_m < scene.floor_low.y_m || p.y_m > scene.floor_high.y_m) {
      return false;
    }
    const simulation::Vector3 camera{p.x_m, p.y_m, camera_height_m};
    if (renderer.distance_along(camera, {0.0, 0.0, -1.0}) < camera_height_m - 0.02) return false;
    for (int i = 0; i < 8; ++i) {
      const double azimuth = i * std::numbers::pi / 4.0;
      if (renderer.distance_along(camera, Direction3::from_angles(azimuth, 0.0)) < 0.15)
        return false;
    }
    return true;
  }
  [[nodiscard]] Point2 random_place(Random& random) const {
    for (;;) {
      const Point2 p{random.uniform(scene.floor_low.x_m, scene.floor_high.x_m),
                     random.uniform(scene.floor_low.y_m, scene.floor_high.y_m)};
      if (is_free(p)) return p;
    }
  }
};

std::vector<Point2> grid_of(const Room& room, std::size_t max_places) {
  std::vector<Point2> places;
  for (double y = room.scene.floor_low.y_m; y <= room.scene.floor_high.y_m; y += spacing_m) {
    for (double x = room.scene.floor_low.x_m; x <= room.scene.floor_high.x_m; x += spacing_m) {
      if (places.size() < max_places && room.is_free({x, y})) places.push_back({x, y});
    }
  }
  return places;
}

std::vector<Point2> path_through(const Room& room, Random& random, std::size_t max_places) {
  std::vector<Point2> places{room.random_place(random)};
  double direction = random.uniform(0.0, 2.0 * std::numbers::pi);
  while (places.size() < max_places) {
    direction += random.uniform(-0.25, 0.25);
    const Point2 next{places.back().x_m + spacing_m * std::cos(direction),
                      places.back().y_m + spacing_m * std::sin(direction)};
    if (room.is_free(next)) {
      places.push_back(next);
    } else {
      direction += 1.0;
    }
  }
  return places;
}

std::vector<float> magnitudes_at(const Room& room, Point2 place, Random& random,
                                 Executor& executor) {
  simulation::Viewpoint viewpoint;
  viewpoint.pose = {place.x_m, place.y_m, random.uniform(-std::numbers::pi, std::numbers::pi)};
  viewpoint.height_m = camera_height_m;
  simulation::PanoramaRendering rendering;
  rendering.rows = ViewSet::shape.rows;
  rendering.columns = columns;
  rendering.rays_per_axis = 1;
  Panorama view = room.renderer.render_panorama(viewpoint, rendering, executor);
  for (float& value : view.values()) {
    value = std::clamp(value + static_cast<float>(random.normal(0.0, noise)), 0.0F, 1.0F);
  }
  const FourierSignature signature = compute_signature(view, ViewSet::shape.components);
  return {signature.magnitudes().begin(), signature.magnitudes().end()};
}

std::vector<std::uint8_t> packed(const std::vector<float>& magnitudes, float full_scale) {
  std::vector<std::uint8_t> bytes(magnitudes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(
        std::min(255.0F, std::round(magnitudes[i] * 255.0F / full_scale)));
  }
  return bytes;
}

ViewSet render(Places places, std::size_t views, std::size_t queries, std::uint64_t first_room) {
  static constexpr std::string_view kinds[] = {"office", "lab", "hall"};
  // Rooms of 10 .. 49 square metres; no more than this many views of one, so that there are enough
  // rooms.
  const std::size_t max_per_room = places == Places::rooms ? 2000 : 4000;
  std::vector<float> view_magnitudes;
  std::vector<float> query_magnitudes;
  Executor executor(0);
  std::size_t made = 0;
  std::size_t queries_made = 0;
  std::size_t rooms = 0;
  for (std::uint64_t seed = first_room; made < views; ++seed) {
    Random random(seed, 77);
    const Room room(kinds[seed % std::size(kinds)], seed);
    const std::size_t max_places = std::min(max_per_room, views - made);
    const std::vector<Point2> at = places == Places::rooms ? grid_of(room, max_places)
                                                           : path_through(room, random, max_places);
    for (const Point2 place : at) {
      const auto magnitudes = magnitudes_at(room, place, random, executor);
      view_magnitudes.insert(view_magnitudes.end(), magnitudes.begin(), magnitudes.end());
    }
    made += at.size();
    ++rooms;
    // Queries in proportion to the views, anywhere between them.
    for (; queries_made < queries * made / views; ++queries_made) {
      Point2 place;
      do {
        const Point2 beside = at[random.index(at.size())];
        place = {beside.x_m + random.uniform(-spacing_m / 2, spacing_m / 2),
                 beside.y_m + random.uniform(-spacing_m / 2, spacing_m / 2)};
      } while (!room.is_free(place));
      const auto magnitudes = magnitudes_at(room, place, random, executor);
      query_magnitudes.insert(query_magnitudes.end(), magnitudes.begin(), magnitudes.end());
    }
    std::fprintf(stderr, "\rrendered %zu of %zu views in %zu rooms ", made, views, rooms);
  }
  std::fprintf(stderr, "\n");
  // The same as in a memory: the scale comes from the first views, brighter ones saturate.
  const auto first =
      static_cast<std::ptrdiff_t>(std::min(view_magnitudes.size(), 1000 * ViewSet::shape.size()));
  const float full_scale =
      *std::max_element(view_magnitudes.begin(), view_magnitudes.begin() + first);
  return {packed(view_magnitudes, full_scale), packed(query_magnitudes, full_scale)};
}

}  // namespace

ViewSet simulated_views(Places places, std::size_t views, std::size_t queries,
                        const std::filesystem::path& cache, std::uint64_t first_room) {
  if (places == Places::numbers) {
    Random random(5);
    ViewSet set;
    set.views.resize(views * ViewSet::shape.size());
    set.queries.resize(queries * ViewSet::shape.size());
    for (auto* bytes : {&set.views, &set.queries}) {
      for (auto& byte : *bytes) byte = static_cast<std::uint8_t>(random.next() >> 56U);
    }
    return set;
  }
  const std::size_t view_bytes = views * ViewSet::shape.size();
  const std::size_t query_bytes = queries * ViewSet::shape.size();
  std::error_code missing;
  if (std::filesystem::file_size(cache, missing) != view_bytes + query_bytes) {
    const ViewSet set = render(places, views, queries, first_room);
    std::ofstream out(cache, std::ios::binary);
    out.write(reinterpret_cast<const char*>(set.views.data()),
              static_cast<std::streamsize>(set.views.size()));
    out.write(reinterpret_cast<const char*>(set.queries.data()),
              static_cast<std::streamsize>(set.queries.size()));
    return set;
  }
  ViewSet set{std::vector<std::uint8_t>(view_bytes), std::vector<std::uint8_t>(query_bytes)};
  std::ifstream in(cache, std::ios::binary);
  in.read(reinterpret_cast<char*>(set.views.data()), static_cast<std::streamsize>(view_bytes));
  in.read(reinterpret_cast<char*>(set.queries.data()), static_cast<std::streamsize>(query_bytes));
  return set;
}

}  // namespace panonav::bench
