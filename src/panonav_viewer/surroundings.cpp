#include "panonav_viewer/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::viewer {

namespace {

constexpr double kSectorRad = 2.0 * std::numbers::pi / shape_directions;

using Triangle = std::array<simulation::Vector3, 3>;

/// Triangles that share corners, to the millimetre, belong together.
std::vector<std::vector<Triangle>> bodies_of(const std::vector<Triangle>& triangles) {
  std::map<std::array<long, 3>, std::size_t> body_at;  // a corner's body, as first numbered
  std::vector<std::size_t> joined;                     // to this body; itself: its own
  const auto body = [&](std::size_t number) {
    while (joined[number] != number) number = joined[number] = joined[joined[number]];
    return number;
  };
  std::vector<std::size_t> number_of;
  for (const Triangle& triangle : triangles) {
    const std::size_t own = joined.size();
    joined.push_back(own);
    number_of.push_back(own);
    for (const simulation::Vector3& v : triangle) {
      const std::array corner{std::lround(1e3 * v.x_m), std::lround(1e3 * v.y_m),
                              std::lround(1e3 * v.z_m)};
      joined[body(own)] = body(body_at.try_emplace(corner, own).first->second);
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

/// Counter-clockwise; two points where all lie on one line, to a hundredth of a square millimetre.
std::vector<Point2> convex_hull(std::vector<Point2> points) {
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

/// Where a horizontal plane cuts it: both ends, or fewer points.
std::vector<Point2> cut(const Triangle& triangle, double height_m) {
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

}  // namespace

std::size_t sector_of(double azimuth_rad) {
  const auto steps = std::lround(azimuth_rad / kSectorRad);
  constexpr long count = shape_directions;
  return static_cast<std::size_t>(((steps % count) + count) % count);
}

Surroundings surroundings_of(const simulation::PlaceRecording& place, Point2 position) {
  constexpr std::size_t kRays = 120;
  constexpr std::array kHeightsM{0.3, 0.6, 0.9};
  Surroundings result;
  Directional nearness{};
  Directional rays{};
  Directional shift{};
  for (std::size_t ray = 0; ray < kRays; ++ray) {
    const double azimuth = 2.0 * std::numbers::pi * static_cast<double>(ray) / kRays;
    for (const double height : kHeightsM) {
      const double free_m = place.renderer->distance_along({position.x_m, position.y_m, height},
                                                           Direction3::from_angles(azimuth, 0.0));
      const double near = std::isfinite(free_m) ? 1.0 / std::max(free_m, 0.01) : 0.0;
      const std::size_t sector = sector_of(azimuth);
      nearness[sector] += near;
      rays[sector] += 1.0;
      for (std::size_t direction = 0; direction < shape_directions; ++direction) {
        const double theta = kSectorRad * static_cast<double>(direction);
        shift[direction] += std::abs(std::sin(azimuth - theta)) * near;
      }
    }
  }
  for (std::size_t i = 0; i < shape_directions; ++i) {
    // Nothing all around, as outdoors: farther than any room.
    constexpr double kFarM = 1000.0;
    result.free_m[i] = nearness[i] > 0.0 ? rays[i] / nearness[i] : kFarM;
    result.parallax_m[i] =
        shift[i] > 0.0 ? static_cast<double>(kRays * kHeightsM.size()) / shift[i] : kFarM;
  }
  return result;
}

Directional predicted_extents(const simulation::PlaceRecording& place, const Pose2& pose,
                              const Panorama& view, int components) {
  require(view.elevations().has_value(), "elevations of the view", 0.0, "known");
  using Complex = std::complex<double>;
  const FourierSignature signature = compute_signature(view, components);
  const double column_rad = 2.0 * std::numbers::pi / view.columns();
  const double row_rad = (view.elevations()->top_rad - view.elevations()->bottom_rad) / view.rows();
  const auto count = static_cast<std::size_t>(components);
  Directional change{};
  for (int y = 0; y < view.rows(); ++y) {
    const double elevation = view.elevation_rad(y);
    const int above = std::max(y - 1, 0);
    const int below = std::min(y + 1, view.rows() - 1);
    // How the components of this row change per metre along x and y of the robot.
    std::vector<Complex> along_x(count);
    std::vector<Complex> along_y(count);
    for (int c = 0; c < view.columns(); ++c) {
      const double azimuth = view.azimuth_rad(c);
      const double range_m = place.renderer->distance_along(
          {pose.x_m, pose.y_m, place.scene.camera_height_m},
          Direction3::from_angles(azimuth + pose.heading_rad, elevation));
      if (!std::isfinite(range_m) || range_m <= 0.0) continue;
      const int left = (c + 1) % view.columns();
      const int right = (c + view.columns() - 1) % view.columns();
      const double around = (view.at(y, left) - view.at(y, right)) / (2.0 * column_rad);
      const double upwards =
          above == below ? 0.0
                         : (view.at(above, c) - view.at(below, c)) / ((below - above) * row_rad);
      // A step along theta turns what is seen by sin(azimuth - theta) / (range cos(elevation)), and
      // lifts it by cos(azimuth - theta) sin(elevation) / range.
      const double turn = around / (range_m * std::max(std::cos(elevation), 1e-3));
      const double lift = upwards * std::sin(elevation) / range_m;
      const double x = turn * std::sin(azimuth) + lift * std::cos(azimuth);
      const double y_part = -turn * std::cos(azimuth) + lift * std::sin(azimuth);
      for (std::size_t k = 0; k < count; ++k) {
        const Complex wave = std::polar(1.0, -static_cast<double>(k) * azimuth);
        along_x[k] += x * wave;
        along_y[k] += y_part * wave;
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      // The part along the component itself changes its magnitude, the rest its phase.
      const Complex unit =
          std::polar(1.0, -static_cast<double>(signature.phase_rad(y, static_cast<int>(k))));
      const double per_x = (along_x[k] * unit).real();
      const double per_y = (along_y[k] * unit).real();
      for (std::size_t i = 0; i < shape_directions; ++i) {
        const double theta = kSectorRad * static_cast<double>(i) - pose.heading_rad;
        change[i] += std::abs(per_x * std::cos(theta) + per_y * std::sin(theta));
      }
    }
  }
  Directional extents{};
  for (std::size_t i = 0; i < shape_directions; ++i) {
    extents[i] = change[i] > 0.0 ? 1.0 / change[i] : 0.0;
  }
  return extents;
}

std::vector<MapLayer> scene_layers(const simulation::Scene& scene) {
  constexpr double lowest_m = 0.1;    // carpets and sills do not count
  constexpr double headroom_m = 1.9;  // nor do lamps, lintels and ceilings
  constexpr double room_m = 4.0;      // what is as large is cut through, not seen from above
  constexpr double around_m = 3.0;    // far trees would make the floor a spot
  constexpr std::size_t max_bodies = 30;
  MapLayer walls{.label = "walls", .colour = PlotColour::dark_grey};
  MapLayer things{.label = "furniture and other things", .colour = PlotColour::grey};
  const auto is_near = [&](const std::vector<Point2>& points) {
    return std::ranges::any_of(points, [&](const Point2& p) {
      return p.x_m > scene.floor_low.x_m - around_m && p.x_m < scene.floor_high.x_m + around_m &&
             p.y_m > scene.floor_low.y_m - around_m && p.y_m < scene.floor_high.y_m + around_m;
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
    std::vector<std::vector<Triangle>> bodies = bodies_of(object);
    if (bodies.size() > max_bodies) bodies = {object};
    std::vector<std::vector<Point2>> thin;
    std::size_t solid = 0;
    for (const std::vector<Triangle>& body : bodies) {
      std::vector<Point2> corners;
      double bottom_m = std::numeric_limits<double>::infinity();
      double top_m = -bottom_m;
      for (const Triangle& triangle : body) {
        for (const simulation::Vector3& v : triangle) {
          corners.push_back({v.x_m, v.y_m});
          bottom_m = std::min(bottom_m, v.z_m);
          top_m = std::max(top_m, v.z_m);
        }
      }
      if (top_m < lowest_m || bottom_m > headroom_m || !is_near(corners)) continue;
      const std::vector<Point2> outline = convex_hull(std::move(corners));
      const auto [west, east] = std::ranges::minmax(outline, {}, &Point2::x_m);
      const auto [south, north] = std::ranges::minmax(outline, {}, &Point2::y_m);
      if (std::max(east.x_m - west.x_m, north.y_m - south.y_m) > room_m) {
        for (const Triangle& triangle : body) {
          std::vector<Point2> line = cut(triangle, scene.camera_height_m);
          if (line.size() == 2 && is_near(line)) walls.lines.push_back(std::move(line));
        }
      } else if (outline.size() == 2) {
        thin.push_back(outline);
      } else {
        things.filled_polygons.push_back(outline);
        ++solid;
      }
    }
    // A screen or a wall; not the faces of a shelf.
    if (solid == 0) walls.lines.insert(walls.lines.end(), thin.begin(), thin.end());
  }
  return {things, walls};
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
