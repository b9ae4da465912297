#include "panonav/pipeline/memory_updater.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

namespace {

constexpr const char* use_parameter = "use of views";
constexpr const char* use_version = "1";

std::string to_parameter(const MemoryUpdate::UseStatistics& use) {
  std::string text = std::string(use_version) + " " + std::to_string(use.runs) + " " +
                     to_hex_text(use.spacing_m) + " " + to_hex_text(use.far_difference) + " " +
                     to_hex_text(use.range_m) + " " + std::to_string(use.places) + " " +
                     std::to_string(use.size) + "\n";
  for (const auto& [view, one] : use.views) {
    text += std::to_string(view.value) + " " + std::to_string(one.matched) + " " +
            std::to_string(one.failed) + " " + std::to_string(one.last_run) +
            (one.learnt ? " learnt\n" : " -\n");
  }
  return text;
}

// Parses stored statistics; returns empty ones for an unknown version.
MemoryUpdate::UseStatistics parse_memory_use(const std::optional<std::string>& text) {
  MemoryUpdate::UseStatistics use;
  if (!text) return use;
  constexpr std::size_t header_word_count = 7;  // words before the views
  constexpr std::size_t words_per_view = 5;
  const std::vector<std::string> words = split_words(*text);
  if (words.size() < header_word_count || words[0] != use_version ||
      !read_number(words[1], use.runs) || !read_hex_number(words[2], use.spacing_m) ||
      !read_hex_number(words[3], use.far_difference) || !read_hex_number(words[4], use.range_m) ||
      !read_number(words[5], use.places) || !read_number(words[6], use.size)) {
    return {};
  }
  for (std::size_t i = header_word_count; i + words_per_view <= words.size(); i += words_per_view) {
    std::uint32_t view = 0;
    MemoryUpdate::UseStatistics::View one;
    if (!read_number(words[i], view) || !read_number(words[i + 1], one.matched) ||
        !read_number(words[i + 2], one.failed) || !read_number(words[i + 3], one.last_run)) {
      break;
    }
    one.learnt = words[i + 4] == "learnt";
    use.views[ViewId{view}] = one;
  }
  return use;
}

ObservationModel load_or_learn_model(const MemoryFile& file, const ColumnRanking& ranking) {
  const VisualMemory& memory = ranking.memory();
  if (const auto floors = list_floors(memory); !floors.empty() && !floors.back().empty()) {
    throw FileError(file.path().string(),
                    "holds views on floor " + floors.back() +
                        "; allowed where views are updated: views on no floor, so leave out the "
                        "option update");
  }
  const auto oriented = std::ranges::count_if(memory.views(), [&](ViewId view) {
    const auto& pose = memory.info(view).pose;
    return pose && pose->heading_rad;
  });
  if (oriented < ObservationModel::min_views) {
    throw FileError(file.path().string(),
                    "holds " + format_count(oriented, "view") +
                        " with position and heading; allowed where views are updated: " +
                        std::to_string(ObservationModel::min_views) + " or more");
  }
  const auto models = load_stored_models(file, memory);
  if (models && models->observation) return *models->observation;
  try {
    return learn_tracking_model(memory);
  } catch (const ContractError& error) {  // the views are all in one place
    throw FileError(file.path().string(), error.what());
  }
}

}  // namespace

struct MemoryUpdater::Implementation {
  Implementation(const std::filesystem::path& path, const MemoryUpdateOptions& options)
      : file(MemoryFile::open(path, Access::read_write)),
        memory(file.load()),
        encoder(file.header(), file.header().source),
        feature_encoder(file.header(), file.header().source, has_narrow_features(file)),
        ranking(memory),
        update(ranking, load_or_learn_model(file, ranking),
               parse_memory_use(file.parameter(use_parameter)), options) {}

  MemoryFile file;
  VisualMemory memory;
  ViewEncoder encoder;
  FeatureEncoder feature_encoder;
  ColumnRanking ranking;
  MemoryUpdate update;
  std::map<std::size_t, NewView> candidate_views;  // by number of the observation in the run
  std::size_t observations = 0;
  bool finished = false;

  void require_unfinished() const {
    if (finished) throw ContractError("run", "finished", "one updater for each run");
  }
};

MemoryUpdater::MemoryUpdater(const std::filesystem::path& memory,
                             const MemoryUpdateOptions& options)
    : implementation_(std::make_unique<Implementation>(memory, options)) {}
MemoryUpdater::~MemoryUpdater() = default;
MemoryUpdater::MemoryUpdater(MemoryUpdater&&) noexcept = default;
MemoryUpdater& MemoryUpdater::operator=(MemoryUpdater&&) noexcept = default;

void MemoryUpdater::observe(const Observation& observation, const Panorama& panorama,
                            const Place& place) {
  auto& self = *implementation_;
  self.require_unfinished();
  if (!observation.odometry) return;
  NewView view;
  view.info.name = observation.name;
  view.info.stamp_s = observation.stamp_s;
  view.signature = self.encoder.packed(panorama);
  MemoryUpdate::LocalisedView answered{
      *observation.odometry, view.signature, place.probability, {}, {}};
  if (place.position && place.heading_rad) {
    answered.pose = Pose2{place.position->x_m, place.position->y_m, *place.heading_rad};
    answered.radius_m = place.position->radius_m;
  }
  const std::size_t number = self.observations++;
  self.update.add(std::move(answered));
  std::erase_if(self.candidate_views,
                [&](const auto& one) { return !self.update.can_become_view(one.first); });
  if (!self.update.can_become_view(number)) return;
  view.thumbnail = encode_thumbnail(panorama);
  if (self.file.header().elevations) {
    view.features = self.feature_encoder.packed(observation, panorama);
  }
  self.candidate_views.emplace(number, std::move(view));
}

bool MemoryUpdater::is_near_known_place() const {
  return implementation_->update.is_near_known_place();
}

MemoryUpdater::Changes MemoryUpdater::finish(const std::string& what) {
  auto& self = *implementation_;
  self.require_unfinished();
  self.finished = true;
  MemoryUpdate::Changes planned = self.update.finish();
  Changes changes{.observations = self.observations,
                  .sure = planned.sure,
                  .certain = planned.certain,
                  .views = self.memory.size()};
  if (planned.certain == 0) return changes;
  changes.reinforced = planned.matched.size();
  changes.added = planned.added.size();
  changes.replaced = planned.replaced.size();
  changes.forgotten = planned.forgotten.size();
  std::vector<ViewId> dropped = planned.replaced;
  dropped.insert(dropped.end(), planned.forgotten.begin(), planned.forgotten.end());
  self.file.change(
      [&] {
        // Skips views that another process has removed meanwhile.
        const std::vector<ViewId> there = self.file.views();
        std::erase_if(dropped,
                      [&](ViewId view) { return !std::ranges::binary_search(there, view); });
        if (!dropped.empty()) {
          self.file.remove(dropped);
          forget_recordings(self.file);
        }
        std::vector<NewView> added;
        for (const auto& [number, pose] : planned.added) {
          NewView& view = added.emplace_back(std::move(self.candidate_views.at(number)));
          view.info.name = "update " + std::to_string(planned.use.runs) + "/" + view.info.name;
          view.info.pose = pose;
        }
        for (const ViewId view : self.file.append(added)) {
          planned.use.views[view] = {.last_run = planned.use.runs, .learnt = true};
        }
        changes.views = there.size() - dropped.size() + added.size();
        planned.use.size = static_cast<int>(changes.views);
        self.file.set_parameter(use_parameter, to_parameter(planned.use));
        if (!added.empty() || !dropped.empty()) learn_and_store_models(self.file);
      },
      what + ": " + summarise(changes));
  return changes;
}

std::string explain_uncertainty(const MemoryUpdater::Changes& changes) {
  if (changes.certain > 0) return {};
  if (changes.observations == 0) {
    return "no image has odometry, by which the images of a run confirm each other";
  }
  if (changes.sure == 0) {
    return "no image was localised with a probability of 0.9 or more, as images of another place, "
           "camera or light are";
  }
  return "a place is certain if at least three other images, taken within eight view spacings of "
         "it and two apart, were localised with a probability of 0.9 or more and agree with it "
         "by odometry; " +
         std::to_string(changes.sure) + " of " + format_count(changes.observations, "image") +
         " were localised so";
}

std::string summarise(const MemoryUpdater::Changes& changes) {
  return format_count(changes.added, "view") + " added, " + std::to_string(changes.replaced) +
         " replaced, " + std::to_string(changes.forgotten) + " forgotten, " +
         std::to_string(changes.reinforced) + " reinforced";
}

}  // namespace panonav
