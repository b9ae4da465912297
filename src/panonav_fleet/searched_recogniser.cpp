#include "panonav_fleet/searched_recogniser.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/internal/asked_view.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav_fleet/memory_changes.hpp"
#include "panonav_fleet/place_search.hpp"

namespace panonav::fleet {

namespace {

/// Local features of views of a memory, by a connection of their own; those that were asked for are
/// kept, up to a number.
class ReadFeatures {
 public:
  explicit ReadFeatures(std::filesystem::path memory) : path_(std::move(memory)) {}

  std::optional<LocalFeatures> of(ViewId view) {
    const std::lock_guard lock(mutex_);
    const auto found = views_.find(view);
    if (found != views_.end()) return found->second;
    std::optional<LocalFeatures> features;
    try {
      if (!file_) {
        file_.emplace(MemoryFile::open(path_, Access::read_only));
        read_ = features_in(*file_);
      }
      if (read_) features = read_(view);
    } catch (const ContractError&) {  // forgotten since by somebody else
    } catch (const FileError&) {
      read_ = {};
      file_.reset();
      throw;
    }
    if (views_.size() >= max_kept) views_.clear();
    return views_.emplace(view, std::move(features)).first->second;
  }

 private:
  static constexpr std::size_t max_kept = 10000;
  std::filesystem::path path_;
  std::mutex mutex_;
  std::optional<MemoryFile> file_;
  FeatureSource read_;
  std::map<ViewId, std::optional<LocalFeatures>> views_;
};

/// Rectangles that overlap become one.
std::vector<PositionBounds> joined(std::vector<PositionBounds> boxes) {
  const auto overlap = [](const PositionBounds& a, const PositionBounds& b) {
    return a.min_x_m <= b.max_x_m && b.min_x_m <= a.max_x_m && a.min_y_m <= b.max_y_m &&
           b.min_y_m <= a.max_y_m;
  };
  for (std::size_t i = 0; i < boxes.size();) {
    const auto other =
        std::find_if(boxes.begin() + static_cast<std::ptrdiff_t>(i) + 1, boxes.end(),
                     [&](const PositionBounds& box) { return overlap(boxes[i], box); });
    if (other == boxes.end()) {
      ++i;
      continue;
    }
    boxes[i] = {
        std::min(boxes[i].min_x_m, other->min_x_m), std::max(boxes[i].max_x_m, other->max_x_m),
        std::min(boxes[i].min_y_m, other->min_y_m), std::max(boxes[i].max_y_m, other->max_y_m)};
    boxes.erase(other);
    i = 0;
  }
  return boxes;
}

PositionBounds area_bounds(Point2 position) {
  const MemoryArea area = area_of(position.x_m, position.y_m);
  const double x_m = area.column * memory_area_side_m;
  const double y_m = area.row * memory_area_side_m;
  return {x_m, x_m + memory_area_side_m, y_m, y_m + memory_area_side_m};
}

void add_views(std::vector<ViewId>& views, std::span<const ViewId> more) {
  views.insert(views.end(), more.begin(), more.end());
}

}  // namespace

struct SearchedRecogniser::Implementation {
  /// What is learnt of all views; swapped when these change.
  struct Learnt {
    LearntModels models;
    VisualMemory drawn;  // the views of chance
    bool has_features = false;
  };

  Implementation(const std::filesystem::path& memory, const PlaceRecogniserOptions& options_,
                 std::size_t learnt_views_)
      : path(memory),
        options(options_.localiser),
        learnt_views(learnt_views_),
        search(memory),
        encoder(search.header(), options_.source.value_or(search.header().source)),
        read_features(memory) {
    validate(options);
    const int most = search.header().shape.components;
    if (options_.areas) {
      throw ContractError(
          "areas", "asked for",
          "none in a memory that is not held: they take the positions of all views");
    }
    if (options.components > most) {
      throw ContractError("components", options.components,
                          "1 to " + std::to_string(most) + ", the memory's");
    }
    learn();
  }

  [[nodiscard]] std::shared_ptr<const Learnt> learnt() const {
    const std::lock_guard lock(mutex);
    return current;
  }

  void learn() {
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    const std::vector<ViewId> views = search.views();
    if (views.empty()) {
      throw FileError(file.path().string(), "holds no view; memorise a recording first");
    }
    const bool has_features = file.header().elevations && file.has_features();
    PlaceSearch::Snapshot snapshot = search.snapshot();
    const std::vector<ViewId> drawn = drawn_views(views);
    std::optional<LearntModels> models;
    const auto before = learnt();
    // What is kept was learnt over all components.
    const bool take_kept = options.components == 0;
    if (views.size() <= learnt_views) {
      const VisualMemory all = snapshot.load(views);
      if (take_kept) models = kept_models(file, all);
      if (!models) models = learn_from(all, has_features);
    } else {
      if (take_kept) models = kept_models(file);
      if (!models && before) models = before->models;
      if (!models) models = learn_from(some_areas(snapshot, views, drawn), has_features);
    }
    auto next = std::make_shared<const Learnt>(Learnt{*models, snapshot.load(drawn), has_features});
    const std::lock_guard lock(mutex);
    current.swap(next);
  }

  [[nodiscard]] FeatureSource features() const {
    return [this](ViewId view) { return read_features.of(view); };
  }

  [[nodiscard]] LearntModels learn_from(const VisualMemory& memory, bool has_features) const {
    const FeatureSource source = has_features ? features() : FeatureSource{};
    if (options.components == 0) return learn_models(memory, source);
    const Localiser localiser(memory, options);
    const ColumnRanking ranking(memory, options.components);
    const NeighbourSupport support(ranking);
    return {localiser.place_model(), localiser.position_model(), support.spacing_m(), std::nullopt,
            source && try_features(ranking, support, source).tell_more()};
  }

  /// The areas of drawn views, or what was taken before and after views without a position.
  [[nodiscard]] VisualMemory some_areas(PlaceSearch::Snapshot& snapshot,
                                        std::span<const ViewId> views,
                                        std::span<const ViewId> drawn) const {
    constexpr std::size_t beside = 128;
    std::vector<ViewId> some;
    const VisualMemory seeds = snapshot.load(drawn);
    for (const ViewId seed : drawn) {
      if (some.size() >= learnt_views) break;
      if (!seeds.contains(seed)) continue;
      if (const auto& pose = seeds.info(seed).pose) {
        const PositionBounds area = area_bounds(pose->position());
        add_views(some, snapshot.views_within(std::span(&area, 1)));
      } else {
        const auto at =
            static_cast<std::size_t>(std::ranges::lower_bound(views, seed) - views.begin());
        const std::size_t first = at - std::min(at, beside);
        add_views(some, views.subspan(first, std::min(2 * beside, views.size() - first)));
      }
      std::ranges::sort(some);
      some.erase(std::unique(some.begin(), some.end()), some.end());
    }
    if (some.size() > learnt_views) some.resize(learnt_views);
    return snapshot.load(some);
  }

  Place localise(const Observation& observation, std::span<const std::string> excluded_names) {
    const auto known = learnt();
    const LearntModels& models = known->models;
    AskedView asked(encoder, observation);
    const bool by_features = known->has_features && models.by_features;
    const PackedSignature query = asked.query(by_features);
    PlaceSearch::Snapshot snapshot = search.snapshot();
    std::vector<ViewId> excluded;
    for (const std::string& name : excluded_names) {
      if (const auto view = snapshot.find(name)) excluded.push_back(*view);
    }
    const SearchMask mask{excluded, {}};
    std::uint64_t bytes_read = 0;
    const auto nearest = [&](int top) {
      const auto from = std::chrono::steady_clock::now();
      SearchResult found =
          snapshot.search(query, {.top = top, .components = options.components}, mask);
      bytes_read += found.bytes_read;
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - from;
      const std::lock_guard lock(mutex);
      ++counted.searches;
      counted.views_read += found.views_in_full;
      counted.seconds += taken.count();
      return std::move(found.matches);
    };
    const auto ids_of = [](std::span<const Match> matches) {
      std::vector<ViewId> ids;
      for (const Match& match : matches) ids.push_back(match.view);
      return ids;
    };
    // As `Localiser::localise` goes on, so that the part of the memory has all that it looks at.
    const int first = first_matches(options, false);
    std::vector<Match> matches = nearest(first_matches(options, by_features));
    VisualMemory part = snapshot.load(ids_of(matches));
    const auto ranked_of = [&](std::span<const Match> those) {
      return ColumnRanking(part, options.components, 0).rank(query, those);
    };
    std::vector<RankedMatch> ranked = ranked_of(matches);
    const auto at_first = std::span<const Match>(matches).first(
        std::min(matches.size(), static_cast<std::size_t>(first)));
    if (options.reranked_views > first && looks_further(models.place, ranked_of(at_first))) {
      matches = nearest(options.reranked_views);
      part = snapshot.load(ids_of(matches));
      ranked = ranked_of(matches);
    }
    std::vector<ViewId> wanted = ids_of(matches);
    add_views(wanted, excluded);
    if (options.reranked_views > 0) {
      add_views(wanted, snapshot.views_within(around(part, ranked, models.spacing_m)));
    }
    part = snapshot.load(wanted);
    const VisualMemory all = joined_with(part, known->drawn);
    Localiser localiser(all, models.place, models.position, options, models.spacing_m,
                        snapshot.size());
    if (known->has_features) localiser.use_features(features(), models.by_features);
    Place place = place_of(localiser.localise(query, mask, asked.features()), all);
    place.bytes_read = bytes_read;
    return place;
  }

  /// Where the references lie that may support one of the matches.
  static std::vector<PositionBounds> around(const VisualMemory& part,
                                            std::span<const RankedMatch> ranked, double spacing_m) {
    std::vector<PositionBounds> boxes;
    const double radius_m = NeighbourSupport::radius_m(spacing_m);
    if (!(radius_m > 0.0)) return boxes;
    for (const RankedMatch& match :
         ranked.first(std::min(ranked.size(), NeighbourSupport::max_examined))) {
      const auto& pose = part.info(match.match.view).pose;
      if (!pose || !pose->heading_rad) continue;
      boxes.push_back(
          {pose->x_m - radius_m, pose->x_m + radius_m, pose->y_m - radius_m, pose->y_m + radius_m});
    }
    return joined(std::move(boxes));
  }

  static VisualMemory joined_with(const VisualMemory& part, const VisualMemory& drawn) {
    VisualMemory all(part.shape(), part.full_scale(), part.elevations());
    std::vector<ViewId> views;
    std::ranges::set_union(part.views(), drawn.views(), std::back_inserter(views));
    for (const ViewId view : views) {
      const VisualMemory& from = part.contains(view) ? part : drawn;
      // Somebody may have given its name to another view meanwhile.
      if (all.find(from.info(view).name)) continue;
      all.append_as(view, from.packed(view), from.info(view));
    }
    return all;
  }

  std::filesystem::path path;
  LocaliserOptions options;
  std::size_t learnt_views;
  PlaceSearch search;
  ViewEncoder encoder;
  mutable ReadFeatures read_features;
  mutable std::mutex mutex;  // of `current` and `counted`
  std::shared_ptr<const Learnt> current;
  SearchCounters counted;
};

SearchedRecogniser::SearchedRecogniser(const std::filesystem::path& memory,
                                       const PlaceRecogniserOptions& options,
                                       std::size_t learnt_views)
    : implementation_(std::make_unique<Implementation>(memory, options, learnt_views)) {}
SearchedRecogniser::~SearchedRecogniser() = default;
SearchedRecogniser::SearchedRecogniser(SearchedRecogniser&&) noexcept = default;
SearchedRecogniser& SearchedRecogniser::operator=(SearchedRecogniser&&) noexcept = default;

Place SearchedRecogniser::localise(const Observation& observation,
                                   std::span<const std::string> excluded_names) const {
  return implementation_->localise(observation, excluded_names);
}

bool SearchedRecogniser::refresh() {
  if (!implementation_->search.refresh()) return false;
  implementation_->learn();
  return true;
}

std::size_t SearchedRecogniser::size() const {
  return implementation_->search.size();
}
std::uint64_t SearchedRecogniser::bytes() const {
  return implementation_->search.bytes();
}
SearchCounters SearchedRecogniser::counters() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->counted;
}
const ViewEncoder& SearchedRecogniser::encoder() const noexcept {
  return implementation_->encoder;
}

}  // namespace panonav::fleet
