#include "panonav/pipeline/memoriser.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav {

namespace {

double unix_time_s() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

std::string describe_observation(const Observation& observation) {
  return observation.file.empty() ? observation.name : observation.file.string();
}

/// Returns what the names of images of one path have in common: all before the time in a video
/// ("walk.mp4@3.2"), or the folder.
std::string_view get_path_name(std::string_view name) {
  const std::size_t at = name.rfind('@');
  return name.substr(0, at != std::string_view::npos ? at : name.rfind('/') + 1);  // 0 if none
}

Panorama make_first_panorama(const Observation& first, const PictureSource& source,
                             const SignatureOptions& signature) {
  if (const auto* ready = std::get_if<Panorama>(&first.picture)) return *ready;
  const PanoramaReader reader(source, choose_panorama_shape(source, signature));
  try {
    return reader.convert(std::get<Image>(first.picture).view());
  } catch (const ContractError& error) {
    if (first.file.empty()) throw;
    throw FileError(first.file.string(), error.what());
  }
}

}  // namespace

MemoryHeader make_memory_header(std::span<const Observation> first, const PictureSource& source,
                                const SignatureOptions& signature,
                                const PreprocessingOptions& preprocessing, Executor& executor) {
  if (first.empty()) throw ContractError("observations", 0, "1 or more to make a memory of");
  MemoryHeader header;
  header.source = source;
  header.preprocessing = preprocessing;
  header.created_s = unix_time_s();
  const Panorama panorama = make_first_panorama(first.front(), source, signature);
  header.shape = {panorama.rows(), signature.components};
  header.panorama_columns = panorama.columns();
  header.elevations = panorama.elevations();
  if (const auto* image = std::get_if<Image>(&first.front().picture);
      image != nullptr && source.kind == PictureKind::panorama) {
    const PanoramaShape own{image->height(), image->width()};
    if (own != PanoramaShape{panorama.rows(), panorama.columns()}) header.picture_shape = own;
  }
  if (2 * header.shape.components > header.panorama_columns) {
    throw ContractError("components", header.shape.components,
                        "1 to " + std::to_string(header.panorama_columns / 2) +
                            ", half the columns of " + describe_observation(first.front()));
  }
  const ViewEncoder encoder(header, source);
  std::vector<float> largest(first.size(), 0.0F);
  parallel_for(executor, first.size(), [&](std::size_t i) {
    largest[i] = largest_nonconstant_magnitude(encoder.signature(first[i]));
  });
  header.full_scale = *std::ranges::max_element(largest);
  constexpr float rounding = 1e-6F;  // of the transform, for values of 0 .. 1
  if (!(header.full_scale > rounding)) {
    throw FileError(describe_observation(first.front()),
                    "the first " + std::to_string(first.size()) +
                        " views have only one colour; a memory needs views with structure");
  }
  return header;
}

MemoryHeader make_header_from_recording(const Dataset& recording, const SignatureOptions& signature,
                                        const PreprocessingOptions& preprocessing,
                                        Executor& executor) {
  const std::size_t count = std::min(Memoriser::scale_views, recording.entries.size());
  std::vector<Observation> first;
  std::exception_ptr failure;
  process_in_order(
      count, executor,
      [&](std::size_t i) { return read_observation(recording.entries[i], PictureColours::grey); },
      [&](std::size_t, Observation&& observation) { first.push_back(std::move(observation)); },
      [&](std::size_t, const std::exception_ptr& error) { failure = error; });
  if (first.empty() && failure) std::rethrow_exception(failure);
  return make_memory_header(first, recording.source, signature, preprocessing, executor);
}

Memoriser::Memoriser(const std::filesystem::path& memory, MemoriserOptions options)
    : path_(memory), options_(std::move(options)) {
  if (memory_exists(path_)) {
    file_ = MemoryFile::open(path_, Access::read_write);
    make_encoders(options_.source.value_or(file_->header().source));
  } else if (!options_.source) {
    throw ContractError("source of " + mask_passwords(path_.string()), "empty",
                        "the type of images, because the file is new");
  }
}

void Memoriser::add(Observation observation) {
  Executor alone;
  std::vector<Observation> one;
  one.push_back(std::move(observation));
  add(std::move(one), alone);
}

void Memoriser::add(std::vector<Observation> observations, Executor& executor) {
  if (file_) return store(observations, executor);
  std::ranges::move(observations, std::back_inserter(waiting_));
  if (waiting_.size() >= scale_views) return make_file(executor);
  convert_large_waiting(executor);
}

// Replaces images that wait by their panoramas if they are large: the signatures are the same.
void Memoriser::convert_large_waiting(Executor& executor) {
  constexpr std::size_t max_image_bytes = std::size_t{16} << 20U;
  if (options_.source->kind == PictureKind::panorama) return;  // whose size the header states
  std::size_t bytes = 0;
  for (const Observation& observation : waiting_) {
    if (const auto* image = std::get_if<Image>(&observation.picture))
      bytes += image->pixels().size();
  }
  if (bytes <= max_image_bytes) return;
  const PanoramaReader reader(*options_.source,
                              choose_panorama_shape(*options_.source, options_.signature));
  parallel_for(executor, waiting_.size(), [&](std::size_t i) {
    Observation& observation = waiting_[i];
    const auto* image = std::get_if<Image>(&observation.picture);
    if (image == nullptr) return;
    try {
      observation.picture = reader.convert(image->view(), observation.tilt.value_or(Tilt{}));
      observation.tilt.reset();
    } catch (const ContractError&) {  // named when it is stored
    }
  });
}

// Makes the header; if the first images differ in size, uses only those of the most frequent size
// that fits the source.
MemoryHeader Memoriser::make_header_from_waiting(Executor& executor) const {
  const auto first = std::span(waiting_).first(std::min(scale_views, waiting_.size()));
  const auto header_of = [&](std::span<const Observation> some) {
    return make_memory_header(some, *options_.source, options_.signature, options_.preprocessing,
                              executor);
  };
  try {
    return header_of(first);
  } catch (const Error&) {
    if (!options_.left_out) throw;
    std::map<std::pair<int, int>, std::vector<Observation>> by_size;
    for (const Observation& observation : first) {
      if (const auto* image = std::get_if<Image>(&observation.picture)) {
        by_size[{image->width(), image->height()}].push_back(observation);
      } else {
        const auto& panorama = std::get<Panorama>(observation.picture);
        by_size[{panorama.columns(), panorama.rows()}].push_back(observation);
      }
    }
    if (by_size.size() < 2) throw;
    std::vector<std::span<const Observation>> of_one_size;
    for (const auto& [size, observations] : by_size) of_one_size.emplace_back(observations);
    std::ranges::stable_sort(of_one_size, std::greater{},
                             [](std::span<const Observation> some) { return some.size(); });
    for (const std::span<const Observation> some : of_one_size) {
      try {
        return header_of(some);
      } catch (const Error&) {
        continue;  // its images are named and left out
      }
    }
    throw;
  }
}

void Memoriser::make_encoders(const PictureSource& source) {
  encoder_.emplace(file_->header(), source);
  feature_encoder_.emplace(file_->header(), source, has_narrow_features(*file_));
}

void Memoriser::make_file(Executor& executor) {
  const MemoryHeader header = make_header_from_waiting(executor);
  if (options_.narrow && !header.elevations) {
    throw ContractError("option narrow", "set",
                        "not set, as the elevations of the images are unknown; set elevation_deg");
  }
  file_ = MemoryFile::create(path_, header);
  if (options_.narrow) set_narrow_features(*file_);
  make_encoders(*options_.source);
  store(std::exchange(waiting_, {}), executor);
}

void Memoriser::store(std::span<const Observation> observations, Executor& executor) {
  std::vector<NewView> views(observations.size());
  std::vector<std::exception_ptr> failures(observations.size());
  parallel_for(executor, observations.size(), [&](std::size_t i) {
    const Observation& observation = observations[i];
    try {
      views[i].info = {observation.name, observation.pose, observation.stamp_s};
      const bool features = options_.features && file_->header().elevations;
      if (options_.thumbnails || features) {
        const Panorama panorama = encoder_->panorama(observation);
        views[i].signature = encoder_->packed(panorama);
        if (options_.thumbnails) views[i].thumbnail = encode_thumbnail(panorama);
        if (features) views[i].features = feature_encoder_->packed(observation, panorama);
      } else {
        views[i].signature = encoder_->packed(observation);
      }
    } catch (const Error&) {
      failures[i] = std::current_exception();
    }
  });
  std::vector<NewView> unknown;
  std::vector<std::size_t> path_starts;  // numbers of unknown views
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& name = observations[i].name;
    try {
      const auto known = find(name);
      if (known || failures[i]) recall(name, observations[i].odometry);
      if (failures[i]) {
        try {
          std::rethrow_exception(failures[i]);
        } catch (const Error& error) {
          if (!options_.left_out) throw;
          options_.left_out(observations[i], error);
          continue;
        }
      }
      if (known) {
        require_same_view(observations[i], views[i].signature, *known);
        ++counts_.known_before;
        continue;
      }
    } catch (const Error&) {
      append(unknown, path_starts);
      throw;
    }
    if (observations[i].pose) remove_positions_from_map(*file_);
    if (observations[i].odometry) odometry_.insert_or_assign(name, *observations[i].odometry);
    if (does_begin_path(name, unknown.empty())) path_starts.push_back(unknown.size());
    unknown.push_back(std::move(views[i]));
    before_ = name;
    known_before_.reset();
  }
  append(unknown, path_starts);
}

bool Memoriser::is_on_path_of_last_view(const std::string& name) const {
  const std::vector<ViewId> stored = file_->views();
  if (stored.empty()) return false;
  const std::array last{stored.back()};
  return get_path_name(file_->load(last).info(last.front()).name) == get_path_name(name);
}

// Stores new views and which of them begin a path. An image that is the only one of its input
// continues the path of the memory, so its start is stored only with the next image.
void Memoriser::append(std::vector<NewView>& views, std::vector<std::size_t>& path_starts) {
  if (views.empty()) return;
  const bool is_alone = counts_.appended + views.size() == 1 && !has_recalled_ &&
                        is_on_path_of_last_view(views.front().info.name);
  file_->change([&] {
    const std::vector<ViewId> ids = file_->append(views);
    std::vector<ViewId> starts;
    if (const auto start = std::exchange(lone_start_, std::nullopt)) starts.push_back(*start);
    for (const std::size_t start : path_starts) starts.push_back(ids[start]);
    if (is_alone && !starts.empty()) {
      lone_start_ = starts.back();
      starts.clear();
    }
    add_path_starts(*file_, starts);
  });
  counts_.appended += views.size();
  views.clear();
  path_starts.clear();
}

bool Memoriser::does_begin_path(const std::string& name, bool is_first_of_batch) const {
  const bool is_same_path = before_ && get_path_name(*before_) == get_path_name(name);
  if (!is_first_of_batch) return !is_same_path || known_before_;
  if (is_same_path && !known_before_) return false;
  const std::vector<ViewId> stored = file_->views();
  return !stored.empty() && !(is_same_path && *known_before_ == stored.back());
}

std::optional<ViewId> Memoriser::find(const std::string& name) const {
  if (!file_) return std::nullopt;
  const auto renamed = renamed_.find(name);
  return renamed != renamed_.end() ? renamed->second : file_->find(name);
}

void Memoriser::recognise_renamed(const Dataset& recording) {
  if (file_) renamed_ = find_renamed_views(recording, *file_, *encoder_);
}

void Memoriser::require_same_view(const Observation& observation, const PackedSignature& signature,
                                  ViewId view) {
  const VisualMemory there = file_->load(std::array{view});
  const ReferenceInfo& info = there.info(view);
  // Accepts a pose that the observation does not have, as it may come from a map.
  if ((observation.pose && info.pose != observation.pose) || info.stamp_s != observation.stamp_s) {
    throw_different_view(path_, observation.name,
                         "a view with another pose or stamp under the name");
  }
  if (!is_same_picture(signature, there.packed(view))) {
    throw_different_view(path_, observation.name, "another image under the name");
  }
}

Memoriser::Counts Memoriser::finish() {
  Executor alone;
  return finish(alone);
}

void Memoriser::recall(const std::string& name, const std::optional<Pose2>& odometry) {
  const auto known = find(name);
  if (odometry) {
    const bool is_renamed = known && renamed_.contains(name);
    odometry_.insert_or_assign(
        is_renamed ? file_->load(std::array{*known}).info(*known).name : name, *odometry);
  }
  if (!known) return;
  has_recalled_ = true;
  before_ = name;
  known_before_ = known;
}

Memoriser::Counts Memoriser::finish(Executor& executor, const std::function<void()>& mapped) {
  if (!file_) make_file(executor);
  counts_.map = describe_map(*file_);
  if (options_.map && (counts_.appended > 0 || !counts_.map)) {
    counts_.map = map_views(*file_, odometry_, executor, mapped);
  }
  learn_and_store_models(*file_, executor);
  return counts_;
}

}  // namespace panonav
