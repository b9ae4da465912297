#include "panonav/pipeline/known_views.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <variant>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

/// Returns a hash of the recording's names, poses, stamps, file sizes and times, and of the
/// layout of its images.
std::string compute_fingerprint(const Dataset& recording, const MemoryFile& memory) {
  RecordBytes bytes;
  MemoryHeader read_as = memory.header();
  read_as.source = recording.source;
  for (const auto& [key, value] : to_settings(read_as)) {
    bytes.add(key);
    std::visit([&](const auto& typed) { bytes.add(typed); }, value);
  }
  for (const auto& entry : recording.entries) {
    bytes.add(entry.file);
    bytes.add(entry.stamp_s);
    if (entry.pose) {
      bytes.add(entry.pose->x_m);
      bytes.add(entry.pose->y_m);
      bytes.add(entry.pose->heading_rad);
    } else {
      bytes.add_null();
    }
    std::error_code ignored;
    bytes.add(static_cast<std::int64_t>(fs::file_size(entry.path, ignored)));
    const auto changed = fs::last_write_time(entry.path, ignored).time_since_epoch();
    bytes.add(static_cast<std::int64_t>(changed.count()));
  }
  return to_hex_digits(checksum(bytes.bytes()), 16);
}

bool is_known_recording(const MemoryFile& memory, const std::string& mark) {
  const auto marks = split_words(memory.parameter(recordings_parameter).value_or(""));
  return std::ranges::find(marks, mark) != marks.end();
}

/// An entry of a recording and the view of its name.
struct KnownEntry {
  const DatasetEntry* entry;
  ViewId view;
};

/// Calls `visit` for 32 entries at a time, with a memory of their views.
void visit_batches(
    const MemoryFile& memory, std::span<const KnownEntry> known,
    const std::function<void(std::span<const KnownEntry>, const VisualMemory&)>& visit) {
  constexpr std::size_t batch = 32;
  for (; !known.empty(); known = known.subspan(std::min(batch, known.size()))) {
    const auto entries = known.first(std::min(batch, known.size()));
    std::set<ViewId> views;  // a name may occur twice
    for (const KnownEntry& one : entries) views.insert(one.view);
    visit(entries, memory.load(std::vector(views.begin(), views.end())));
  }
}

}  // namespace

void check_known_views(const Dataset& recording, const MemoryFile& memory,
                       const ViewEncoder& encoder, Executor& executor,
                       const std::function<void(std::size_t)>& compared,
                       const std::function<void(const DatasetEntry&, const Error&)>& unread) {
  std::vector<KnownEntry> known;
  for (const auto& entry : recording.entries) {
    if (const auto view = memory.find(entry.file)) known.push_back({&entry, *view});
  }
  visit_batches(memory, known, [&](std::span<const KnownEntry> entries, const VisualMemory& views) {
    for (const auto& [entry, view] : entries) {
      const auto& info = views.info(view);
      // Accepts a pose that the recording does not have, as it may come from a map.
      if ((entry->pose && info.pose != entry->pose) || info.stamp_s != entry->stamp_s) {
        throw_different_view(memory.path(), entry->file,
                             "a view with another pose or stamp under the name");
      }
    }
  });
  if (known.empty() || is_known_recording(memory, compute_fingerprint(recording, memory))) return;

  visit_batches(memory, known, [&](std::span<const KnownEntry> entries, const VisualMemory& views) {
    std::vector<std::optional<PackedSignature>> signatures(entries.size());
    std::vector<std::optional<FileError>> failures(entries.size());
    parallel_for(executor, entries.size(), [&](std::size_t i) {
      try {
        signatures[i] = encoder.packed(read_observation(*entries[i].entry, PictureColours::grey));
      } catch (const FileError& error) {
        failures[i] = error;
      }
    });
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const auto& [entry, view] = entries[i];
      if (failures[i]) {
        if (!unread) throw *failures[i];
        unread(*entry, *failures[i]);
        continue;
      }
      if (!is_same_picture(*signatures[i], views.packed(view))) {
        throw_different_view(memory.path(), entry->file, "another image under the name");
      }
    }
    if (compared) compared(entries.size());
  });
}

std::map<std::string, ViewId> find_renamed_views(const Dataset& recording, const MemoryFile& memory,
                                                 const ViewEncoder& encoder) {
  std::vector<std::optional<ViewId>> known;  // by entry
  std::set<ViewId> assigned;
  for (const DatasetEntry& entry : recording.entries) {
    known.push_back(memory.find(entry.file));
    if (known.back()) assigned.insert(*known.back());
  }
  std::map<std::string, ViewId> renamed;
  if (assigned.empty() || std::ranges::all_of(known, [](const auto& view) { return !!view; })) {
    return renamed;
  }
  const std::vector<ViewId> ids = memory.views();
  const auto assign_if_same = [&](std::size_t i, ViewId view) {
    if (assigned.contains(view)) return;
    const DatasetEntry& entry = recording.entries[i];
    const VisualMemory views = memory.load(std::array{view});
    const ReferenceInfo& info = views.info(view);
    if ((entry.pose && info.pose != entry.pose) || info.stamp_s != entry.stamp_s) {
      return;
    }
    try {
      if (!is_same_picture(encoder.packed(read_observation(entry, PictureColours::grey)),
                           views.packed(view)))
        return;
    } catch (const Error&) {
      return;  // is named and skipped when it is memorised
    }
    known[i] = view;
    assigned.insert(view);
    renamed.emplace(entry.file, view);
  };
  for (std::size_t i = 1; i < known.size(); ++i) {
    if (known[i] || !known[i - 1]) continue;
    const auto next = std::ranges::upper_bound(ids, *known[i - 1]);
    if (next != ids.end()) assign_if_same(i, *next);
  }
  for (std::size_t i = known.size(); i-- > 1;) {
    if (known[i - 1] || !known[i]) continue;
    const auto at = std::ranges::lower_bound(ids, *known[i]);
    if (at != ids.begin()) assign_if_same(i - 1, *std::prev(at));
  }
  return renamed;
}

void remember_recording(const Dataset& recording, MemoryFile& memory) {
  if (recording.entries.size() < 2) return;  // comparing one image costs less than a mark for each
  const std::string mark = compute_fingerprint(recording, memory);
  if (is_known_recording(memory, mark)) return;
  const std::string before = memory.parameter(recordings_parameter).value_or("");
  memory.set_parameter(recordings_parameter, before.empty() ? mark : before + " " + mark);
}

void forget_recordings(MemoryFile& memory) {
  if (memory.parameter(recordings_parameter)) memory.set_parameter(recordings_parameter, "");
}

bool is_same_picture(const PackedSignature& a, const PackedSignature& b) {
  constexpr int clear_magnitude = 8;  // below it, phases are dominated by rounding
  for (std::size_t i = 0; i < a.magnitudes.size(); ++i) {
    if (std::abs(a.magnitudes[i] - b.magnitudes[i]) > 1) return false;
    if (a.magnitudes[i] < clear_magnitude) continue;
    const int steps = std::abs(a.phases[i] - b.phases[i]);
    if (std::min(steps, 256 - steps) > 1) return false;
  }
  return true;
}

void throw_different_view(const std::filesystem::path& memory, const std::string& name,
                          const std::string& what) {
  throw FileError(memory.string(),
                  "holds " + what + " " + name +
                      "; names must be unique within a memory: rename the images, or memorise them "
                      "into a memory of their own and merge both");
}

}  // namespace panonav
