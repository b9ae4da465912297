#include "lab/runs/published_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::lab {

namespace {

/// Finds the reference nearest to a position.
class NearestReferences {
 public:
  explicit NearestReferences(const TrackingPlace& place) : cell_m_(place.spacing_m()) {
    for (const ViewId view : place.memory().views()) {
      const auto& pose = place.memory().info(view).pose;
      if (!pose) continue;
      cells_[cell_of(pose->position())].push_back(views_.size());
      views_.push_back(view);
      positions_.push_back(pose->position());
    }
  }

  /// Posed views, in the order of the indices that `find` returns.
  [[nodiscard]] const std::vector<ViewId>& views() const { return views_; }

  [[nodiscard]] std::size_t find(Point2 at) const {
    std::size_t nearest = 0;
    double nearest_m = std::numeric_limits<double>::infinity();
    const auto compare = [&](std::size_t i) {
      const double distance_m = distance(positions_[i], at);
      if (distance_m < nearest_m) {
        nearest_m = distance_m;
        nearest = i;
      }
    };
    const auto [x, y] = cell_of(at);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto cell = cells_.find({x + dx, y + dy});
        if (cell != cells_.end()) std::ranges::for_each(cell->second, compare);
      }
    }
    // Another cell may hold a nearer one only if none is within one cell's width.
    if (nearest_m > cell_m_) {
      for (std::size_t i = 0; i < positions_.size(); ++i) compare(i);
    }
    return nearest;
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;
  [[nodiscard]] Cell cell_of(Point2 at) const {
    return {std::llround(std::floor(at.x_m / cell_m_)), std::llround(std::floor(at.y_m / cell_m_))};
  }

  double cell_m_;
  std::map<Cell, std::vector<std::size_t>> cells_;
  std::vector<ViewId> views_;
  std::vector<Point2> positions_;
};

/// Returns the similarities of the view to `views`, from 0 to 1000.
std::vector<double> compute_similarities(const TrackingPlace& place, const PackedSignature& view,
                                         const std::vector<ViewId>& views) {
  std::vector<double> dissimilarities;
  for (const ViewId reference : views) {
    dissimilarities.push_back(dissimilarity_packed(view, place.memory().packed(reference)));
  }
  return similarities(dissimilarities);
}

std::vector<Pose2> resample_by_weights(const std::vector<Pose2>& particles,
                                       const std::vector<double>& weights, Random& random) {
  double sum = 0.0;
  for (const double weight : weights) sum += weight;
  if (!(sum > 0.0)) return particles;
  const double step = sum / static_cast<double>(particles.size());
  double target = random.uniform(0.0, step);
  double passed = weights.front();
  std::size_t i = 0;
  std::vector<Pose2> chosen;
  while (chosen.size() < particles.size()) {
    while (passed < target && i + 1 < particles.size()) passed += weights[++i];
    chosen.push_back(particles[i]);
    target += step;
  }
  return chosen;
}

TrackedImage describe_particles(const std::vector<Pose2>& particles, const Pose2& truth,
                                double spacing_m) {
  const auto count = static_cast<double>(particles.size());
  Point2 mean;
  for (const Pose2& particle : particles) {
    mean.x_m += particle.x_m / count;
    mean.y_m += particle.y_m / count;
  }
  double squares = 0.0;
  double heading_error_rad = 0.0;
  for (const Pose2& particle : particles) {
    squares += std::pow(distance(particle.position(), mean), 2) / count;
    heading_error_rad += angle_difference(particle.heading_rad, truth.heading_rad) / count;
  }
  TrackedImage image;
  image.state =
      std::sqrt(squares) <= spacing_m ? LocalisationState::localised : LocalisationState::ambiguous;
  image.answered = true;
  image.error_m = image.nearest_mode_m = distance(mean, truth.position());
  image.heading_error_rad = std::abs(heading_error_rad);
  image.modes = 1;
  image.particles = static_cast<int>(particles.size());
  return image;
}

/// Places particles uniformly within half a spacing of the references.
std::vector<Pose2> sample_memorised_area(const TrackingPlace& place, double heading_rad, int count,
                                         Random& random) {
  const std::vector<Point2> positions = place.reference_positions();
  const double half_m = 0.5 * place.spacing_m();
  std::vector<Pose2> particles;
  for (int i = 0; i < count; ++i) {
    const Point2 at = positions[random.index(positions.size())];
    particles.push_back({at.x_m + random.uniform(-half_m, half_m),
                         at.y_m + random.uniform(-half_m, half_m), heading_rad});
  }
  return particles;
}

}  // namespace

TrackedRun track_run_as_published(const TrackingPlace& place, const TrackingRun& run,
                                  const PublishedFilterSetting& setting, std::uint64_t seed) {
  const int count = setting.particles_per_reference
                        ? static_cast<int>(std::lround(*setting.particles_per_reference *
                                                       static_cast<double>(place.memory().size())))
                        : setting.particles;
  require(count >= 1, "particles", count, ">= 1");
  TrackedRun tracked;
  if (run.steps.empty()) return tracked;
  Random random(seed, 17);
  simulation::SimulatedOdometry odometry(setting.odometry, seed);
  std::vector<Pose2> particles =
      sample_memorised_area(place, run.steps.front().truth.heading_rad, count, random);
  Pose2 before = odometry.pose();
  const NearestReferences nearest(place);
  for (std::size_t i = 0; i < run.steps.size(); ++i) {
    const TrackingStep& step = run.steps[i];
    if (step.moved) {
      const Pose2 now = odometry.advance(*step.moved);
      const Pose2 moved = inverse(before) * now;
      for (Pose2& particle : particles) {
        particle = particle * sample_step(moved, setting.odometry, random);
      }
      before = now;
    }
    if (!step.view) continue;
    const auto similarity = compute_similarities(place, *step.view, nearest.views());
    std::vector<double> weights;
    for (const Pose2& particle : particles) {
      weights.push_back(similarity[nearest.find(particle.position())]);
    }
    particles = resample_by_weights(particles, weights, random);
    tracked.push_back(describe_particles(particles, step.truth, place.spacing_m()));
    tracked.back().step = i;
  }
  return tracked;
}

}  // namespace panonav::lab
