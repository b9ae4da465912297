#include "verbs/mapped_run.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct ReadView {
  FourierSignature signature;
  std::vector<std::uint8_t> thumbnail;
};

/// Reads a batch of pictures side by side.
std::vector<std::optional<ReadView>> read_batch(const Dataset& recording, std::size_t begin,
                                                std::size_t count, const ViewEncoder& pipeline,
                                                bool thumbnails, Executor& executor) {
  std::vector<std::optional<ReadView>> views(count);
  std::vector<std::exception_ptr> failures(count);
  for_each_entry(executor, count, [&](std::size_t i) {
    try {
      const Panorama panorama = pipeline.read(recording.entries[begin + i]);
      views[i] = ReadView{pipeline.signature(panorama),
                          thumbnails ? thumbnail_png(panorama) : std::vector<std::uint8_t>{}};
    } catch (const Error&) {
      failures[i] = std::current_exception();
    }
  });
  for (const auto& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
  return views;
}

}  // namespace

std::optional<Pose2> wheel_step(const DatasetEntry& before, const DatasetEntry& after) {
  if (!before.odometry || !after.odometry) return std::nullopt;
  return inverse(*before.odometry) * *after.odometry;
}

std::size_t largest_part(const TopologicalMap& map) {
  std::map<std::size_t, std::size_t> sizes;
  for (const MapNode& node : map.nodes) ++sizes[node.part];
  std::size_t largest = 0;
  for (const auto& [part, size] : sizes) {
    if (size > sizes[largest]) largest = part;
  }
  return largest;
}

MappedRun map_recording(const Dataset& recording, const ViewEncoder& pipeline,
                        const MapSettings& settings, MemoryFile& memory, Session& session) {
  MappedRun run;
  // The nodes so far: a memory that knew what is still to come would be asked another question.
  const MemoryHeader& header = memory.header();
  VisualMemory seen(header.shape, header.full_scale, header.elevations);
  TopologicalMapper mapper(seen, settings.mapping, settings.odometry, settings.closure,
                           settings.graph);
  run.wheels = settings.mapping.wheel_lengths &&
               std::ranges::all_of(recording.entries,
                                   [](const DatasetEntry& e) { return e.odometry.has_value(); });
  Progress progress("mapping", recording.entries.size());
  constexpr std::size_t batch = 16;
  for (std::size_t begin = 0; begin < recording.entries.size(); begin += batch) {
    const std::size_t count = std::min(batch, recording.entries.size() - begin);
    auto views =
        read_batch(recording, begin, count, pipeline, settings.thumbnails, session.executor());
    for (std::size_t i = 0; i < count; ++i) {
      const DatasetEntry& entry = recording.entries[begin + i];
      OdometryView view(std::move(views[i]->signature));
      progress.advance();
      auto start = Clock::now();
      const bool is_node = mapper.is_new(view);
      run.mapping_s += seconds_since(start);
      if (!is_node) {
        ++run.skipped;
        continue;
      }
      const NewView added{{entry.file, entry.pose, entry.stamp_s},
                          pack(view.signature, header.full_scale),
                          std::move(views[i]->thumbnail)};
      const auto known = memory.find(entry.file);
      const ViewId id = known ? *known : memory.append(added);
      const auto moved = run.entries.empty()
                             ? std::nullopt
                             : wheel_step(recording.entries[run.entries.back()], entry);
      start = Clock::now();
      try {
        seen.append_as(id, added.signature, added.info);
        static_cast<void>(mapper.add(id, std::move(view), moved));
      } catch (const ContractError& error) {
        throw FileError(memory.path().string(), entry.file + ": " + error.what());
      }
      run.mapping_s += seconds_since(start);
      run.entries.push_back(begin + i);
    }
  }
  const auto start = Clock::now();
  mapper.finish();
  run.mapping_s += seconds_since(start);
  run.map = mapper.map();
  run.scale_m = mapper.scale_m();
  return run;
}

}  // namespace panonav::command
