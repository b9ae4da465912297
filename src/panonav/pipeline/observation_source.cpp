#include "panonav/pipeline/observation_source.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/media_kind.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/motion/path.hpp"

namespace panonav {

Observation read_observation(const DatasetEntry& entry, PictureColours colours) {
  Observation observation(colours == PictureColours::grey ? read_grey_picture(entry)
                                                          : read_picture(entry));
  observation.name = entry.file;
  observation.file = entry.path;
  observation.stamp_s = entry.stamp_s;
  observation.odometry = entry.odometry;
  observation.pose = entry.pose;
  observation.tilt = entry.tilt;
  return observation;
}

std::vector<Pose2> dataset_poses(const Dataset& dataset) {
  std::vector<Pose2> poses;
  bool headings = true;
  for (const auto& entry : dataset.entries) {
    if (!entry.pose) return {};
    headings = headings && entry.pose->heading_rad;
    poses.push_back({entry.pose->x_m, entry.pose->y_m, entry.pose->heading_rad.value_or(0.0)});
  }
  if (headings || poses.size() < 2) return headings ? poses : std::vector<Pose2>{};
  return estimate_headings(positions_of(poses));
}

bool has_odometry(const Dataset& dataset) {
  return std::ranges::any_of(dataset.entries,
                             [](const DatasetEntry& entry) { return entry.odometry.has_value(); });
}

bool is_motion_by_images(std::span<const DatasetEntry> entries, std::size_t index) {
  const std::size_t first = index - std::min<std::size_t>(index, 1);
  const std::size_t count = std::min(index + 2, entries.size()) - first;
  return std::ranges::any_of(entries.subspan(first, count),
                             [](const DatasetEntry& entry) { return !entry.odometry; });
}

namespace {

/// Checks the picture of an entry and returns its size; otherwise sets `fault`.
ImageSize check_picture(const DatasetEntry& entry, const PictureSource& source, bool head_only,
                        std::string& fault) {
  try {
    const ImageSize size = entry.store ? read_picture(entry).size()
                           : head_only ? read_image_size(entry.path)
                                       : check_image(entry.path);
    require_picture_size(source, size);
    return size;
  } catch (const FileError& error) {
    const std::string prefix = entry.path.string() + ": ";
    fault = error.what();
    if (fault.starts_with(prefix)) fault.erase(0, prefix.size());
  } catch (const ContractError& error) {
    fault = error.what();
  }
  return {};
}

/// True if the picture is a file of its own, also one that a store decodes.
bool is_file_of_one_picture(const DatasetEntry& entry) {
  return !entry.store || identify_media_file(entry.path) == MediaKind::foreign_picture;
}

/// Returns the size that most pictures have, the first of these if there are several; 0 is no size.
ImageSize find_most_frequent_size(const std::vector<ImageSize>& sizes) {
  const auto count = [&](const ImageSize& size) {
    return size == ImageSize{} ? 0 : std::ranges::count(sizes, size);
  };
  std::vector<ImageSize> different;
  for (const ImageSize& size : sizes) {
    if (std::ranges::find(different, size) == different.end()) different.push_back(size);
  }
  return *std::ranges::max_element(different, {}, count);
}

}  // namespace

void leave_out_unusable_pictures(Dataset& dataset, Executor& executor, bool heads_only) {
  auto& entries = dataset.entries;
  if (entries.size() < 2 || !std::ranges::all_of(entries, is_file_of_one_picture)) return;
  std::vector<std::string> faults(entries.size());
  std::vector<ImageSize> sizes(entries.size());
  executor.for_each_chunk(entries.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
    sizes[i] = check_picture(entries[i], dataset.source, heads_only, faults[i]);
  });
  if (dataset.source.kind == PictureKind::panorama) {
    const ImageSize usual = find_most_frequent_size(sizes);
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (!faults[i].empty() || sizes[i] == usual) continue;
      faults[i] = "size is " + std::to_string(sizes[i].width) + " x " +
                  std::to_string(sizes[i].height) + " px; allowed: " + std::to_string(usual.width) +
                  " x " + std::to_string(usual.height) + " px, as most of the images";
    }
  }
  std::vector<DatasetEntry> usable;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (faults[i].empty()) {
      usable.push_back(std::move(entries[i]));
    } else {
      dataset.unusable.push_back({entries[i].file, entries[i].path, faults[i]});
    }
  }
  entries = std::move(usable);
  require_usable_entries(dataset);
}

DatasetObservations::DatasetObservations(Dataset dataset, Executor& executor,
                                         PictureColours colours)
    : dataset_(std::move(dataset)), executor_(&executor), colours_(colours) {}

std::optional<Observation> DatasetObservations::next() {
  if (next_ == size()) return std::nullopt;
  if (next_ == first_decoded_ + decoded_.size()) {
    first_decoded_ = next_;
    decoded_.clear();
    const std::size_t affordable = std::max<std::size_t>(
        max_decoded_bytes / largest_bytes_, static_cast<std::size_t>(executor_->threads()));
    decoded_.resize(std::min({affordable, decoded_ahead, size() - next_}));
    executor_->for_each_chunk(decoded_.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      try {
        decoded_[i].observation = read_observation(dataset_.entries[first_decoded_ + i], colours_);
      } catch (const Error&) {
        decoded_[i].failure = std::current_exception();
      }
    });
  }
  Decoded& decoded = decoded_[next_++ - first_decoded_];
  if (decoded.failure) std::rethrow_exception(decoded.failure);
  if (const Image* const image = std::get_if<Image>(&decoded.observation->picture)) {
    const std::size_t bytes = image->pixels().size();
    largest_bytes_ = std::exchange(is_size_known_, true) ? std::max(largest_bytes_, bytes) : bytes;
  }
  return std::exchange(decoded.observation, std::nullopt);
}

}  // namespace panonav
