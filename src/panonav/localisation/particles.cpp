#include "panonav/localisation/particles.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

double position_spread_m(const Particles& particles) {
  if (particles.empty()) return 0.0;
  // Sums relative to the first particle, so that precision is not lost far from the origin.
  const Point2 anchor = particles.position(0);
  double weight = 0.0;
  double first_x = 0.0;
  double first_y = 0.0;
  double second = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double x = particles.x_m[i] - anchor.x_m;
    const double y = particles.y_m[i] - anchor.y_m;
    const double w = particles.weight[i];
    weight += w;
    first_x += w * x;
    first_y += w * y;
    second += w * (x * x + y * y);
  }
  if (!(weight > 0.0)) return 0.0;
  const double x = first_x / weight;
  const double y = first_y / weight;
  return std::sqrt(std::max(0.0, second / weight - x * x - y * y));
}

}  // namespace panonav
