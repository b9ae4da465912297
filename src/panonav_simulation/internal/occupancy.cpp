#include "panonav_simulation/internal/occupancy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace panonav::simulation {

namespace {

// Returns the part of a convex polygon on one side of a plane across an axis, where sign *
// (coordinate - limit) >= 0.
template <double Vector3::*coordinate>
std::vector<Vector3> clip(const std::vector<Vector3>& polygon, double limit, double sign) {
  std::vector<Vector3> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3& a = polygon[i];
    const Vector3& b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a.*coordinate - limit);
    const double db = sign * (b.*coordinate - limit);
    if (da >= 0.0) result.push_back(a);
    if ((da >= 0.0) != (db >= 0.0)) {
      const double t = da / (da - db);
      Vector3& cut = result.emplace_back(Vector3{
          a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m), a.z_m + t * (b.z_m - a.z_m)});
      cut.*coordinate = limit;
    }
  }
  return result;
}

struct Interval {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// Returns the range of x over all points of the convex polygon with y in y_low .. y_high.
Interval find_x_range(const std::vector<Vector3>& polygon, double y_low, double y_high) {
  Interval span;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3& a = polygon[i];
    const Vector3& b = polygon[(i + 1) % polygon.size()];
    if (a.y_m >= y_low && a.y_m <= y_high) span.add(a.x_m);
    for (const double y : {y_low, y_high}) {
      if ((a.y_m < y) != (b.y_m < y)) {
        span.add(a.x_m + (y - a.y_m) / (b.y_m - a.y_m) * (b.x_m - a.x_m));
      }
    }
  }
  return span;
}

int clamp_cell(double coordinate, int count) {
  return static_cast<int>(std::clamp(std::floor(coordinate), -1.0, static_cast<double>(count)));
}

// Calls `visit(i, j)` for each cell that the convex polygon touches.
template <class Visit>
void for_each_touched_cell(const std::vector<Vector3>& polygon, const Raster& raster,
                           const Visit& visit) {
  Interval y;
  for (const Vector3& v : polygon) y.add(v.y_m);
  const int first = std::max(0, clamp_cell((y.low - raster.low.y_m) / raster.cell_m, raster.rows));
  const int last =
      std::min(raster.rows - 1, clamp_cell((y.high - raster.low.y_m) / raster.cell_m, raster.rows));
  for (int j = first; j <= last; ++j) {
    const double y_low = raster.low.y_m + j * raster.cell_m;
    const Interval x = find_x_range(polygon, y_low, y_low + raster.cell_m);
    if (!(x.low <= x.high)) continue;
    const int left =
        std::max(0, clamp_cell((x.low - raster.low.x_m) / raster.cell_m, raster.columns));
    const int right = std::min(
        raster.columns - 1, clamp_cell((x.high - raster.low.x_m) / raster.cell_m, raster.columns));
    for (int i = left; i <= right; ++i) visit(i, j);
  }
}

std::size_t cell_index(const Raster& raster, int i, int j) {
  return static_cast<std::size_t>(j) * static_cast<std::size_t>(raster.columns) +
         static_cast<std::size_t>(i);
}

Point2 cell_centre(const Raster& raster, int i, int j) {
  return {raster.low.x_m + (i + 0.5) * raster.cell_m, raster.low.y_m + (j + 0.5) * raster.cell_m};
}

// A triangle, to compare its height with that of the ground.
class TriangleAboveGround {
 public:
  explicit TriangleAboveGround(const std::vector<Vector3>& corners) : corners_(corners) {
    const Vector3& a = corners[0];
    const double ux = corners[1].x_m - a.x_m;
    const double uy = corners[1].y_m - a.y_m;
    const double uz = corners[1].z_m - a.z_m;
    const double vx = corners[2].x_m - a.x_m;
    const double vy = corners[2].y_m - a.y_m;
    const double vz = corners[2].z_m - a.z_m;
    const double normal_z = ux * vy - uy * vx;
    const double fall_x = uy * vz - uz * vy;
    const double fall_y = uz * vx - ux * vz;
    is_steep_ = std::hypot(fall_x, fall_y) >= std::abs(normal_z);
    if (is_steep_) return;
    slope_x_ = -fall_x / normal_z;
    slope_y_ = -fall_y / normal_z;
  }

  // Returns the range of the heights above the ground within the cell around `centre`.
  [[nodiscard]] Interval range_in_cell(const Ground::Plane& ground, Point2 centre,
                                       double cell_m) const {
    Interval range;
    if (!is_steep_) {
      const double x_m = centre.x_m - corners_[0].x_m;
      const double y_m = centre.y_m - corners_[0].y_m;
      const double middle_m =
          corners_[0].z_m + slope_x_ * x_m + slope_y_ * y_m - static_cast<double>(ground.z_m);
      const double half_m = 0.5 * cell_m *
                            (std::abs(slope_x_ - static_cast<double>(ground.slope_x)) +
                             std::abs(slope_y_ - static_cast<double>(ground.slope_y)));
      return {middle_m - half_m, middle_m + half_m};
    }
    // A little larger than the cell, so that rounding does not lose walls along its border.
    const double half_m = 0.5001 * cell_m;
    std::vector<Vector3> part = corners_;
    for (const double side : {-1.0, 1.0}) {
      part = clip<&Vector3::x_m>(part, centre.x_m + side * half_m, -side);
      part = clip<&Vector3::y_m>(part, centre.y_m + side * half_m, -side);
    }
    for (const Vector3& corner : part) {
      range.add(corner.z_m - static_cast<double>(ground.z_m) -
                static_cast<double>(ground.slope_x) * (corner.x_m - centre.x_m) -
                static_cast<double>(ground.slope_y) * (corner.y_m - centre.y_m));
    }
    return range;
  }

 private:
  const std::vector<Vector3>& corners_;
  bool is_steep_ = false;
  double slope_x_ = 0.0;
  double slope_y_ = 0.0;
};

// Computes the minimum over q of the parabolas f(q) + (p - q)^2, at every p.
void transform_distances(const std::vector<float>& f, std::vector<float>& result,
                         std::vector<int>& envelope_roots, std::vector<float>& envelope_borders) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const int n = static_cast<int>(f.size());
  int last = -1;
  for (int q = 0; q < n; ++q) {
    const float fq = f[static_cast<std::size_t>(q)];
    if (fq == infinity) continue;
    float border = -infinity;
    while (last >= 0) {
      const int r = envelope_roots[static_cast<std::size_t>(last)];
      const auto qf = static_cast<double>(q);
      const auto rf = static_cast<double>(r);
      border = static_cast<float>(((fq + qf * qf) - (f[static_cast<std::size_t>(r)] + rf * rf)) /
                                  (2.0 * (qf - rf)));
      if (border > envelope_borders[static_cast<std::size_t>(last)]) break;
      border = -infinity;
      --last;
    }
    ++last;
    envelope_roots[static_cast<std::size_t>(last)] = q;
    envelope_borders[static_cast<std::size_t>(last)] = border;
  }
  if (last < 0) {
    std::fill(result.begin(), result.end(), infinity);
    return;
  }
  int k = 0;
  for (int p = 0; p < n; ++p) {
    while (k < last && envelope_borders[static_cast<std::size_t>(k) + 1] < static_cast<float>(p))
      ++k;
    const int r = envelope_roots[static_cast<std::size_t>(k)];
    const auto d = static_cast<float>(p - r);
    result[static_cast<std::size_t>(p)] = d * d + f[static_cast<std::size_t>(r)];
  }
}

}  // namespace

std::vector<std::uint8_t> find_occupied_cells(const Scene& scene, const Raster& raster,
                                              double low_z_m, double high_z_m) {
  std::vector<std::uint8_t> cells(
      static_cast<std::size_t>(raster.columns) * static_cast<std::size_t>(raster.rows), 0);
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& triangle : mesh.triangles) {
      std::vector<Vector3> polygon{mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                                   mesh.vertices[triangle[2]]};
      const auto [lowest, highest] = std::minmax({polygon[0].z_m, polygon[1].z_m, polygon[2].z_m});
      if (highest < low_z_m || lowest > high_z_m) continue;
      if (lowest < low_z_m) polygon = clip<&Vector3::z_m>(polygon, low_z_m, 1.0);
      if (highest > high_z_m) polygon = clip<&Vector3::z_m>(polygon, high_z_m, -1.0);
      if (polygon.empty()) continue;
      for_each_touched_cell(polygon, raster,
                            [&](int i, int j) { cells[cell_index(raster, i, j)] = 1; });
    }
  }
  return cells;
}

std::vector<std::uint8_t> find_cells_above_ground(const Scene& scene, const Raster& raster,
                                                  const Ground& ground, double low_m,
                                                  double high_m) {
  std::vector<Ground::Plane> planes;
  for (int j = 0; j < raster.rows; ++j) {
    for (int i = 0; i < raster.columns; ++i)
      planes.push_back(ground.plane_at(cell_centre(raster, i, j)));
  }
  std::vector<std::uint8_t> cells(planes.size(), 0);
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& t : mesh.triangles) {
      const std::vector<Vector3> corners{mesh.vertices[t[0]], mesh.vertices[t[1]],
                                         mesh.vertices[t[2]]};
      const TriangleAboveGround triangle(corners);
      for_each_touched_cell(corners, raster, [&](int i, int j) {
        const std::size_t k = cell_index(raster, i, j);
        if (cells[k] != 0) return;
        const Interval range =
            triangle.range_in_cell(planes[k], cell_centre(raster, i, j), raster.cell_m);
        if (range.high >= low_m && range.low <= high_m) cells[k] = 1;
      });
    }
  }
  return cells;
}

std::vector<float> compute_distances_to_cells(const std::vector<std::uint8_t>& cells,
                                              const Raster& raster) {
  const auto columns = static_cast<std::size_t>(raster.columns);
  const auto rows = static_cast<std::size_t>(raster.rows);
  std::vector<float> squared(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    squared[i] = cells[i] != 0 ? 0.0F : std::numeric_limits<float>::infinity();
  }
  const std::size_t longest = std::max(columns, rows);
  std::vector<int> envelope_roots(longest);
  std::vector<float> envelope_borders(longest);
  std::vector<float> line(rows);
  std::vector<float> result(rows);
  for (std::size_t i = 0; i < columns; ++i) {
    for (std::size_t j = 0; j < rows; ++j) line[j] = squared[j * columns + i];
    transform_distances(line, result, envelope_roots, envelope_borders);
    for (std::size_t j = 0; j < rows; ++j) squared[j * columns + i] = result[j];
  }
  line.resize(columns);
  result.resize(columns);
  for (std::size_t j = 0; j < rows; ++j) {
    std::copy_n(squared.begin() + static_cast<std::ptrdiff_t>(j * columns), columns, line.begin());
    transform_distances(line, result, envelope_roots, envelope_borders);
    std::transform(result.begin(), result.end(),
                   squared.begin() + static_cast<std::ptrdiff_t>(j * columns),
                   [](float d2) { return std::sqrt(d2); });
  }
  return squared;
}

}  // namespace panonav::simulation
