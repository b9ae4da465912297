#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/route/chain_code.hpp"

namespace panonav::lab {

/// Errors of the odometry of all routes: distances 5 % wrong, and a heading error as of wheels.
inline constexpr ChainOdometry route_odometry{0.05, radians(0.5), 0.0};

/// A picture on a route, and the motion since the picture before it.
struct RoutePicture {
  Panorama panorama;  ///< column 0 straight ahead; all pictures of a route have one shape
  Pose2 moved;        ///< robot_old_from_robot_new by odometry
};

/// The next step of the robot after a picture.
struct RouteDirection {
  double turn_rad = 0.0;   ///< direction of the next step in the robot frame
  double advance_m = 0.3;  ///< length of the next step
  std::optional<std::size_t> place =
      std::nullopt;          ///< number of the learnt picture at which the robot is
  bool has_arrived = false;  ///< the method reports the end of the route
  bool is_lost = false;      ///< the method reports that it has lost the route
};

/// A method that learns a route from its pictures and leads a robot along it.
class RouteMethod {
 public:
  virtual ~RouteMethod() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Replaces what was learnt by a route: pictures about 0.1 m apart, headings along the path.
  /// Throws ContractError on fewer than two pictures.
  virtual void learn(std::span<const RoutePicture> pictures) = 0;
  /// Leads the robot on after a picture; the first one is near the start of the route, heading
  /// roughly along it.
  [[nodiscard]] virtual RouteDirection steer(const RoutePicture& picture) = 0;
  /// Bytes of what was learnt.
  [[nodiscard]] virtual double bytes() const = 0;
  /// True if the method knows where the route ends and where it has lost it.
  [[nodiscard]] virtual bool reports_arrival() const { return false; }
};

/// Throws ContractError on fewer than two pictures.
void require_route(std::span<const RoutePicture> pictures);

/// A picture as the familiarity methods see it: 72 x 10 grey values, in all headings of a scan,
/// from 60 degrees to the right to 60 degrees to the left, every 5 degrees.
class HeadingScan {
 public:
  static constexpr int columns = 72;
  static constexpr int rows = 10;
  static constexpr int headings = 25;
  static constexpr int ahead = headings / 2;  ///< number of the heading straight ahead

  /// Throws ContractError unless the panorama has at least 72 x 10 values.
  explicit HeadingScan(const Panorama& panorama);
  /// Row-major values of the view after a turn to this heading.
  [[nodiscard]] std::span<const float> view(int heading) const {
    return std::span(values_).subspan(static_cast<std::size_t>(heading) * rows * columns,
                                      static_cast<std::size_t>(rows) * columns);
  }
  [[nodiscard]] static double turn_rad(int heading);

 private:
  std::vector<float> values_;
};

/// Returns a panorama of fewer rows and columns, whose values are means of equal blocks as far as
/// the numbers divide.
[[nodiscard]] Panorama shrink_panorama(const Panorama& panorama, int rows, int columns);

/// Keeps every third picture and moves in the heading whose view differs least from any of them
/// (rotational image difference, Zeil et al. 2003; perfect memory, Baddeley et al. 2012).
[[nodiscard]] std::unique_ptr<RouteMethod> make_perfect_memory();
/// Moves in the most familiar heading by the Infomax network of Baddeley et al. 2012, with as many
/// novelty units as pixels; each picture is seen once.
[[nodiscard]] std::unique_ptr<RouteMethod> make_infomax_network();
/// Moves in the most familiar heading by the mushroom body of Ardin et al. 2016: 360 projection
/// neurons, 20,000 Kenyon cells of 10 random inputs each, 1 % of which fire, and one output neuron
/// whose synapses from cells that fired on the route are silent. Spikes are replaced by rates.
[[nodiscard]] std::unique_ptr<RouteMethod> make_mushroom_body();
/// Finds the place by the best sequence of differences of patch-normalised pictures (Milford and
/// Wyeth 2012) and takes the heading in which the picture fits the one learnt there.
[[nodiscard]] std::unique_ptr<RouteMethod> make_sequence_matching();
/// Homes from picture to picture, 1 m apart, by min-warping (Möller, Krzykawski and Gerstmayr
/// 2010): the direction and turn for which the columns of both pictures fit best, each at the
/// distance that suits it.
[[nodiscard]] std::unique_ptr<RouteMethod> make_min_warping();

/// Home direction and turn between two pictures by min-warping.
struct Warp {
  double home_rad = 0.0;  ///< direction to the snapshot in the frame of the current view
  double turn_rad = 0.0;  ///< heading of the current view minus that of the snapshot
  double cost = 0.0;      ///< mean difference of the columns, 0 .. 1
};
/// Compares a current view with a snapshot of the same shape and known elevations, over turns up to
/// 60 degrees. Throws ContractError on different shapes.
[[nodiscard]] Warp compute_min_warp(const Panorama& snapshot, const Panorama& current);

/// The chain of packed snapshots of this library.
[[nodiscard]] std::unique_ptr<RouteMethod> make_snapshot_chain();
/// The same follower with the layout of van Dijk et al. 2024: the horizon row alone, 17
/// coefficients of a byte each.
[[nodiscard]] std::unique_ptr<RouteMethod> make_horizon_chain();
/// The route panorama of this library, a line of the horizon every 0.1 m.
[[nodiscard]] std::unique_ptr<RouteMethod> make_route_panorama();

}  // namespace panonav::lab
