#include "panonav/navigation/chain_join.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/place_scale.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

void visit_options(ChainJoinOptions& options, OptionVisitor& visitor) {
  using T = ChainJoinOptions;
  constexpr OptionTable table{
      option<&T::candidates>("references that are tried for a link with a snapshot", 1, 100),
      options_of<&T::odometry>(),
  };
  table.visit(options, visitor);
}

namespace {

// The coefficients a = A cos(psi), b = -A sin(psi) as magnitudes and phases.
FourierSignature signature_of(const HomingView& view) {
  const SignatureShape shape{view.rows(), view.components()};
  std::vector<float> magnitudes;
  std::vector<float> phases;
  for (int k = 0; k < shape.components; ++k) {
    for (int row = 0; row < shape.rows; ++row) {
      const float a = view.a(row, k);
      const float b = view.b(row, k);
      magnitudes.push_back(std::hypot(a, b));
      const bool empty = a == 0.0F && b == 0.0F;
      phases.push_back(empty ? 0.0F : static_cast<float>(wrap_angle(std::atan2(-b, a))));
      // The largest float below pi may be rounded to pi itself.
      if (phases.back() >= std::numbers::pi_v<float>) phases.back() = -std::numbers::pi_v<float>;
    }
  }
  return {shape, std::move(magnitudes), std::move(phases), view.elevations()};
}

PlaceScale scale_of(const VisualMemory& memory) {
  std::vector<NavigationEdge> edges;
  for (const Link& link : memory.links()) edges.push_back({link.a, link.b, 1.0, std::nullopt});
  const auto views = memory.views();
  return learn_place_scale(MemoryViewSource(memory),
                           NavigationGraph({views.begin(), views.end()}, std::move(edges)));
}

bool show_one_neighbourhood(const HomingView& a, const HomingView& b, const PlaceScale& scale) {
  if (image_difference(a, b) > scale.neighbours) return false;
  const auto reading = read_phases(a, b);
  return reading && reading->turn_disagreement_rad <= most_disagreement_rad &&
         (!reading->points || reading->disagreement_rad <= most_disagreement_rad);
}

}  // namespace

JoinedChain join_chain(VisualMemory& memory, const SnapshotChain& chain, std::string_view name,
                       const ChainJoinOptions& options) {
  validate(options);
  validate(chain);
  if (name.empty()) throw ContractError("name of a chain", "empty", "at least one character");
  const auto name_of_snapshot = [&](std::size_t i) {
    return std::string(name) + "/" + std::to_string(i);
  };
  std::vector<PackedSignature> packed;
  for (std::size_t i = 0; i < chain.snapshots.size(); ++i) {
    const HomingView& view = chain.snapshots[i].view;
    if (SignatureShape{view.rows(), view.components()} != memory.shape() ||
        view.elevations() != memory.elevations()) {
      throw ContractError("views of a chain",
                          std::to_string(view.rows()) + " rows x " +
                              std::to_string(view.components()) + " components",
                          "rows, components and elevations of the memory");
    }
    if (memory.find(name_of_snapshot(i))) {
      throw ContractError("name of a chain", std::string(name), "one that the memory has not");
    }
    packed.push_back(pack(signature_of(view), memory.full_scale()));
  }

  JoinedChain joined;
  const std::size_t count = chain.snapshots.size();
  std::vector<std::vector<ViewId>> near(count);
  if (!memory.empty()) {
    const PlaceScale scale = scale_of(memory);
    for (std::size_t i = 0; i < count; ++i) {
      for (const Match& match : memory.search(packed[i], {.top = options.candidates}).matches) {
        const HomingView reference = homing_view(memory.signature(match.view));
        if (show_one_neighbourhood(chain.snapshots[i].view, reference, scale)) {
          near[i].push_back(match.view);
        }
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const ViewId view = memory.append(packed[i], {name_of_snapshot(i), std::nullopt, std::nullopt});
    if (i > 0) {
      joined.links.push_back({joined.views.back(), view, LinkKind::sequence});
      joined.motion.push_back(coarse_motion(
          joined.views.back(), view, chain.snapshots[i].previous_from_this, options.odometry));
    }
    for (const ViewId reference : near[i]) {
      joined.links.push_back({reference, view, LinkKind::closure});
    }
    joined.views.push_back(view);
  }
  for (const Link& link : joined.links) memory.link(link);
  return joined;
}

}  // namespace panonav
