#include "runs/web_folder.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/json.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/unfinished_folder.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/view_list.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* memory_file_name = "memory.panonav";
constexpr const char* picture_folder = "pictures";
/// Files without which the page does not work; the folder has others, too.
constexpr std::string_view page_files[] = {"index.html", "panonav_web.mjs", "panonav_web.wasm"};

bool is_complete_page(const fs::path& folder) {
  std::error_code error;
  return std::ranges::all_of(
      page_files, [&](std::string_view file) { return fs::is_regular_file(folder / file, error); });
}

void copy_page(const fs::path& page, const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(page)) {
    if (!entry.is_regular_file()) continue;
    std::error_code error;
    fs::copy_file(entry.path(), folder / entry.path().filename(), error);
    if (error) throw FileError(entry.path().string(), "cannot be copied: " + error.message());
  }
}

/// Averages squares of pixels, so that the image has at most 512 columns.
Image shrink_for_page(const Image& image) {
  constexpr int max_columns = 512;
  const int step = (image.width() + max_columns - 1) / max_columns;
  if (step == 1 || image.height() < step) return image;
  Image small(image.width() / step, image.height() / step, image.channels());
  for (int v = 0; v < small.height(); ++v) {
    for (int u = 0; u < small.width(); ++u) {
      for (int c = 0; c < small.channels(); ++c) {
        int sum = 0;
        for (int y = 0; y < step; ++y) {
          for (int x = 0; x < step; ++x) sum += image.at(u * step + x, v * step + y, c);
        }
        small.at(u, v, c) = static_cast<std::uint8_t>(sum / (step * step));
      }
    }
  }
  return small;
}

/// Returns the views that are images of the recording, with these images. A view on a floor has the
/// name of the floor before that of its image.
std::vector<std::pair<ViewId, const DatasetEntry*>> find_pictured_views(
    const std::vector<ViewRecord>& views, const Dataset& recording) {
  std::map<std::string_view, const DatasetEntry*> entries;
  for (const DatasetEntry& entry : recording.entries) entries[entry.file] = &entry;
  std::vector<std::pair<ViewId, const DatasetEntry*>> found;
  for (const ViewRecord& view : views) {
    const std::string_view name = view.info.name;
    auto entry = entries.find(name);
    if (entry == entries.end()) entry = entries.find(name.substr(name.find('/') + 1));
    if (entry != entries.end()) found.emplace_back(view.view, entry->second);
  }
  return found;
}

/// Writes pictures/ID.jpg for each view that is in the recording; returns their ids.
std::vector<std::uint32_t> write_pictures(const std::vector<ViewRecord>& views,
                                          const Dataset& recording, const UnfinishedFolder& out,
                                          Executor& executor,
                                          const std::function<void()>& advance) {
  const auto pictured = find_pictured_views(views, recording);
  if (pictured.empty()) {
    throw FileError(recording.folder.string(),
                    "contains no image with the name of a view; allowed: the recording from which "
                    "the memory was made");
  }
  std::vector<std::uint32_t> ids;
  process_in_order(
      pictured.size(), executor,
      [&](std::size_t i) {
        const Image small = shrink_for_page(read_picture(*pictured[i].second));
        return encode_jpeg(small.view(), 80);
      },
      [&](std::size_t i, const std::vector<std::uint8_t>& file) {
        ids.push_back(pictured[i].first.value);
        out.append(fs::path(picture_folder) / (std::to_string(ids.back()) + ".jpg"), file);
        if (advance) advance();
      });
  return ids;
}

}  // namespace

fs::path find_web_page() {
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = here.parent_path() / "share/panonav/web";
  const char* const stated = std::getenv("PANONAV_WEB_PAGE");
  const bool is_stated = stated != nullptr && *stated != '\0';
  const std::vector<fs::path> folders =
      is_stated ? std::vector<fs::path>{stated}
                : std::vector<fs::path>{installed, here.parent_path().parent_path() / "web/bin"};
  for (const fs::path& folder : folders) {
    if (is_complete_page(folder)) return folder;
  }
  throw FileError(folders.front().string(),
                  "does not contain the page; it is made from the source of panonav with the "
                  "package emscripten: tools/get_sqlite && cmake --preset web && cmake --build "
                  "--preset web");
}

WebFolder write_web_folder(const MemoryFile& memory, const fs::path& page, const Dataset* recording,
                           const fs::path& folder, Executor& executor,
                           const std::function<void()>& advance) {
  const auto views = list_views(memory);
  if (views.empty()) throw FileError(memory.path().string(), "contains no view to export");
  UnfinishedFolder unfinished(folder);
  const fs::path& out = unfinished.path();
  copy_page(page, out);
  memory.copy_to(out / memory_file_name);
  WebFolder done{.views = views.size()};
  done.thumbnails = static_cast<std::size_t>(std::ranges::count_if(views, &ViewRecord::thumbnail));
  ordered_json description{
      {"name", to_readable_line(fs::path(memory_name(memory.path())).stem().string())},
      {"file", memory_file_name},
      {"bytes", fs::file_size(out / memory_file_name)}};
  if (recording != nullptr) {
    const auto ids = write_pictures(views, *recording, unfinished, executor, advance);
    done.pictures = ids.size();
    description["pictures"] = ids;
  }
  fs::remove(out / "memory.json");  // of a page without a memory
  write_file(out / "memory.json", json_line(description) + "\n");
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    if (entry.is_regular_file()) done.bytes += entry.file_size();
  }
  unfinished.finish();
  return done;
}

}  // namespace panonav::command
