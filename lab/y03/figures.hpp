#pragma once

#include <filesystem>

#include "lab/rows.hpp"
#include "lab/y03/lab.hpp"

namespace panonav::lab {

// Pictures of one variant of the lab as in [Y03]; each is written to the folder of `result` and
// listed in it.

/// Draws figure 3: the route panorama of the path.
void draw_route_panorama(const LabRoute& lab, Reproduction& result);
/// Draws figure 5: the positions in the route panorama of the lines of sight from a viewpoint next
/// to the path, and the line synthesised there with the true one. `lateral_drive` is the drive that
/// passes the viewpoint.
void draw_virtual_view(const LabRoute& lab, const LineDrive& lateral_drive, Reproduction& result);

/// The drives across the path, localised by two methods in two scenes.
struct LocalisedDrives {
  const DriveErrors& fit;
  const DriveErrors& contours;
  const DriveErrors& changed_fit;
  const DriveErrors& changed_contours;
};
/// Draws figure 9.
void draw_drives(const LabRoute& lab, const LocalisedDrives& drives, Reproduction& result);
/// Draws figure 10.
void draw_goal_run(const LabRoute& lab, const GoalRun& run, Reproduction& result);

}  // namespace panonav::lab
