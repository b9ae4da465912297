#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/navigation/explorer.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/route/chain_helm.hpp"

namespace panonav {

/// Writes the memory file of an exploration: its views, and their map at the end.
class ExplorationMemory {
 public:
  /// The file must be new. Throws FileError if it exists.
  ExplorationMemory(const std::filesystem::path& memory, const PictureSource& source,
                    const SignatureOptions& signature = {},
                    const PreprocessingOptions& preprocessing = {});

  /// Adds the observation of a decision to memorise, as "view_1", "view_2" and so on. Its pose from
  /// a data set is left out. Throws as `Memoriser::add`.
  void add(Observation view);
  /// Writes all views and stores the explorer's map of them, in metres. Throws as
  /// `Memoriser::finish`.
  void finish(const Explorer& explorer, Executor& executor);

 private:
  Memoriser memoriser_;
  std::vector<std::string> names_;
};

/// Options of an exploring robot.
struct RobotExplorerOptions {
  ExplorationOptions exploration;      ///< options of decisions
  BaseOptions base;                    ///< drive of the robot, and limits of its velocity commands
  OdometryNoise odometry;              ///< errors of the odometry
  double robot_radius_m = 0.2;         ///< radius around the camera that the robot needs, >= 0
  bool has_ranges = false;             ///< `SensedObstacles` contain ranges
  SignatureOptions signature;          ///< of the new memory
  PreprocessingOptions preprocessing;  ///< of the new memory
};

/// Obstacles that the robot sensed since the last observation.
struct SensedObstacles {
  /// Direction in which it touches an obstacle, in the current robot frame.
  std::optional<double> contact_rad;
  /// Ranges from the camera's position; empty if the robot has none.
  std::span<const ExplorationReport::Range> ranges;
};

/// Drives a robot that makes a memory of an unknown place by itself (`Explorer`): takes an image
/// with odometry, returns a velocity, and writes the views. Backs off after a contact. A motion
/// that takes too long although less than half of it is driven counts as a contact ahead. One
/// thread at a time.
class RobotExplorer {
 public:
  /// The robot's next motion after an observation.
  struct Step {
    ExplorationDecision decision;  ///< the latest decision
    Velocity velocity;             ///< until the next observation; 0 at the end
    bool decided = false;          ///< true: this observation led to a new decision
  };

  /// `memory`: a new file. `source`: layout of the images. Throws FileError if the file exists;
  /// OptionError, ContractError.
  RobotExplorer(const std::filesystem::path& memory, const PictureSource& source,
                const RobotExplorerOptions& options = {});

  /// Returns the next motion; call it for each image. Evaluates the image only for a new decision:
  /// when the last motion is completed by odometry, or when a contact ended it. Throws
  /// ContractError on an observation without odometry; else as `ViewEncoder::signature` and
  /// `Memoriser::add`.
  [[nodiscard]] Step step(const Observation& observation, const SensedObstacles& sensed = {});
  /// Writes all views and their map; does nothing without a view. Throws FileError.
  void finish();

  /// Returns the decisions' explorer, with poses, progress and path length.
  [[nodiscard]] const Explorer& explorer() const noexcept { return explorer_; }
  /// Returns the state after the last decision.
  [[nodiscard]] ExplorationDecision::State state() const noexcept {
    return last_step_.decision.state;
  }
  /// Returns map_from_odometry at the last decision. The map's origin is the first view.
  [[nodiscard]] Pose2 map_from_odometry() const;

 private:
  // A contact from which the robot backs off.
  struct Contact {
    Pose2 odometry;  // robot at the contact
    double contact_rad = 0.0;
    double course_rad = 0.0;
    double started_s = 0.0;
  };
  void advance_time(const Observation& observation);
  [[nodiscard]] bool is_overdue() const;
  [[nodiscard]] std::optional<Contact> find_contact(const SensedObstacles& sensed,
                                                    const Pose2& odometry) const;
  [[nodiscard]] bool has_backed_off(const Pose2& odometry) const;
  [[nodiscard]] Velocity compute_back_off_velocity() const;
  void decide(const Observation& observation, const SensedObstacles& sensed);

  RobotExplorerOptions options_;
  PictureSource source_;
  ExplorationMemory memory_;
  Explorer explorer_;
  std::optional<ViewEncoder> encoder_;  // made of the first image
  ChainHelm helm_;
  Step last_step_;
  std::optional<Contact> contact_;
  Pose2 decided_at_;  // by odometry
  double time_s_ = 0.0;
  double decided_s_ = 0.0;  // when the last motion began
  std::optional<double> stamp_s_;
};

}  // namespace panonav
