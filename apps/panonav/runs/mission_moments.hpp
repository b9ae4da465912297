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

/// Makes the moments of a mission for its record. The stamp is the number of the decision; the pose
/// is the true one, as the robot estimates none. All arguments must outlive this object.
class MissionMoments {
 public:
  MissionMoments(const RobotNavigator& robot, const simulation::RememberedPlace& remembered,
                 const FieldOptions& field)
      : robot_(robot), remembered_(remembered), field_(field) {}

  /// Stores the robot's current image for the next moment.
  void set_image(const Image& image, const Panorama& panorama);
  /// Makes the moment of a decision.
  [[nodiscard]] recordings::RunMoment make(const NavigationDecision& decision, const Pose2& pose,
                                           const simulation::Scene& scene);
  /// Restarts the clock that measures the stages of the next moment.
  void restart_clock() { clock_.restart(); }

 private:
  [[nodiscard]] std::vector<Pose2> make_planned_path(ViewId from) const;
  [[nodiscard]] std::optional<recordings::RunHoming> homing() const;
  void add_direction_field(recordings::RunMoment& moment) const;

  const RobotNavigator& robot_;
  const simulation::RememberedPlace& remembered_;
  FieldOptions field_;
  std::optional<Image> image_;
  std::optional<Panorama> panorama_;
  std::vector<Pose2> plan_;
  std::size_t moment_count_ = 0;
  std::optional<ViewId> shown_goal_;
  StageClock clock_;
};

/// Sets the goal to the remembered view nearest to the click of a viewer and returns this view;
/// nullopt if nobody clicked or no view has exits.
[[nodiscard]] std::optional<ViewId> set_goal_of_viewer(
    RobotNavigator& robot, const simulation::RememberedPlace& remembered, RunRecord& record,
    Session& session);

}  // namespace panonav::command
