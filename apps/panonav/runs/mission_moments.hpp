#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav_recordings/run_recorder.hpp"
#include "panonav_simulation/mission.hpp"
#include "runs/run_record.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

/// Makes the moments of a mission for its record. Their stamps count the decisions; the pose is the
/// true one, as none is estimated. The robot and what it remembers must outlive it.
class MissionMoments {
 public:
  MissionMoments(const RobotNavigator& robot, const simulation::RememberedPlace& remembered,
                 const FieldOptions& field)
      : robot_(robot), remembered_(remembered), field_(field) {}

  /// Stores the robot's view for the next moment.
  void set_image(const Image& image, const Panorama& panorama);
  /// Makes the moment of a decision.
  [[nodiscard]] recordings::RunMoment make(const NavigationDecision& decision, const Pose2& pose,
                                           const simulation::Scene& scene);
  /// Begins to measure the next moment's stages.
  void restart_clock() { clock_.restart(); }

 private:
  [[nodiscard]] std::vector<Pose2> planned_path(ViewId from) const;
  [[nodiscard]] recordings::RunHoming homing() const;
  void add_field(recordings::RunMoment& moment) const;

  const RobotNavigator& robot_;
  const simulation::RememberedPlace& remembered_;
  FieldOptions field_;
  std::optional<Image> image_;
  std::optional<Panorama> panorama_;
  std::vector<Pose2> plan_;
  std::size_t number_ = 0;
  std::optional<ViewId> shown_goal_;
  StageClock clock_;
};

/// Sends the robot to the remembered view nearest to where a viewer has clicked, and returns the
/// view; nullopt where no viewer did, or no path leads there.
[[nodiscard]] std::optional<ViewId> set_goal_of_viewer(
    RobotNavigator& robot, const simulation::RememberedPlace& remembered, RunRecord& record,
    Session& session);

}  // namespace panonav::command
