#include "panonav/homing/homing_survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "panonav/core/error.hpp"
#include "panonav/geometry/point_grid.hpp"
#include "panonav/geometry/position_bound.hpp"

namespace panonav {

namespace {

/// Tolerance of distances, so that a step of exactly the limit is accepted in spite of rounding.
constexpr double distance_tolerance_m = 1e-9;

// Finds the place nearest to a point, if one is within a fixed reach.
class PlaceFinder {
 public:
  PlaceFinder(std::span<const Pose2> places, double reach_m)
      : reach_m_(reach_m + distance_tolerance_m), grid_(reach_m_) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      grid_.add(static_cast<std::uint32_t>(i), places[i].position());
    }
  }

  /// Returns the nearest place, of equally near ones the first; `otherwise` if none is in reach.
  [[nodiscard]] std::uint32_t find_nearest(Point2 point, std::uint32_t otherwise) const {
    std::uint32_t best = otherwise;
    double best_square = reach_m_ * reach_m_;
    bool found = false;
    grid_.visit_near(point, [&](std::uint32_t i, Point2 position) {
      const double ex = position.x_m - point.x_m;
      const double ey = position.y_m - point.y_m;
      const double square = ex * ex + ey * ey;
      if (square > best_square || (found && square == best_square && i >= best)) return;
      best = i;
      best_square = square;
      found = true;
    });
    return best;
  }

 private:
  double reach_m_;
  PointGrid grid_;
};

void check_poses(std::span<const Pose2> poses, const char* what) {
  require(!poses.empty(), what, 0, ">= 1");
  constexpr double farthest_m = 1e6;  // so that cells can be counted
  for (const Pose2& pose : poses) {
    for (const double value : {pose.x_m, pose.y_m, pose.heading_rad}) {
      require(std::abs(value) <= farthest_m, what, value, "-1e6 .. 1e6");
    }
  }
}

}  // namespace

void visit_options(HomingSurveyOptions& options, OptionVisitor& visitor) {
  using T = HomingSurveyOptions;
  constexpr OptionTable table{
      option<&T::typical_distance_m>(
          "typical distance of objects: the length in metres of a home vector of length 1", 1e-3,
          1e3),
      option<&T::max_step_m>("longest step between two views", 1e-3, 1e3),
      option<&T::obstacle_m>("largest distance from the end of a step to the nearest place with a "
                             "view; a larger distance stops the run",
                             1e-3, 1e3),
      option<&T::max_steps>("largest number of steps of a run", 1, 1e6),
  };
  table.visit(options, visitor);
}

HomingSurvey survey_homing(std::span<const Pose2> goals, std::span<const Pose2> places,
                           const HomingRule& rule, const HomingSurveyOptions& options,
                           Executor& executor, const SurveyProgress& progress) {
  validate(options);
  check_poses(goals, "goals");
  check_poses(places, "places");
  HomingSurvey survey{{goals.begin(), goals.end()}, {places.begin(), places.end()}, {}, {}};
  survey.next.resize(goals.size() * places.size());
  survey.homeward.resize(goals.size() * places.size());
  const PlaceFinder finder(places, options.obstacle_m);
  std::mutex mutex;
  std::size_t done = 0;
  executor.for_each_chunk(goals.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t g = begin; g < end; ++g) {
      for (std::size_t p = 0; p < places.size(); ++p) {
        const Pose2& here = places[p];
        const HomeVector vector = rule(g, p);
        const double length = vector.length();
        const double cosine = std::cos(here.heading_rad);
        const double sine = std::sin(here.heading_rad);
        const double x = cosine * vector.xi - sine * vector.eta;
        const double y = sine * vector.xi + cosine * vector.eta;
        const double home_x = goals[g].x_m - here.x_m;
        const double home_y = goals[g].y_m - here.y_m;
        const double home_m = std::hypot(home_x, home_y);
        const std::size_t pair = g * places.size() + p;
        survey.homeward[pair] =
            home_m > distance_tolerance_m
                ? static_cast<float>(length > 0.0 ? (x * home_x + y * home_y) / (length * home_m)
                                                  : 0.0)
                : std::numeric_limits<float>::quiet_NaN();
        auto next = static_cast<std::uint32_t>(p);
        if (length > 0.0) {
          const double step_m = std::min(options.max_step_m, options.typical_distance_m * length);
          next = finder.find_nearest(
              {here.x_m + step_m * x / length, here.y_m + step_m * y / length}, next);
        }
        survey.next[pair] = next;
      }
    }
    if (!progress) return;
    const std::lock_guard lock(mutex);
    done += end - begin;
    progress(static_cast<double>(done) / static_cast<double>(goals.size()));
  });
  return survey;
}

std::vector<HomingSurvey::Bin> homeward_by_distance(const HomingSurvey& survey, double bin_m) {
  // Limits the memory of the bins, 24 bytes each; plots need fewer points.
  constexpr double max_bins = 1e5;
  double farthest_m = 0.0;
  for (const Pose2& goal : survey.goals) {
    for (const Pose2& place : survey.places) {
      farthest_m = std::max(farthest_m, distance(goal.position(), place.position()));
    }
  }
  const double min_bin_m = farthest_m / max_bins;
  require(bin_m > 0.0 && bin_m >= min_bin_m && bin_m <= max_position_m, "the option bin_m", bin_m,
          (farthest_m > 0.0 ? to_text(min_bin_m) : "above 0") + " to " + to_text(max_position_m) +
              " m, at most 100000 bins");
  std::vector<HomingSurvey::Bin> bins;
  for (std::size_t g = 0; g < survey.goals.size(); ++g) {
    const auto homeward = survey.homeward_of(g);
    for (std::size_t p = 0; p < homeward.size(); ++p) {
      if (std::isnan(homeward[p])) continue;
      const double away_m = distance(survey.goals[g].position(), survey.places[p].position());
      const auto bin = static_cast<std::size_t>(std::floor(away_m / bin_m + 0.5));
      if (bin >= bins.size()) bins.resize(bin + 1);
      ++bins[bin].pairs;
      bins[bin].component += static_cast<double>(homeward[p]);
    }
  }
  for (std::size_t i = 0; i < bins.size(); ++i) {
    bins[i].distance_m = static_cast<double>(i) * bin_m;
    bins[i].component = bins[i].pairs > 0 ? bins[i].component / static_cast<double>(bins[i].pairs)
                                          : std::numeric_limits<double>::quiet_NaN();
  }
  return bins;
}

double mean_homeward_component(const HomingSurvey& survey, double max_m) {
  double sum = 0.0;
  std::size_t pairs = 0;
  for (std::size_t g = 0; g < survey.goals.size(); ++g) {
    const auto homeward = survey.homeward_of(g);
    for (std::size_t p = 0; p < homeward.size(); ++p) {
      if (std::isnan(homeward[p])) continue;
      const double away_m = distance(survey.goals[g].position(), survey.places[p].position());
      if (away_m > max_m + distance_tolerance_m) continue;
      ++pairs;
      sum += static_cast<double>(homeward[p]);
    }
  }
  return pairs > 0 ? sum / static_cast<double>(pairs) : std::numeric_limits<double>::quiet_NaN();
}

std::vector<std::uint32_t> final_places(std::span<const HomingSurvey* const> stages,
                                        std::size_t goal, const HomingSurveyOptions& options) {
  require(!stages.empty(), "stages", 0, ">= 1");
  const std::size_t places = stages[0]->places.size();
  for (const HomingSurvey* const stage : stages) {
    require(stage->places.size() == places && stage->goals.size() == stages[0]->goals.size(),
            "places of a stage", static_cast<double>(stage->places.size()),
            "as in the first stage");
  }
  require(goal < stages[0]->goals.size(), "goal", static_cast<double>(goal), "one of the survey's");
  std::vector<std::uint32_t> at(places);
  for (std::size_t p = 0; p < places; ++p) {
    auto place = static_cast<std::uint32_t>(p);
    for (const HomingSurvey* const stage : stages) {
      const auto next = stage->next_of(goal);
      for (int step = 0; step < options.max_steps; ++step) {
        const std::uint32_t to = next[place];
        if (to == place) break;
        place = to;
      }
    }
    at[p] = place;
  }
  return at;
}

std::vector<float> final_distances(std::span<const HomingSurvey* const> stages,
                                   const HomingSurveyOptions& options, Executor& executor) {
  require(!stages.empty(), "stages", 0, ">= 1");
  const HomingSurvey& first = *stages[0];
  std::vector<float> distances(first.goals.size() * first.places.size());
  executor.for_each_chunk(
      first.goals.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t g = begin; g < end; ++g) {
          const auto ends = final_places(stages, g, options);
          for (std::size_t p = 0; p < ends.size(); ++p) {
            distances[g * ends.size() + p] = static_cast<float>(
                distance(first.goals[g].position(), first.places[ends[p]].position()));
          }
        }
      });
  return distances;
}

std::vector<double> mean_catchment_areas(std::span<const float> distances, std::size_t goals,
                                         std::span<const double> accepted_m) {
  require(goals >= 1, "goals", static_cast<double>(goals), ">= 1");
  std::vector<double> areas;
  for (const double accepted : accepted_m) {
    const auto inside = std::ranges::count_if(distances, [&](float away_m) {
      return static_cast<double>(away_m) <= accepted + 1e-6;  // distances are single precision
    });
    areas.push_back(static_cast<double>(inside) / static_cast<double>(goals));
  }
  return areas;
}

}  // namespace panonav
