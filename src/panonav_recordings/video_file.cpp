#include "panonav_recordings/video_file.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/media_kind.hpp"
#include "panonav_recordings/internal/video_index.hpp"
#include "panonav_recordings/internal/video_store.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

/// Small copies that cameras write beside their videos: GoPro and Insta360 .lrv, DJI .lrf, Insta360
/// LRV_*.insv.
bool is_preview(const fs::path& file) {
  const std::string name = to_lower_case(file.filename().string());
  return name.ends_with(".lrv") || name.ends_with(".lrf") || name.starts_with("lrv_");
}

/// Returns the file name with the number of the video before that of the chapter, so that chapters
/// follow each other in natural order: GoPro's GX020001 is the second chapter of video 0001, and
/// its GOPR0001 the first one of the video that GP010001 continues.
std::string make_chapter_key(const fs::path& file) {
  std::string name = file.filename().string();
  const auto digits = [&](std::size_t at, std::size_t count) {
    return name.size() >= at + count &&
           std::all_of(name.begin() + static_cast<std::ptrdiff_t>(at),
                       name.begin() + static_cast<std::ptrdiff_t>(at + count),
                       [](char c) { return c >= '0' && c <= '9'; });
  };
  if (name.starts_with("GOPR") && digits(4, 4)) return "GP" + name.substr(4, 4) + "00";
  const bool is_gopro = name.size() >= 8 && name[0] == 'G' && name[1] >= 'A' && name[1] <= 'Z' &&
                        digits(2, 6) && !(name.size() > 8 && digits(8, 1));
  return is_gopro ? name.substr(0, 2) + name.substr(4, 4) + name.substr(2, 2) : name;
}

/// Returns the videos of a folder without images or description, in order; empty if it is no such
/// folder. Previews are left out where there are others.
std::vector<fs::path> list_chapters(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const char* name : {"dataset.toml", "metadata.yaml"}) {
    if (fs::exists(folder / name, error)) return {};
  }
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& file = entry->path();
    if (is_hidden(file)) continue;
    if (is_folder_picture(file)) return {};
    if (identify_media_file(file) == MediaKind::video) files.push_back(file);
  }
  if (!std::ranges::all_of(files, is_preview)) std::erase_if(files, is_preview);
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return is_naturally_less(make_chapter_key(a), make_chapter_key(b));
  });
  return files;
}

/// Returns the file of the other lens (Insta360: VID_*_00_*.insv and VID_*_10_*.insv), if it
/// exists; an empty path if there is none. `number`: "_00_" or "_10_", that of the other lens.
fs::path find_other_lens(const fs::path& file, const std::string& number) {
  const std::string own = number == "_10_" ? "_00_" : "_10_";
  std::string name = file.filename().string();
  const std::size_t at = name.rfind(own);
  if (!name.starts_with("VID_") || to_lower_case(file.extension().string()) != ".insv" ||
      at == std::string::npos) {
    return {};
  }
  name.replace(at, own.size(), number);
  std::error_code error;
  const fs::path other = file.parent_path() / name;
  return fs::is_regular_file(other, error) ? other : fs::path();
}

/// Replaces files of second lenses by those of the first ones, each once.
std::vector<fs::path> list_first_lenses(const std::vector<fs::path>& files) {
  std::vector<fs::path> first;
  for (const fs::path& file : files) {
    const fs::path other = find_other_lens(file, "_00_");
    const fs::path& chosen = other.empty() ? file : other;
    const bool is_lens = !find_other_lens(chosen, "_10_").empty();
    if (!is_lens || std::ranges::find(first, chosen) == first.end()) first.push_back(chosen);
  }
  return first;
}

/// Reads the chapters of a video as one data set, whose stamps continue from file to file.
Dataset read_chapters(const std::vector<fs::path>& files, const fs::path& folder,
                      PictureSource source, const Dataset::Selection& selection,
                      const ImageLimits& limits) {
  Dataset dataset{folder, std::move(source), {}, {}};
  std::vector<VideoIndex> indices;
  struct Place {
    std::size_t file;
    std::size_t number;
  };
  std::vector<Place> places;
  double offset_s = 0.0;
  for (const fs::path& file : files) {
    const VideoIndex& index = indices.emplace_back(
        read_video_index(file.string(), find_other_lens(file, "_10_").string()));
    const ImageSize& first = indices.front().size;
    if (index.size != first || (index.right_track < 0) != (indices.front().right_track < 0)) {
      throw FileError(file.string(), "its images are " + std::to_string(index.size.width) + " x " +
                                         std::to_string(index.size.height) +
                                         " px; allowed: " + std::to_string(first.width) + " x " +
                                         std::to_string(first.height) + " px, as those of " +
                                         files.front().string());
    }
    const double first_s = static_cast<double>(index.stamps.front()) * index.unit_s;
    const double last_s = static_cast<double>(index.stamps.back()) * index.unit_s;
    if (indices.size() > 1) offset_s -= first_s;
    for (std::size_t i = 0; i < index.stamps.size(); ++i) {
      const double own_s = static_cast<double>(index.stamps[i]) * index.unit_s;
      DatasetEntry entry;
      entry.stamp_s = offset_s + own_s;
      entry.file = escape_name(file.filename().string()) + "@" + format_fixed(own_s, 6);
      entry.path = file;
      entry.store_index = places.size();
      places.push_back({indices.size() - 1, i});
      dataset.entries.push_back(std::move(entry));
    }
    const auto steps = static_cast<double>(std::max<std::size_t>(1, index.stamps.size() - 1));
    offset_s += last_s + (last_s - first_s) / steps;
  }
  select_pictures(dataset, selection);
  std::vector<VideoIndex> chosen = indices;
  for (VideoIndex& index : chosen) index.stamps.clear();
  std::vector<std::size_t> file_numbers;
  for (DatasetEntry& entry : dataset.entries) {
    const Place& place = places[entry.store_index];
    auto& stamps = chosen[place.file].stamps;
    stamps.push_back(indices[place.file].stamps[place.number]);
    entry.store_index = stamps.size() - 1;
    file_numbers.push_back(place.file);
  }
  std::vector<std::shared_ptr<const VideoStore>> stores;
  for (std::size_t i = 0; i < files.size(); ++i) {
    stores.push_back(std::make_shared<const VideoStore>(files[i].string(), std::move(chosen[i]),
                                                        selection.every_s, limits));
  }
  for (std::size_t i = 0; i < file_numbers.size(); ++i) {
    dataset.entries[i].store = stores[file_numbers[i]];
  }
  return dataset;
}

}  // namespace

bool is_video(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return !list_chapters(path).empty();
  return identify_media_file(path) == MediaKind::video;
}

Dataset read_video(const fs::path& path, PictureSource source, const Dataset::Selection& selection,
                   const ImageLimits& limits) {
  return read_videos({path}, std::move(source), selection, limits);
}

Dataset read_videos(const std::vector<fs::path>& paths, PictureSource source,
                    const Dataset::Selection& selection, const ImageLimits& limits) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    if (fs::is_directory(path, error)) {
      const auto chapters = list_chapters(path);
      if (chapters.empty()) throw FileError(path.string(), "contains no video");
      files.insert(files.end(), chapters.begin(), chapters.end());
    } else if (fs::is_regular_file(path, error)) {
      files.push_back(path);
    } else {
      throw FileError(path.string(), "does not exist; allowed: a video");
    }
  }
  if (files.empty()) throw ContractError("videos", 0.0, "1 or more");
  files = list_first_lenses(files);
  Dataset dataset = read_chapters(files, paths.front(), std::move(source), selection, limits);
  if (files.size() > 1) {
    std::string names;
    for (const fs::path& file : files) {
      names += (names.empty() ? "" : ", ") + escape_name(file.filename().string());
    }
    dataset.warnings.push_back("joined in this order: " + shorten_middle(names, 300));
  }
  return dataset;
}

}  // namespace panonav::recordings
