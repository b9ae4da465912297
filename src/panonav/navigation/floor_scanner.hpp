#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// The free floor around a robot, in sectors of equal width. Sector i is centred on azimuth 2 pi i
/// / sectors in the robot frame, counter-clockwise, forward at 0.
struct FloorScan {
  /// Distance from the camera to the nearest obstacle of each sector; `max_range_m` if the floor is
  /// free up to there, nullopt where the pictures do not show it.
  std::vector<std::optional<double>> range_m;
  double max_range_m = 0.0;  ///< largest distance that was examined

  /// Returns the azimuth of the middle of a sector, in [-pi, pi).
  [[nodiscard]] double azimuth_rad(std::size_t sector) const noexcept;
};

/// Size of the robot, and range of its scans.
struct FloorScannerOptions {
  double camera_height_m = 0.6;  ///< of the single viewpoint above the floor, > 0
  double robot_radius_m = 0.2;   ///< > 0
  double max_range_m = 1.2;      ///< > `FloorScanner::min_range_m`
};

/// Measures the free floor around a robot with its camera and odometry, by two signs of obstacles.
///
/// Parallax: the floor moves by the homography of the ground plane, things on it like nearer
/// surfaces. Vertical surfaces compete with the floor in each sector (plane sweep), by the largest
/// sum of log-likelihood ratios over successive rows. The pictures also give the noise, and correct
/// the rotation by odometry.
///
/// Appearance: patches that the robot drove over are floor. It ends where successive patches differ
/// in brightness or contrast from all of these (after Ulrich and Nourbakhsh 2000), unless their
/// parallax is that of the floor.
///
/// The floor must be level and the camera upright. Before the robot has driven, nothing is known.
class FloorScanner {
 public:
  static constexpr int rows = 64;      ///< of the panoramas
  static constexpr int columns = 256;  ///< of the panoramas
  static constexpr int sectors = 64;   ///< of a scan
  /// Upper edge of the panoramas, just below the horizon.
  static constexpr double top_rad = -0.02;
  /// Distance of the nearest surfaces that are tried.
  static constexpr double min_range_m = 0.22;

  /// Throws ContractError on options out of range.
  explicit FloorScanner(const FloorScannerOptions& options);

  /// Adds a picture. `moved`: robot_old_from_robot_new since the last one, by odometry. A picture
  /// less than 2 cm from the last but one replaces the last. Throws ContractError unless the
  /// panorama has `rows` x `columns` values, the elevations of the first one, and its upper edge
  /// below the horizon. Cost: 1 ms.
  void add(const Panorama& view, const Pose2& moved);

  /// Measures the floor around the last picture. Cost: some 20 ms.
  [[nodiscard]] FloorScan scan() const;

 private:
  static constexpr int patch_size = 4;  // rows and columns of a patch
  static constexpr int bands = rows / patch_size;
  static_assert(columns / patch_size == sectors);

  struct Patch {
    float brightness = 0.0F;
    float log_contrast = 0.0F;
    bool is_learnt = false;
  };
  struct Frame {
    std::vector<float> values;   // without the local mean
    std::vector<Patch> patches;  // band * sectors + sector
    Pose2 path_from_robot;
  };
  /// Motion between two pictures, and the noise of their differences.
  struct Alignment {
    Pose2 reference_from_robot;
    double noise = 0.0;
  };
  /// Log-likelihood ratios of patches, summed over pictures: by patch, and distance of the surface.
  struct Evidence {
    std::vector<std::vector<double>> of_surface;  // against the floor
    std::vector<double> of_best;                  // largest of `of_surface`, at least 0
    std::vector<double> of_floor;                 // against the best surface
  };

  void set_elevations(const ElevationBand& elevations);
  void learn_floor();
  [[nodiscard]] double distance_to_floor(const Patch& patch) const;
  [[nodiscard]] double floor_limit() const;
  [[nodiscard]] std::vector<const Frame*> select_references() const;
  [[nodiscard]] double row_at_slope(double slope) const noexcept;
  [[nodiscard]] static float sample(const Frame& frame, double row, double column) noexcept;
  [[nodiscard]] Alignment align(const Frame& reference) const;
  void add_evidence(const Frame& reference, const std::vector<float>& gradients, double weight,
                    Evidence& evidence) const;
  [[nodiscard]] Evidence collect_evidence(const std::vector<const Frame*>& references) const;
  [[nodiscard]] double find_surface_m(const Evidence& evidence, int sector) const;
  [[nodiscard]] std::optional<double> find_end_of_floor_m(const Evidence& evidence, double limit,
                                                          int sector) const;

  FloorScannerOptions options_;
  std::vector<double> distances_m_;  // of the surfaces that are tried
  std::optional<ElevationBand> elevations_;
  std::vector<double> slopes_;        // tangent of the elevation, by row
  std::vector<double> row_by_slope_;  // at equal steps of the slope
  std::deque<Frame> frames_;
  std::deque<Patch> floor_;             // patches that the robot drove over, the oldest first
  std::deque<double> floor_distances_;  // of these to those before them
};

}  // namespace panonav
