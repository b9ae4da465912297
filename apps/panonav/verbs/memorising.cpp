#include "verbs/memorising.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <unordered_set>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::command {

namespace {

/// How many views the full scale is taken from.
constexpr std::size_t scale_views = 32;

double now_s() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

}  // namespace

MemoryHeader header_from_first_views(const Dataset& recording, const SignatureOptions& wanted,
                                     const PreprocessingOptions& preprocessing,
                                     Executor& executor) {
  MemoryHeader header;
  header.source = recording.source;
  header.preprocessing = preprocessing;
  header.created_s = now_s();
  const PanoramaShape shape = wanted_shape(recording.source, wanted);
  const PanoramaReader reader(recording.source, shape);
  const auto first = reader.read(recording.entries.front().path);
  header.shape = {first.rows(), wanted.components};
  header.panorama_columns = first.columns();
  header.elevations = first.elevations();
  if (recording.source.kind == PictureKind::panorama) {
    const auto [width, height] = read_image_size(recording.entries.front().path);
    const PanoramaShape own{height, width};
    if (own != PanoramaShape{first.rows(), first.columns()}) header.picture_shape = own;
  }
  if (2 * header.shape.components > header.panorama_columns) {
    throw ContractError("components", header.shape.components,
                        "1 to " + std::to_string(header.panorama_columns / 2) +
                            ", half the columns of " + recording.entries.front().path.string());
  }

  const ViewEncoder pipeline(header, recording.source);
  const std::size_t count = std::min(scale_views, recording.entries.size());
  std::vector<float> largest(count, 0.0F);
  for_each_entry(executor, count, [&](std::size_t i) {
    const auto signature = pipeline.signature(pipeline.read(recording.entries[i]));
    largest[i] = largest_structure(signature);
  });
  header.full_scale = *std::max_element(largest.begin(), largest.end());
  if (!(header.full_scale > 0.0F)) {
    throw FileError(recording.entries.front().path.string(),
                    "the first " + std::to_string(count) +
                        " views are of one colour; a memory needs views with structure");
  }
  return header;
}

AppendCounts append_views(const Dataset& recording, const ViewEncoder& pipeline, bool thumbnails,
                          MemoryFile& memory, Session& session) {
  AppendCounts counts;
  std::vector<const DatasetEntry*> missing;
  {
    const auto names = memory.names();
    const std::unordered_set<std::string> known(names.begin(), names.end());
    for (const auto& entry : recording.entries) {
      if (!known.contains(entry.file)) missing.push_back(&entry);
    }
  }
  counts.known_before = recording.entries.size() - missing.size();
  Progress progress("memorising", missing.size());
  constexpr std::size_t batch = 16;
  for (std::size_t begin = 0; begin < missing.size(); begin += batch) {
    const std::size_t count = std::min(batch, missing.size() - begin);
    std::vector<std::optional<NewView>> views(count);
    std::vector<std::exception_ptr> failures(count);
    for_each_entry(session.executor(), count, [&](std::size_t i) {
      const auto& entry = *missing[begin + i];
      try {
        const auto panorama = pipeline.read(entry);
        views[i] = NewView{{entry.file, entry.pose, entry.stamp_s},
                           pipeline.packed(panorama),
                           thumbnails ? thumbnail_png(panorama) : std::vector<std::uint8_t>{}};
      } catch (const Error&) {
        failures[i] = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (failures[i]) std::rethrow_exception(failures[i]);
      (void)memory.append(*views[i]);
      ++counts.appended;
      progress.advance();
    }
  }
  return counts;
}

}  // namespace panonav::command
