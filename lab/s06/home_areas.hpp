#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "panonav/route/home_area.hpp"
#include "panonav/route/home_finder.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::lab {

/// Names of the scenes in which homes are learnt.
[[nodiscard]] std::vector<std::string> list_home_scenes();

/// Makes a scene of 40 x 40 m: "forest" with a tree for each 15 m2, "garden" the built-in garden
/// and the meadow around it, "industrial_hall" with rows of shelves, crates and wardrobes. Throws
/// ContractError on another name.
[[nodiscard]] simulation::Scene make_home_scene(const std::string& name, std::uint64_t seed);

/// Extent of a learning walk and of the flights from home.
struct HomeTask {
  double radius_m = 3.0;        ///< of the learning walk
  int max_bytes = 1000;         ///< of the area
  double min_flight_m = 30.0;   ///< shortest way out
  double max_flight_m = 110.0;  ///< longest way out
  /// Drift that odometry does not see as a part of the way, each time in another direction.
  double wind = 0.0;
};

/// Measured motions between two true poses after each other: those of a simulated odometry that
/// does not see a constant wind.
class WindyOdometry {
 public:
  /// Draws the direction of the wind and the systematic errors.
  WindyOdometry(double wind, std::uint64_t seed);
  /// Returns the measured motion between two true poses.
  [[nodiscard]] Pose2 measure(const Pose2& from, const Pose2& to);

 private:
  Point2 wind_m_per_m_;
  simulation::SimulatedOdometry odometry_;
};

/// A home and what was learnt of it.
struct LearntHome {
  Pose2 home;           ///< true pose
  double walk_m = 0.0;  ///< length of the learning walk
  HomeArea area;
  /// Homeward component of a rival at the held-out views: the home vector as a linear function of
  /// the packed coefficients, by ridge regression over the other views, with a true compass.
  double regression_component = 0.0;
  /// The same of a network of 821 weights, as small as that of the flights of robotic bees.
  double network_component = 0.0;
};

/// Learns a random home of the place by a walk of petals around it. The same seed gives the same
/// home.
[[nodiscard]] LearntHome learn_home(const HomingPlace& place, const HomeTask& task,
                                    std::uint64_t seed, Executor& executor);

/// Result of a flight away from home and back.
struct HomeFlight {
  ChainState state = ChainState::travelling;  ///< at the end
  double out_m = 0.0;                         ///< length of the way out
  double back_m = 0.0;                        ///< length of the way back
  double odometry_error_m = 0.0;              ///< of the position at the end of the way out
  double end_distance_m = 0.0;                ///< from home

  /// True if the robot reports that it has arrived, within `radius_m` of home.
  [[nodiscard]] bool is_home(double radius_m) const noexcept;
  /// True if the robot reports that it has arrived elsewhere.
  [[nodiscard]] bool has_arrived_elsewhere(double radius_m) const noexcept;
};

/// Flies from home along random ways, then lets a `HomeFinder` lead the robot back; it drives
/// around obstacles after contact. The same seed gives the same flight.
[[nodiscard]] HomeFlight fly_home(const HomingPlace& place, const LearntHome& home,
                                  const HomeTask& task, std::uint64_t seed);

/// Measures two homes in each scene of `list_home_scenes`, and `flights` flights from each; with
/// one flight only one home in the last scene. Rows "s06.home.*".
void reproduce_home_areas(int flights, const Experiments& context);

}  // namespace panonav::lab
