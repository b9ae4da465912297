#include "panonav/pipeline/memory_export.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/unfinished_folder.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

/// True if the name is a valid relative file name and does not collide with another file of the
/// export.
bool is_file_name(const std::string& name) {
  constexpr std::array<std::string_view, 8> own{"dataset.toml", "poses.csv",      "images.csv",
                                                "views.csv",    "signatures.npy", "memorise.toml",
                                                "camera.toml",  "camera_mask.png"};
  constexpr std::size_t max_part_bytes = 200;
  constexpr std::size_t max_bytes = 1000;
  const fs::path path(name);
  if (to_readable_line(name) != name || name.size() > max_bytes || path.is_absolute() ||
      path.lexically_normal().string() != name || !path.has_filename() ||
      std::ranges::find(own, path.begin()->string()) != own.end()) {
    return false;
  }
  return std::ranges::none_of(path, [](const fs::path& part) {
    return part == ".." || part == "." || part.string().size() > max_part_bytes;
  });
}

/// Returns a file name for each view's image: the view's name if that is possible.
std::vector<std::string> choose_picture_names(const std::vector<ViewRecord>& views) {
  std::set<std::string> files;
  std::set<std::string> folders;
  const auto take = [&](const std::string& name) {
    std::set<std::string> above;
    for (fs::path folder = fs::path(name).parent_path(); !folder.empty();
         folder = folder.parent_path()) {
      above.insert(folder.string());
      if (files.contains(folder.string())) return false;
    }
    if (folders.contains(name) || !files.insert(name).second) return false;
    folders.merge(above);
    return true;
  };
  std::vector<std::string> names(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string& name = views[i].info.name;
    if (is_file_name(name) && take(name)) names[i] = name;
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!names[i].empty()) continue;
    names[i] = "view_" + std::to_string(views[i].view.value) + ".png";
    while (!take(names[i])) names[i] += '_';
  }
  return names;
}

/// Writes options as the sections of a --config file.
class OptionText final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override { add(info, std::to_string(value)); }
  void visit(const OptionInfo& info, double& value) override { add(info, to_text(value)); }
  void visit(const OptionInfo& info, bool& value) override { add(info, value ? "true" : "false"); }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    std::string quoted = "\"";
    quoted.append(choices[static_cast<std::size_t>(value)]).append("\"");
    add(info, quoted);
  }
  template <class Options>
  void section(const std::string& name, Options options) {
    text.append("[").append(name).append("]\n");
    visit_options(options, *this);
  }
  std::string text;

 private:
  void add(const OptionInfo& info, const std::string& value) {
    text += std::string(info.name) + " = " + value + "\n";
  }
};

/// Returns a view's thumbnail as a PNG of the size of the memory's panoramas; empty if it has none
/// or another one. One thread at a time uses the memory, with `reading` locked.
Bytes enlarge_thumbnail(const MemoryFile& memory, ViewId view, std::mutex& reading) {
  std::unique_lock lock(reading);
  const auto thumbnail = memory.thumbnail(view);
  lock.unlock();
  if (!thumbnail) return {};
  const auto panorama = panorama_from_thumbnail(*thumbnail, memory.header());
  if (!panorama) return {};
  const Image picture = to_picture(*panorama);
  return encode_png(picture.view());
}

/// Writes an array in NumPy's format 1.0: 8-bit integers, views x (magnitudes, phases) x components
/// x rows.
void write_npy_array(const MemoryFile& memory, const std::vector<ViewRecord>& views,
                     const UnfinishedFolder& folder) {
  const SignatureShape shape = memory.header().shape;
  std::string head = "{'descr': '|u1', 'fortran_order': False, 'shape': (" +
                     std::to_string(views.size()) + ", 2, " + std::to_string(shape.components) +
                     ", " + std::to_string(shape.rows) + "), }";
  constexpr std::size_t before = 10;
  head.append(63 - (before + head.size()) % 64, ' ').push_back('\n');
  Bytes bytes{0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0};
  bytes.push_back(static_cast<std::uint8_t>(head.size() & 255U));
  bytes.push_back(static_cast<std::uint8_t>(head.size() >> 8U));
  bytes.insert(bytes.end(), head.begin(), head.end());
  constexpr std::size_t part_bytes = 1U << 20U;
  const auto write_part = [&] {
    folder.append("signatures.npy", bytes);
    bytes.clear();
  };
  auto next = views.begin();
  memory.read_views([&](ViewId view, const ReferenceInfo&, const PackedSignature& signature) {
    if (next == views.end() || next->view != view) return;  // added by another process since
    ++next;
    bytes.insert(bytes.end(), signature.magnitudes.begin(), signature.magnitudes.end());
    bytes.insert(bytes.end(), signature.phases.begin(), signature.phases.end());
    if (bytes.size() >= part_bytes) write_part();
  });
  if (next != views.end()) {
    throw FileError(memory.path().string(), "lost view " + next->info.name +
                                                " during the export, because another process "
                                                "changed the memory; export it again");
  }
  write_part();
}

}  // namespace

MemoryExport export_memory(const MemoryFile& memory, const fs::path& folder) {
  Executor alone;
  return export_memory(memory, folder, alone);
}

MemoryExport export_memory(const MemoryFile& memory, const fs::path& folder, Executor& executor,
                           const std::function<void()>& advance) {
  const MemoryHeader& header = memory.header();
  const auto views = list_views(memory);
  if (views.empty()) throw FileError(memory.path().string(), "contains no view to export");
  UnfinishedFolder unfinished(folder);
  const fs::path& out = unfinished.path();
  MemoryExport done{.views = views.size()};
  done.enlarged = thumbnail_columns(header) < header.panorama_columns;
  // Positions of a data set are in metres.
  const LengthUnit unit = read_length_unit(memory);
  Dataset dataset;
  dataset.folder = out;
  dataset.source.layout = {.forward_column = picture_forward_column(header.panorama_columns),
                           .elevations = header.elevations};
  // A thumbnail with fewer than two columns per period of the highest component would alias.
  const bool large_enough = thumbnail_columns(header) >= 2 * header.shape.components;
  std::vector<std::string> files = choose_picture_names(views);
  std::mutex reading;
  const auto make_picture = [&](std::size_t i) {
    return large_enough ? enlarge_thumbnail(memory, views[i].view, reading) : Bytes{};
  };
  const auto write_picture = [&](std::size_t i, Bytes&& picture) {
    const ReferenceInfo& info = views[i].info;
    if (picture.empty()) {
      files[i].clear();
    } else {
      unfinished.append(unescape_name(files[i]), picture);
      // The table does not need the paths, which would take half of the memory.
      dataset.entries.push_back({.file = files[i],
                                 .path = {},
                                 .stamp_s = info.stamp_s,
                                 .pose = unit == LengthUnit::metres ? info.pose : std::nullopt});
      if (files[i] != info.name) ++done.renamed;
    }
    if (advance) advance();
  };
  process_in_order(views.size(), executor, make_picture, write_picture);
  done.pictures = dataset.entries.size();

  write_file(out / "views.csv", std::string_view(format_view_table(views, unit, files)));
  write_npy_array(memory, views, unfinished);
  OptionText options;
  options.text = "[signature]\ncomponents = ";  // rows and columns come from the pictures
  options.text.append(std::to_string(header.shape.components)).append("\n");
  options.section("preprocessing", header.preprocessing);
  write_file(out / "memorise.toml", std::string_view(options.text));
  if (header.source.camera) {
    write_camera(out / "camera.toml", {*header.source.camera, header.source.mask});
  }
  if (done.pictures > 0) {
    const Dataset::Fields known = find_known_fields(dataset);
    done.positions = known.positions;
    done.headings = known.headings;
    done.stamps = known.stamps;
    write_dataset(dataset);
  }
  unfinished.finish();
  return done;
}

}  // namespace panonav
