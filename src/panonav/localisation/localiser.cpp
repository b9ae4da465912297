#include "panonav/localisation/localiser.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

// The mean of what the nearest references say, weighted by the inverse square of their phase
// residual, which is about the inverse square of their variance. Only those near to the one with
// the best evidence count: a compass that locked on to a wrong maximum must not pull the mean.
std::optional<double> absolute_heading(const VisualMemory& memory,
                                       std::span<const LocalisedMatch> matches) {
  constexpr std::size_t references = 4;  // the corners of a grid's square
  constexpr double agreement_rad = radians(15.0);
  constexpr double least_residual = 1e-6;
  struct Reading {
    double heading_rad, evidence, weight;
  };
  std::vector<Reading> readings;
  for (const LocalisedMatch& match : matches.first(std::min(references, matches.size()))) {
    const auto& pose = memory.info(match.view).pose;
    if (!pose || !pose->heading_rad || !match.evidence.compass) continue;
    const double residual = std::max(least_residual, 1.0 - match.evidence.phase_correlation);
    readings.push_back({*pose->heading_rad + match.evidence.compass->heading_rad,
                        match.evidence.value, 1.0 / (residual * residual)});
  }
  if (readings.empty()) return std::nullopt;
  const double centre_rad = std::ranges::max_element(readings, {}, &Reading::evidence)->heading_rad;
  double sum = 0.0;
  double weights = 0.0;
  for (const Reading& reading : readings) {
    const double offset = angle_difference(reading.heading_rad, centre_rad);
    if (std::abs(offset) > agreement_rad) continue;
    sum += reading.weight * offset;
    weights += reading.weight;
  }
  return wrap_angle(centre_rad + sum / weights);
}

PositionModelOptions position_options(const LocaliserOptions& options) {
  validate(options);
  PositionModelOptions position;
  position.components = options.components;
  return position;
}

}  // namespace

void visit_options(LocaliserOptions& options, OptionVisitor& visitor) {
  visitor.visit({.name = "top", .help = "matches listed", .low = 1, .high = 1e6}, options.top);
  visitor.visit({.name = "components", .help = "Fourier components compared, 0 for all", .low = 0},
                options.components);
}

Localiser::Localiser(const VisualMemory& memory, const LocaliserOptions& options)
    : Localiser(memory, learn_place_model(memory),
                learn_position_model(memory, position_options(options)), options) {}

Localiser::Localiser(const VisualMemory& memory, PlaceModel place_model,
                     PositionModel position_model, const LocaliserOptions& options)
    : memory_(&memory),
      options_(options),
      place_model_(std::move(place_model)),
      position_model_(position_model) {
  validate(options_);
  require(options_.components <= memory.shape().components, "components", options_.components,
          "0 (all) or 1 .. " + to_text(memory.shape().components));
  require(position_model_.components == options_.components, "components of the position model",
          position_model_.components, to_text(options_.components) + ", as asked for");
}

Localisation Localiser::localise(const PackedSignature& query, const SearchMask& mask) const {
  Localisation result;
  result.components = options_.components == 0 ? memory_->shape().components : options_.components;
  const int wanted = std::max({options_.top, place_model_.candidates, PositionModel::candidates});
  SearchResult found =
      memory_->search(query, {.top = wanted, .components = options_.components}, mask);
  result.bytes_read = found.bytes_read;
  result.bytes_in_full = found.bytes_in_full;
  if (found.matches.empty()) return result;

  const PackedSignature seen = with_rows(query, mask.allowed_rows);
  const auto evidence_of = [&](ViewId view) {
    return place_evidence(seen, with_rows(memory_->packed(view), mask.allowed_rows),
                          place_model_.component_weights);
  };
  const int looked_at = std::max(options_.top, place_model_.candidates);
  for (const Match& match : found.matches) {
    if (static_cast<int>(result.matches.size()) == looked_at) break;
    result.matches.push_back({match.view, match.dissimilarity, evidence_of(match.view)});
  }
  for (std::size_t i = 0; i < result.matches.size(); ++i) {
    if (static_cast<int>(i) == place_model_.candidates) break;
    result.evidence = std::max(result.evidence, result.matches[i].evidence.value);
  }
  result.known = result.evidence >= place_model_.threshold;

  if (result.known) {
    result.position = interpolate_position(*memory_, position_model_, found.matches);
    result.heading_rad = absolute_heading(*memory_, result.matches);
  }
  if (static_cast<int>(result.matches.size()) > options_.top) result.matches.resize(options_.top);
  return result;
}

}  // namespace panonav
