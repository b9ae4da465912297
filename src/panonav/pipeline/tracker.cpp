#include "panonav/pipeline/tracker.hpp"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/internal/learning_sample.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/internal/sector_recogniser.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

/// Standard deviation of the turn of a step that cannot be read from the images: the turn that is
/// expected before the first step (`VisualOdometry`).
constexpr double unknown_turn_deviation_rad = std::numbers::pi / 6.0;

void require_positions(const MemoryFile& file, const VisualMemory& memory) {
  const std::size_t posed = HeldViewIndex(memory).posed_views().size();
  if (posed >= static_cast<std::size_t>(ObservationModel::min_views)) return;
  throw FileError(file.path().string(),
                  "holds " + format_count(posed, "view") +
                      " with a position; allowed: " + std::to_string(ObservationModel::min_views) +
                      " or more; memorise images taken every 20 to 50 cm, or a data set whose "
                      "table has the columns 'x_m' and 'y_m'");
}

// True if the filter's seed, which is also the seed of learning, is the default one with which
// stored models were learnt.
bool can_use_stored_models(const TrackerOptions& options) {
  return options.filter.seed == LearningOptions{}.seed;
}

MonteCarloLocaliser make_localiser(const MemoryFile& file, const VisualMemory& memory,
                                   const TrackerOptions& options) {
  require_positions(file, memory);
  validate(options.filter);
  try {
    if (can_use_stored_models(options)) {
      if (const auto models = load_stored_models(file, memory); models && models->observation) {
        return {std::make_shared<const ColumnRanking>(memory), *models->observation, options.filter,
                options.odometry.value_or(OdometryNoise{})};
      }
    }
    return {std::make_shared<const ColumnRanking>(memory),
            learn_tracking_model(memory, {.seed = options.filter.seed}), options.filter,
            options.odometry.value_or(OdometryNoise{})};
  } catch (const ContractError& error) {  // the views are all in one place
    throw FileError(file.path().string(), error.what());
  }
}

/// Loads at most `max_views` of the views, from whole areas.
VisualMemory load_sample(ViewIndex& index, std::span<const ViewId> views, std::size_t max_views) {
  return load_learning_sample(index, views, sample_reference_views(views), max_views);
}

/// Returns the model of a memory that is not held. A small memory uses the current stored model or
/// learns from all views. A large one uses the model stored last, else learns from a part of the
/// views.
ObservationModel load_or_learn_model(const MemoryFile& file, const IndexedMemory& memory,
                                     const TrackerOptions& options) {
  const std::vector<ViewId> views = memory.views();
  const std::unique_ptr<ViewIndex> index = memory.index();
  const bool is_small = views.size() <= options.max_learnt_views;
  std::optional<VisualMemory> sample;
  if (is_small) sample.emplace(index->load(views));
  if (can_use_stored_models(options)) {
    const auto models = is_small ? load_stored_models(file, *sample) : load_stored_models(file);
    if (models && models->observation) return *models->observation;
  }
  if (!sample) sample.emplace(load_sample(*index, views, options.max_learnt_views));
  return learn_observation_model(ColumnRanking(*sample), {.seed = options.filter.seed});
}

MonteCarloLocaliser make_localiser(const MemoryFile& file, const IndexedMemory& memory,
                                   const TrackerOptions& options) {
  validate(options.filter);
  try {
    return {[&memory] { return memory.index(); }, file.header().shape,
            load_or_learn_model(file, memory, options), options.filter,
            options.odometry.value_or(OdometryNoise{})};
  } catch (const ContractError& error) {  // too few views with positions, or all in one place
    throw FileError(file.path().string(), error.what());
  }
}

}  // namespace

namespace {

bool is_narrow(const TrackerOptions& options) {
  return options.source && options.source->kind == PictureKind::pinhole;
}

/// Returns the layout of the pictures that the encoder takes, which narrow ones are not.
PictureSource choose_encoded_source(const MemoryFile& file, const TrackerOptions& options) {
  return is_narrow(options) ? file.header().source : options.source.value_or(file.header().source);
}

}  // namespace

struct Tracker::Implementation {
  Implementation(const MemoryFile& file, const TrackerOptions& options)
      : memory(file.load()),
        encoder(file.header(), choose_encoded_source(file, options)),
        localiser(make_localiser(file, *memory, options)),
        noise(options.odometry),
        max_learnt_views(options.max_learnt_views),
        unit(read_length_unit(file)),
        plane(make_floor_plane(*memory)),
        floor(plane.to_floor(HeldViewIndex(*memory).posed_views().front().pose.position()).floor) {
    if (!is_narrow(options)) return;
    const auto models = load_stored_models(file, *memory);
    narrow.emplace(file, *memory, *options.source, models ? models->sector : std::nullopt);
  }
  Implementation(std::unique_ptr<IndexedMemory> index, const MemoryFile& file,
                 const TrackerOptions& options)
      : indexed(std::move(index)),
        encoder(file.header(), choose_encoded_source(file, options)),
        localiser(make_localiser(file, *indexed, options)),
        noise(options.odometry),
        max_learnt_views(options.max_learnt_views),
        unit(read_length_unit(file)) {
    if (is_narrow(options)) {
      throw ContractError("narrow pictures", "in a memory not held", "in a memory that is held");
    }
  }
  /// Holds the memory if it is a file or small enough.
  static std::unique_ptr<Implementation> make(const std::filesystem::path& memory,
                                              const TrackerOptions& options) {
    const MemoryFile file = MemoryFile::open(memory, Access::read_only);
    auto index = open_index_if_large(memory, file, options.max_held_views);
    return index ? std::make_unique<Implementation>(std::move(index), file, options)
                 : std::make_unique<Implementation>(file, options);
  }

  /// Makes visual odometry with the scale of the memory.
  [[nodiscard]] VisualOdometry make_visual_odometry() const {
    if (memory) return panonav::visual_odometry(*memory);
    const std::vector<ViewId> views = indexed->views();
    return panonav::visual_odometry(load_sample(*indexed->index(), views, max_learnt_views));
  }

  std::optional<VisualMemory> memory;      // nullopt: not held
  std::unique_ptr<IndexedMemory> indexed;  // null: held
  ViewEncoder encoder;
  std::optional<SectorRecogniser> narrow;  // nullopt: pictures show all azimuths
  MonteCarloLocaliser localiser;
  std::optional<OdometryNoise> noise;  // of the options
  std::size_t max_learnt_views;
  LengthUnit unit;    // of the positions
  FloorPlane plane;   // of the filter; the floors of a memory that is not held are not told apart
  std::string floor;  // of the last estimated position

  [[nodiscard]] bool is_on_floor(Point2 in_plane) const {
    return plane.to_floor(in_plane).floor == floor;
  }
  /// Converts the poses to the frames of their floors, and the spread to that on the floor of the
  /// heaviest mode.
  [[nodiscard]] MonteCarloEstimate to_floors(MonteCarloEstimate estimate) {
    if (!plane.has_named_floor()) return estimate;
    const auto convert = [&](auto& pose) {
      const Point2 point = plane.to_floor({pose.x_m, pose.y_m}).point;
      pose.x_m = point.x_m;
      pose.y_m = point.y_m;
    };
    if (estimate.position) floor = plane.to_floor(*estimate.position).floor;
    for (PoseMode& mode : estimate.modes) {
      mode.floor = plane.to_floor(mode.mean.position()).floor;
      convert(mode.mean);
    }
    if (estimate.pose) convert(*estimate.pose);
    if (estimate.position) convert(*estimate.position);
    const Particles on_floor = particles();
    if (on_floor.size() < localiser.particles().size() && !on_floor.empty()) {
      estimate.spread_m = position_spread_m(on_floor);
    }
    return estimate;
  }
  /// Returns the particles on the floor, in its frame.
  [[nodiscard]] Particles particles() const {
    const Particles& all = localiser.particles();
    if (!plane.has_named_floor()) return all;
    Particles kept;
    double sum = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!is_on_floor(all.position(i))) continue;
      const Point2 point = plane.to_floor(all.position(i)).point;
      kept.add({point.x_m, point.y_m, all.heading_rad[i]}, all.weight[i]);
      sum += all.weight[i];
    }
    if (kept.size() < all.size() && sum > 0.0) {
      for (double& weight : kept.weight) weight /= sum;
    }
    return kept;
  }

  /// Metres per unit of visual length by the latest images with odometry; nullopt if these are too
  /// few or show no motion.
  [[nodiscard]] std::optional<double> measure_scale_m() const {
    std::vector<KnownLength> known;
    for (std::size_t i = 1; i < latest.size(); ++i) {
      const auto step = visual_step(OdometryView(latest[i - 1].view), OdometryView(latest[i].view));
      const double length_m =
          distance(latest[i - 1].odometry.position(), latest[i].odometry.position());
      if (step) known.push_back({step->length_in_views, length_m});
    }
    return known.size() < min_gap_scale_steps ? std::nullopt : length_scale_m(known);
  }

  /// Moves the particles by the motion from the last view to this one, and returns the motion.
  Pose2 step_to(const FourierSignature& view) {
    OdometryView seen(view);
    if (!visual_odometry) {
      visual_odometry = make_visual_odometry();
      is_last_by_image = false;
    }
    if (!is_last_by_image) {
      if (const auto scale_m = measure_scale_m()) visual_odometry->set_scale_m(*scale_m);
      visual_odometry->restart(last_view ? std::optional<OdometryView>(*last_view) : std::nullopt);
    }
    localiser.set_odometry_noise(noise.value_or(visual_odometry_noise()));
    const bool is_first = !visual_odometry->last();
    const Pose2 before = visual_odometry->pose();
    const bool is_known = visual_odometry->add(std::move(seen)).has_value();
    if (is_first) return {};
    const Pose2 motion = inverse(before) * visual_odometry->pose();
    if (is_known) {
      path_m += distance({}, motion.position());
      ++known_steps;
      localiser.move(motion);
    } else {
      // A step as long as the others, in any direction; before the first, as views are apart.
      localiser.spread(known_steps > 0 ? path_m / known_steps : localiser.model().spacing_m,
                       unknown_turn_deviation_rad);
    }
    return motion;
  }

  /// Pose of the last image, measured or continued by images; nullopt before the first odometry.
  std::optional<Pose2> odometry;
  std::optional<FourierSignature> last_view;  // of an image with odometry, if it is known
  struct PosedView {
    FourierSignature view;
    Pose2 odometry;
  };
  /// The latest consecutive images with odometry and known view, which give the scale of the motion
  /// that is read from images where odometry ends: that of the memory's views may differ by half.
  std::vector<PosedView> latest;
  bool is_last_by_image = false;                  // the last motion was read from images
  bool is_moved = false;                          // since the last view was observed
  std::optional<VisualOdometry> visual_odometry;  // nullopt: no motion was read from images
  double path_m = 0.0;                            // length of the steps read from images
  int known_steps = 0;                            // number of them
};

Tracker::Tracker(const std::filesystem::path& memory, const TrackerOptions& options)
    : implementation_(Implementation::make(memory, options)) {}
Tracker::Tracker(const MemoryFile& file, const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}
Tracker::Tracker(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
                 const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(
          std::move(index), MemoryFile::open(memory, Access::read_only), options)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::start_globally(std::optional<double> heading_rad) {
  implementation_->localiser.start_globally(heading_rad);
}
void Tracker::start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad) {
  Implementation& own = *implementation_;
  const Point2 start = own.plane.to_plane({pose.position(), own.floor});
  own.localiser.start_at({start.x_m, start.y_m, pose.heading_rad}, deviation_m,
                         heading_deviation_rad);
}

MonteCarloEstimate Tracker::observe(const Observation& observation) {
  if (takes_narrow_pictures()) {
    const Place place = localise(observation);
    if (observation.odometry || !implementation_->is_moved) move(observation.odometry, nullptr);
    return observe(place);
  }
  const ViewEncoder& encoder = implementation_->encoder;
  const FourierSignature view = encoder.signature(observation);
  Implementation& own = *implementation_;
  const bool has_odometry = observation.odometry && own.unit == LengthUnit::metres;
  if (has_odometry || !own.is_moved) {
    move(observation.odometry, &view);
  } else if (!own.is_last_by_image) {
    own.last_view = view;
  }
  return observe(pack(view, encoder.header().full_scale));
}

MonteCarloEstimate Tracker::observe(const PackedSignature& view) {
  implementation_->is_moved = false;
  return implementation_->to_floors(implementation_->localiser.observe(view));
}

bool Tracker::takes_narrow_pictures() const noexcept {
  return implementation_->narrow.has_value();
}

Place Tracker::localise(const Observation& observation) const {
  if (!takes_narrow_pictures()) {
    throw ContractError("pictures", "panoramic", "narrow ones (kind pinhole)");
  }
  return implementation_->narrow->localise(observation, 1, {});
}

MonteCarloEstimate Tracker::observe(const Place& place) {
  Implementation& own = *implementation_;
  own.is_moved = false;
  Place in_plane = place;
  const auto convert = [&](std::optional<PositionEstimate>& position, std::string_view floor) {
    if (!position) return;
    const Point2 point = own.plane.to_plane({position->position(), std::string(floor)});
    position->x_m = point.x_m;
    position->y_m = point.y_m;
  };
  convert(in_plane.position, place.floor());
  for (AlternativePlace& other : in_plane.alternatives) {
    convert(other.position, floor_of(other.match.name));
  }
  return own.to_floors(own.localiser.observe(in_plane));
}

void Tracker::move(const std::optional<Pose2>& odometry, const FourierSignature* view) {
  if (odometry && implementation_->unit == LengthUnit::metres) return move_to(*odometry, view);
  if (takes_narrow_pictures()) {
    Implementation& own = *implementation_;
    own.localiser.spread(own.localiser.model().spacing_m, unknown_turn_deviation_rad);
    own.is_moved = true;
    return;
  }
  if (view == nullptr) throw ContractError("view", "unknown", "known for images without odometry");
  move_by_image(*view);
}

void Tracker::bridge_pauses(Dataset& run, Executor& executor) const {
  const std::span<DatasetEntry> part = find_odometry_part(run);
  const auto has_odometry = [](const DatasetEntry& entry) { return entry.odometry.has_value(); };
  if (implementation_->unit != LengthUnit::metres || takes_narrow_pictures() ||
      std::ranges::all_of(part, has_odometry)) {
    return;
  }
  bridge_odometry_pauses(part, implementation_->make_visual_odometry(), implementation_->encoder,
                         executor);
}

bool Tracker::needs_view(std::span<const DatasetEntry> entries, std::size_t index) const {
  if (takes_narrow_pictures()) return false;
  const auto next = entries.subspan(index, std::min(gap_scale_images, entries.size() - index));
  return implementation_->unit != LengthUnit::metres || is_motion_by_images(entries, index) ||
         std::ranges::any_of(next, [](const DatasetEntry& entry) { return !entry.odometry; });
}

void Tracker::move_to(const Pose2& odometry, const FourierSignature* view) {
  require(is_position(odometry.x_m), "x_m of the odometry", odometry.x_m, position_range);
  require(is_position(odometry.y_m), "y_m of the odometry", odometry.y_m, position_range);
  Implementation& own = *implementation_;
  if (own.unit != LengthUnit::metres) {
    throw ContractError("odometry", 1.0,
                        "none, as the positions of the memory are in view steps, not metres");
  }
  if (!own.odometry && own.is_last_by_image && view != nullptr) {
    own.step_to(*view);
  } else if (own.odometry) {
    // After images, the difference contains the error of their motion, and keeps its noise.
    if (!own.is_last_by_image)
      own.localiser.set_odometry_noise(own.noise.value_or(OdometryNoise{}));
    own.localiser.move(inverse(*own.odometry) * odometry);
  }
  own.odometry = odometry;
  own.last_view = view == nullptr ? std::nullopt : std::optional(*view);
  if (view == nullptr) own.latest.clear();
  if (own.latest.size() > gap_scale_images) own.latest.erase(own.latest.begin());
  if (view != nullptr) own.latest.push_back({*view, odometry});
  own.is_last_by_image = false;
  own.is_moved = true;
}

void Tracker::move_by_image(const FourierSignature& view) {
  Implementation& own = *implementation_;
  const Pose2 motion = own.step_to(view);
  if (own.odometry) own.odometry = *own.odometry * motion;
  own.last_view.reset();
  own.latest.clear();
  own.is_last_by_image = true;
  own.is_moved = true;
}

const std::optional<Pose2>& Tracker::odometry() const noexcept {
  return implementation_->odometry;
}

LengthUnit Tracker::length_unit() const noexcept {
  return implementation_->unit;
}

const VisualOdometry* Tracker::visual_odometry() const noexcept {
  const auto& odometry = implementation_->visual_odometry;
  return odometry ? &*odometry : nullptr;
}

bool Tracker::refresh() {
  Implementation& own = *implementation_;
  if (!own.indexed || !own.indexed->refresh()) return false;
  own.localiser.update_views();
  return true;
}

bool Tracker::is_memory_held() const noexcept {
  return implementation_->memory.has_value();
}
const VisualMemory& Tracker::memory() const {
  if (!is_memory_held()) throw ContractError("memory", "not held", "one that is held");
  return *implementation_->memory;
}
const std::string& Tracker::floor() const noexcept {
  return implementation_->floor;
}
Particles Tracker::particles() const {
  return implementation_->particles();
}
ViewId Tracker::find_nearest_view(Point2 position) const {
  FloorPlane plane = implementation_->plane;
  return implementation_->localiser.find_nearest_view(
      plane.to_plane({position, implementation_->floor}));
}
std::vector<PosedView> Tracker::posed_views() const {
  std::vector<PosedView> views = index()->posed_views();
  std::erase_if(views, [&](const PosedView& view) {
    return !implementation_->is_on_floor(view.pose.position());
  });
  for (PosedView& view : views) {
    const Point2 point = implementation_->plane.to_floor(view.pose.position()).point;
    view.pose = {point.x_m, point.y_m, view.pose.heading_rad};
  }
  return views;
}
std::unique_ptr<ViewIndex> Tracker::index() const {
  const Implementation& own = *implementation_;
  if (own.indexed) return own.indexed->index();
  return std::make_unique<HeldViewIndex>(*own.memory);
}
const ViewEncoder& Tracker::encoder() const noexcept {
  return implementation_->encoder;
}
const MonteCarloLocaliser& Tracker::localiser() const noexcept {
  return implementation_->localiser;
}

}  // namespace panonav
