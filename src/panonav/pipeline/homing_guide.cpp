#include "panonav/pipeline/homing_guide.hpp"

#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/view_list.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"

namespace panonav {

namespace {

int check_components(const SignatureShape& shape, int requested) {
  if (requested == 0) return shape.components;
  if (requested < 3 || requested > shape.components) {
    throw ContractError("components", requested,
                        "3 to " + std::to_string(shape.components) + ", the memory's");
  }
  return requested;
}

/// Loads that view alone.
VisualMemory load_goal_view(const MemoryFile& memory, const std::string& goal) {
  const ViewId view = find_view_by_name_or_id(memory, goal);
  return memory.load({&view, 1});
}

}  // namespace

HomingEncoder::HomingEncoder(const PictureSource& source, const HomingViewOptions& options)
    : pictures_(
          StandaloneReader{PanoramaReader(source, choose_panorama_shape(source, options.signature)),
                           options.preprocessing}),
      components_(options.signature.components),
      horizon_(options.horizon) {}

HomingEncoder::HomingEncoder(const MemoryHeader& header, const PictureSource& source,
                             int components, bool horizon)
    : pictures_(std::in_place_type<ViewEncoder>, header, source),
      components_(check_components(header.shape, components)),
      horizon_(horizon) {}

Panorama HomingEncoder::make_standalone_panorama(const StandaloneReader& own,
                                                 const Observation& observation) const {
  const Tilt tilt = observation.tilt.value_or(Tilt{});
  const auto* ready = std::get_if<Panorama>(&observation.picture);
  Panorama panorama = ready ? level_panorama(*ready, tilt)
                            : own.reader.convert(std::get<Image>(observation.picture).view(), tilt);
  const int max_components = panorama.columns() / 2;
  if (components_ > max_components) {
    throw ContractError(
        "components", components_,
        "3 to " + std::to_string(max_components) + ", half the columns of the image");
  }
  if (own.preprocessing.masked_rows_top + own.preprocessing.masked_rows_bottom >= panorama.rows()) {
    throw ContractError("has " + std::to_string(panorama.rows()) +
                        " rows, and the masks leave none of them");
  }
  return panorama;
}

Panorama HomingEncoder::panorama(const Observation& observation) const {
  if (const auto* memory = std::get_if<ViewEncoder>(&pictures_)) {
    return memory->panorama(observation);
  }
  return rethrow_with_file_name(observation, [&] {
    return make_standalone_panorama(std::get<StandaloneReader>(pictures_), observation);
  });
}

HomingView HomingEncoder::view(const Panorama& panorama) const {
  if (const auto* memory = std::get_if<ViewEncoder>(&pictures_)) {
    return view(memory->signature(panorama));
  }
  const auto& own = std::get<StandaloneReader>(pictures_);
  return view(compute_signature(preprocess(panorama, own.preprocessing), components_));
}

HomingView HomingEncoder::view(const FourierSignature& signature) const {
  return first_components(horizon_ ? horizon_view(signature) : homing_view(signature), components_);
}

HomingGuide::HomingGuide(const std::filesystem::path& memory, const std::string& goal,
                         const FourierHomingOptions& options)
    : HomingGuide(MemoryFile::open(memory, Access::read_only), goal, std::nullopt, options) {}

HomingGuide::HomingGuide(const MemoryFile& memory, const std::string& goal,
                         const std::optional<PictureSource>& source,
                         const FourierHomingOptions& options, int components, bool horizon)
    : HomingGuide(HomingEncoder(memory.header(), source.value_or(memory.header().source),
                                components, horizon),
                  load_goal_view(memory, goal), options) {}

HomingGuide::HomingGuide(const Observation& goal, const PictureSource& source,
                         const HomingViewOptions& views, const FourierHomingOptions& options)
    : HomingGuide(HomingEncoder(source, views), goal, options) {}

HomingGuide::HomingGuide(HomingEncoder encoder, const VisualMemory& goal,
                         const FourierHomingOptions& options)
    : encoder_(std::move(encoder)),
      goal_name_(goal.info(goal.views().front()).name),
      goal_(encoder_.view(goal.signature(goal.views().front()))),
      options_(options) {
  validate(options_);
}

HomingGuide::HomingGuide(HomingEncoder encoder, const Observation& goal,
                         const FourierHomingOptions& options)
    : encoder_(std::move(encoder)),
      goal_name_(goal.name),
      goal_(encoder_.view(encoder_.panorama(goal))),
      options_(options) {
  validate(options_);
}

HomingGuide::HomingGuide(HomingEncoder encoder, std::string goal_name, HomingView goal,
                         const FourierHomingOptions& options)
    : encoder_(std::move(encoder)),
      goal_name_(std::move(goal_name)),
      goal_(std::move(goal)),
      options_(options) {
  validate(options_);
}

HomingResult HomingGuide::home(const Observation& observation) const {
  const HomingView view = encoder_.view(encoder_.panorama(observation));
  return rethrow_with_file_name(observation, [&] {
    if (view.rows() != goal_.rows()) {
      throw ContractError("rows", view.rows(),
                          std::to_string(goal_.rows()) + ", as in " + goal_name_);
    }
    HomingResult result{.evidence = compute_pair_evidence(goal_, view, options_)};
    // A direction that is not certain within 45 degrees is none.
    constexpr double max_deviation_rad = std::numbers::pi / 4.0;
    if (result.evidence && result.evidence->vector.has_direction() &&
        result.evidence->direction_deviation_rad < max_deviation_rad) {
      result.direction_rad = result.evidence->vector.direction_rad();
    }
    return result;
  });
}

}  // namespace panonav
