// Flies back along a chain of snapshots: picture in, velocity out. Runs on a Cortex-M7 without a
// heap, exceptions and files; tests/firmware builds and flies it.
#include "drone.hpp"

#include <array>

#include "board.hpp"
#include "panonav/route/chain_helm.hpp"
#include "panonav/route/chain_pilot.hpp"
#include "panonav/route/snapshot_sampler.hpp"

namespace {

constexpr panonav::SnapshotShape shape;  // 8 x 6
constexpr panonav::BaseOptions base{.drive = panonav::DriveKind::holonomic, .speed_m_s = 0.5};
constexpr std::size_t max_stops = 256;
constexpr std::size_t coefficients = panonav::ChainPilot::workspace_size(shape) / 2;

std::array<std::uint8_t, board::width * board::height> picture;
std::array<panonav::ChainStop, max_stops> stops;
std::array<float, 2 * coefficients> workspace;
std::array<float, coefficients> cosines;
std::array<float, coefficients> sines;

}  // namespace

panonav::ChainState fly_back() {
  const auto route = panonav::read_chain(board::chain(), stops);
  if (!route || route->header.shape != shape) return panonav::ChainState::lost;
  const panonav::SnapshotSampler sampler({shape.rows, shape.components}, board::sampler());
  const panonav::ChainHeader& header = route->header;
  const panonav::CoefficientView view{.rows = shape.rows,
                                      .components = shape.components,
                                      .all_cosines = cosines.data(),
                                      .all_sines = sines.data(),
                                      .has_elevations = header.top_rad > header.bottom_rad,
                                      .bottom_rad = header.bottom_rad,
                                      .top_rad = header.top_rad};
  panonav::ChainPilot pilot(*route, workspace, panonav::ChainDirection::back);
  panonav::ChainHelm helm(base);
  panonav::fill_homing_tables();
  while (!helm.is_over() && board::capture(picture)) {
    const panonav::Pose2 odometry = board::odometry();
    if (helm.needs_decision(odometry)) {
      sampler.sample(picture, cosines, sines);
      helm.begin(pilot.decide(view, helm.moved_to(odometry)), odometry);
    }
    board::set_velocity(helm.velocity(odometry));
  }
  return helm.decision() ? helm.decision()->state : panonav::ChainState::lost;
}
