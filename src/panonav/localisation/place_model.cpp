#include "panonav/localisation/place_model.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

// The left of the robot becomes its right: I'(phi) = I(-phi), so psi' = -psi.
PackedSignature mirrored(PackedSignature signature) {
  for (std::uint8_t& phase : signature.phases) phase = static_cast<std::uint8_t>(-phase);
  return signature;
}

// Among views that were taken elsewhere: a robot that stands still takes the same view again.
std::optional<ViewId> nearest_in_space(const VisualMemory& memory, ViewId view) {
  const auto& pose = memory.info(view).pose;
  if (!pose) return std::nullopt;
  std::optional<ViewId> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ViewId other : memory.views()) {
    const auto& there = memory.info(other).pose;
    if (!there) continue;
    const double distance_m = distance(there->position(), pose->position());
    if (distance_m > 0.0 && distance_m < nearest_m) {
      nearest_m = distance_m;
      nearest = other;
    }
  }
  return nearest;
}

}  // namespace

void visit_options(PlaceModelOptions& options, OptionVisitor& visitor) {
  using T = PlaceModelOptions;
  constexpr OptionTable table{
      option<&T::sampled_views>("views used for learning when a place is known", 8, 1e6),
      option<&T::compared_views>("views with which each of them is compared", 8, 1e6),
      option<&T::seed>("seed of the draws", 0),
  };
  table.visit(options, visitor);
}

PlaceModel learn_place_model(const ColumnRanking& ranking, const PlaceModelOptions& options) {
  validate(options);
  const VisualMemory& memory = ranking.memory();
  PlaceModel model;
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const std::vector<ViewId> sample = sample_views(memory.views(), options.sampled_views, seed);
  model.sampled_views = static_cast<int>(sample.size());
  if (memory.size() < static_cast<std::size_t>(PlaceModel::min_views)) return model;

  const std::vector<ViewId> compared =
      sample_views(memory.views(), options.compared_views, seed + 1);
  std::vector<ColumnProfiles> references;
  references.reserve(compared.size());
  for (const ViewId view : compared) references.push_back(ranking.profiles(view));

  std::vector<double> between;
  std::vector<double> nearest;
  std::vector<double> nearest_of_mirrored;
  std::vector<double> beside;
  for (const ViewId view : sample) {
    const ColumnProfiles own = ranking.profiles(view);
    const ColumnProfiles reversed(mirrored(memory.packed(view)), ranking.components());
    double best = std::numeric_limits<double>::infinity();
    double best_of_mirrored = best;
    for (std::size_t i = 0; i < compared.size(); ++i) {
      best_of_mirrored =
          std::min(best_of_mirrored, match_columns(reversed, references[i]).difference);
      if (compared[i] == view) continue;
      between.push_back(match_columns(own, references[i]).difference);
      best = std::min(best, between.back());
    }
    nearest.push_back(best);
    if (const auto neighbour = nearest_in_space(memory, view)) {
      beside.push_back(match_columns(own, ranking.profiles(*neighbour)).difference);
    }
    nearest_of_mirrored.push_back(best_of_mirrored);
  }
  model.neighbouring = quantile(nearest, 0.5);
  model.arbitrary = quantile(between, 0.5);
  model.mirrored = quantile(nearest_of_mirrored, 0.5);
  double least =
      std::min(PlaceModel::related_share * model.arbitrary, PlaceModel::unrelated_difference);
  if (beside.size() >= static_cast<std::size_t>(PlaceModel::min_views)) {
    model.beside = quantile(beside, 0.9);
    least = std::min(least, *model.beside);
  }
  model.threshold = std::max(0.5 * (model.neighbouring + model.mirrored), least);
  model.learnt = true;
  return model;
}

}  // namespace panonav
