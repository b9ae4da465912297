#pragma once

#include <filesystem>

#include "lab/rows.hpp"
#include "lab/y03/lab.hpp"

namespace panonav::lab {

// Pictures of one variant of the lab as in [Y03]; each is written into `folder` and named in
// `result`.

/// Figure 3: the route panorama of the path.
void draw_route_panorama(const LabRoute& lab, Reproduction& result);
/// Figure 5: where in the route panorama a virtual viewpoint beside the path finds its lines of
/// sight, and the line synthesised there beside the true one. `beside`: a drive there.
void draw_virtual_view(const LabRoute& lab, const LineDrive& beside, Reproduction& result);

/// Drives across the path as localised in four ways.
struct LocalisedDrives {
  const DriveErrors& fit;
  const DriveErrors& contours;
  const DriveErrors& changed_fit;
  const DriveErrors& changed_contours;
};
/// Figure 9.
void draw_drives(const LabRoute& lab, const LocalisedDrives& drives, Reproduction& result);
/// Figure 10.
void draw_goal_run(const LabRoute& lab, const GoalRun& run, Reproduction& result);

}  // namespace panonav::lab
