#include "panonav_viewer/scene_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::viewer {

namespace {

using Triangle = std::array<simulation::Vector3, 3>;

/// Groups triangles into bodies: triangles that share corners, to the millimetre, belong to one
/// body.
std::vector<std::vector<Triangle>> find_bodies(const std::vector<Triangle>& triangles) {
  std::map<std::array<long, 3>, std::size_t> body_at;  // body number first assigned to a corner
  std::vector<std::size_t> parent_body;                // union-find parent of each body number
  const auto body = [&](std::size_t number) {
    while (parent_body[number] != number)
      number = parent_body[number] = parent_body[parent_body[number]];
    return number;
  };
  std::vector<std::size_t> number_of;
  for (const Triangle& triangle : triangles) {
    const std::size_t own = parent_body.size();
    parent_body.push_back(own);
    number_of.push_back(own);
    for (const simulation::Vector3& v : triangle) {
      const std::array corner{std::lround(1e3 * v.x_m), std::lround(1e3 * v.y_m),
                              std::lround(1e3 * v.z_m)};
      parent_body[body(own)] = body(body_at.try_emplace(corner, own).first->second);
    }
  }
  std::map<std::size_t, std::vector<Triangle>> bodies;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    bodies[body(number_of[i])].push_back(triangles[i]);
  }
  std::vector<std::vector<Triangle>> result;
  for (auto& [number, members] : bodies) result.push_back(std::move(members));
  return result;
}

/// Returns the convex hull, counter-clockwise; two points if all points are on one line (areas
/// below 1e-8 m^2).
std::vector<Point2> compute_convex_hull(std::vector<Point2> points) {
  std::ranges::sort(points, {}, [](const Point2& p) { return std::pair(p.x_m, p.y_m); });
  const auto is_left = [](const Point2& a, const Point2& b, const Point2& c) {
    return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m) > 1e-8;
  };
  std::vector<Point2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= begin + 2 && !is_left(hull[hull.size() - 2], hull.back(), p)) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  return hull;
}

/// Intersects a triangle with a horizontal plane; returns both ends of the segment, or nothing.
std::vector<Point2> cut_triangle(const Triangle& triangle, double height_m) {
  std::vector<Point2> ends;
  for (std::size_t i = 0; i < 3; ++i) {
    const simulation::Vector3& a = triangle[i];
    const simulation::Vector3& b = triangle[(i + 1) % 3];
    if ((a.z_m < height_m) == (b.z_m < height_m)) continue;
    const double share = (height_m - a.z_m) / (b.z_m - a.z_m);
    ends.push_back({a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)});
  }
  return ends;
}

/// Keeps the part of a polygon for which `inside_m` is not negative: the distance from a line.
std::vector<Point2> clip_polygon(const std::vector<Point2>& polygon,
                                 const std::function<double(const Point2&)>& inside_m) {
  std::vector<Point2> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2& a = polygon[i];
    const Point2& b = polygon[(i + 1) % polygon.size()];
    const double a_m = inside_m(a);
    const double b_m = inside_m(b);
    if (a_m >= 0.0) kept.push_back(a);
    if ((a_m < 0.0) == (b_m < 0.0)) continue;
    const double share = a_m / (a_m - b_m);
    kept.push_back({a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)});
  }
  return kept;
}

/// Cuts off the parts of furniture behind outer walls, as of a shelf in a corner: no camera in the
/// room sees them. A side of the rectangle around all walls is an outer wall if walls run along
/// half of it.
void clip_to_outer_walls(const MapLayer& walls, MapLayer& furniture) {
  constexpr double tolerance_m = 0.02;
  if (walls.lines.empty()) return;
  Point2 low = walls.lines.front().front();
  Point2 high = low;
  for (const std::vector<Point2>& line : walls.lines) {
    for (const Point2& p : line) {
      low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
      high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
    }
  }
  const std::array<std::function<double(const Point2&)>, 4> sides{
      [low](const Point2& p) { return p.x_m - low.x_m; },
      [high](const Point2& p) { return high.x_m - p.x_m; },
      [low](const Point2& p) { return p.y_m - low.y_m; },
      [high](const Point2& p) { return high.y_m - p.y_m; }};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto is_on_side = [&](const Point2& p) { return std::abs(sides[i](p)) < tolerance_m; };
    double wall_m = 0.0;
    for (const std::vector<Point2>& line : walls.lines) {
      if (std::ranges::all_of(line, is_on_side)) wall_m += distance(line.front(), line.back());
    }
    const double side_m = i < 2 ? high.y_m - low.y_m : high.x_m - low.x_m;
    if (wall_m < 0.5 * side_m) continue;
    for (std::vector<Point2>& outline : furniture.filled_polygons) {
      outline = clip_polygon(outline, sides[i]);
    }
  }
  std::erase_if(furniture.filled_polygons, [](const auto& outline) { return outline.size() < 3; });
}

/// The corners of a body seen from above, and its range of heights.
struct BodyExtent {
  std::vector<Point2> corners;
  double bottom_m = std::numeric_limits<double>::infinity();
  double top_m = -std::numeric_limits<double>::infinity();
};

BodyExtent compute_extent(const std::vector<Triangle>& body) {
  BodyExtent extent;
  for (const Triangle& triangle : body) {
    for (const simulation::Vector3& v : triangle) {
      extent.corners.push_back({v.x_m, v.y_m});
      extent.bottom_m = std::min(extent.bottom_m, v.z_m);
      extent.top_m = std::max(extent.top_m, v.z_m);
    }
  }
  return extent;
}

}  // namespace

std::vector<MapLayer> scene_layers(const simulation::Scene& scene) {
  constexpr double min_top_m = 0.1;         // excludes carpets and sills
  constexpr double max_bottom_m = 1.9;      // excludes lamps, lintels and ceilings
  constexpr double max_solid_size_m = 4.0;  // larger bodies are shown as sections
  constexpr double shown_margin_m = 3.0;    // distant trees would make the floor tiny
  constexpr std::size_t max_bodies = 30;
  MapLayer walls{.label = "walls", .colour = PlotColour::dark_grey};
  MapLayer furniture{.label = "furniture and other objects", .colour = PlotColour::grey};
  const auto is_near = [&](const std::vector<Point2>& points) {
    return std::ranges::any_of(points, [&](const Point2& p) {
      return p.x_m > scene.floor_low.x_m - shown_margin_m &&
             p.x_m < scene.floor_high.x_m + shown_margin_m &&
             p.y_m > scene.floor_low.y_m - shown_margin_m &&
             p.y_m < scene.floor_high.y_m + shown_margin_m;
    });
  };
  std::map<std::string, std::vector<Triangle>> objects;
  for (const simulation::Mesh& mesh : scene.meshes) {
    std::vector<Triangle>& object = objects[mesh.object];
    for (const auto& [a, b, c] : mesh.triangles) {
      object.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
    }
  }
  for (const auto& [name, object] : objects) {
    std::vector<std::vector<Triangle>> bodies = find_bodies(object);
    if (bodies.size() > max_bodies) bodies = {object};
    std::vector<std::vector<Point2>> flat_outlines;
    std::size_t solid_count = 0;
    for (const std::vector<Triangle>& body : bodies) {
      BodyExtent extent = compute_extent(body);
      if (extent.top_m < min_top_m || extent.bottom_m > max_bottom_m || !is_near(extent.corners))
        continue;
      const std::vector<Point2> outline = compute_convex_hull(std::move(extent.corners));
      const auto [west, east] = std::ranges::minmax(outline, {}, &Point2::x_m);
      const auto [south, north] = std::ranges::minmax(outline, {}, &Point2::y_m);
      if (std::max(east.x_m - west.x_m, north.y_m - south.y_m) > max_solid_size_m) {
        for (const Triangle& triangle : body) {
          std::vector<Point2> line = cut_triangle(triangle, scene.camera_height_m);
          if (line.size() == 2 && is_near(line)) walls.lines.push_back(std::move(line));
        }
      } else if (outline.size() == 2) {
        flat_outlines.push_back(outline);
      } else {
        furniture.filled_polygons.push_back(outline);
        ++solid_count;
      }
    }
    if (solid_count == 0)  // else they are faces, as of a shelf
      walls.lines.insert(walls.lines.end(), flat_outlines.begin(), flat_outlines.end());
  }
  clip_to_outer_walls(walls, furniture);
  return {furniture, walls};
}

std::vector<std::vector<Point2>> scene_outlines(const simulation::Scene& scene) {
  std::vector<std::vector<Point2>> walls;
  for (const MapLayer& layer : scene_layers(scene)) {
    walls.insert(walls.end(), layer.lines.begin(), layer.lines.end());
    for (std::vector<Point2> outline : layer.filled_polygons) {
      outline.push_back(outline.front());
      walls.push_back(std::move(outline));
    }
  }
  return walls;
}

}  // namespace panonav::viewer
