#include "panonav/simulation/internal/gazebo_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "panonav/core/error.hpp"
#include "panonav/simulation/load_gazebo.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code);
}

std::string text_without_comments(const fs::path& file) {
  require_scene_file(file);
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)),
                         std::istreambuf_iterator<char>());
  std::string result;
  std::size_t at = 0;
  while (at != std::string::npos) {
    const auto begin = text.find("<!--", at);
    result.append(text, at, begin == std::string::npos ? begin : begin - at);
    const auto end = begin == std::string::npos ? begin : text.find("-->", begin);
    at = end == std::string::npos ? end : end + 3;
  }
  return result;
}

// The parser hands files with another root element to another parser, which prints.
bool is_sdf(const std::string& text) {
  for (auto at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    if (text.compare(at, 2, "<?") == 0 || text.compare(at, 2, "<!") == 0) continue;
    return text.compare(at, 4, "<sdf") == 0;
  }
  return false;
}

// What the <uri> of every <include> says.
std::vector<std::string> included_uris(const std::string& text) {
  std::vector<std::string> uris;
  for (auto at = text.find("<include"); at != std::string::npos; at = text.find("<include", at)) {
    const auto close = std::min(text.find("</include>", at), text.size());
    const std::string_view include(text.data() + at, close - at);
    at = close;
    const auto begin = include.find("<uri>");
    const auto end = include.find("</uri>");
    if (begin == std::string_view::npos || end == std::string_view::npos || begin > end) continue;
    const std::string_view uri = include.substr(begin + 5, end - begin - 5);
    const auto first = uri.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos) continue;
    uris.emplace_back(uri.substr(first, uri.find_last_not_of(" \t\r\n") + 1 - first));
  }
  return uris;
}

// What a file includes, itself counted: how deep, and how many in all.
struct Included {
  int depth = 0;  // 0: not known yet
  double files = 0.0;
};

Included follow_includes(const fs::path& file, const GazeboFiles& files, int depth,
                         std::map<std::string, Included>& visits) {
  constexpr int max_depth = 32;
  constexpr double max_files = 100000.0;
  const std::string key = file.lexically_normal().string();
  const auto [visit, is_new] = visits.try_emplace(key);
  if (!is_new) {
    if (visit->second.depth == 0)
      throw FileError(key, "includes itself, directly or through other models");
    return visit->second;
  }
  if (depth > max_depth) throw FileError(key, "is included more than 32 models deep");
  const std::string text = text_without_comments(file);
  if (!is_sdf(text))
    throw FileError(file.string(), "not an SDF file: its first element is not <sdf>");
  Included all{1, 1.0};
  const auto follow = [&](const fs::path& included) {
    const Included below = follow_includes(included, files, depth + 1, visits);
    all = {std::max(all.depth, below.depth + 1), all.files + below.files};
    if (all.depth > max_depth) throw FileError(key, "includes models more than 32 deep");
    if (all.files > max_files) throw FileError(key, "includes more than 100000 models in all");
  };
  for (const std::string& uri : included_uris(text)) {
    const auto place = files.resolve(uri, file.parent_path());
    if (!place) continue;  // the parser says what is missing
    std::error_code code;
    if (!fs::is_directory(*place, code)) {
      follow(*place);
      continue;
    }
    std::vector<fs::path> descriptions;
    for (fs::directory_iterator it(*place, code), end; !code && it != end; it.increment(code)) {
      const std::string ending = it->path().extension().string();
      if (ending == ".sdf") descriptions.push_back(it->path());
      if (ending == ".config" || ending == ".xml") require_scene_file(it->path());
    }
    std::sort(descriptions.begin(), descriptions.end());
    for (const fs::path& description : descriptions) follow(description);
  }
  return visits[key] = all;
}

}  // namespace

void require_scene_file(const fs::path& file) {
  constexpr std::uintmax_t max_bytes = std::uintmax_t{256} << 20U;
  std::error_code code;
  const fs::file_status status = fs::status(file, code);
  if (!fs::exists(status)) throw FileError(file.string(), "no such file");
  if (!fs::is_regular_file(status)) throw FileError(file.string(), "is no regular file");
  const std::uintmax_t bytes = fs::file_size(file, code);
  if (code || bytes > max_bytes) {
    throw FileError(file.string(), "is " + std::to_string(bytes) + " bytes; allowed: up to " +
                                       std::to_string(max_bytes));
  }
}

std::vector<fs::path> gazebo_model_folders_of_environment() {
  std::vector<fs::path> folders;
  for (const char* variable :
       {"GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH"}) {
    const char* value = std::getenv(variable);
    std::string rest = value == nullptr ? "" : value;
    while (!rest.empty()) {
      const auto colon = rest.find(':');
      if (colon != 0) folders.emplace_back(rest.substr(0, colon));
      rest.erase(0, colon == std::string::npos ? std::string::npos : colon + 1);
    }
  }
  return folders;
}

GazeboFiles::GazeboFiles(fs::path world, std::vector<fs::path> model_folders)
    : world_(std::move(world)), folders_(std::move(model_folders)) {
  const fs::path beside = fs::absolute(world_).lexically_normal().parent_path();
  for (const fs::path& folder :
       {beside / "models", beside.parent_path() / "models", beside, beside.parent_path()}) {
    folders_.push_back(folder);
  }
}

std::optional<fs::path> GazeboFiles::resolve(std::string_view uri,
                                             const fs::path& directory) const {
  if (uri.empty()) return std::nullopt;
  const auto scheme_end = uri.find("://");
  const std::string_view scheme =
      scheme_end == std::string_view::npos ? "" : uri.substr(0, scheme_end);
  const fs::path path(scheme_end == std::string_view::npos ? uri : uri.substr(scheme_end + 3));
  if (path.empty()) return std::nullopt;
  if (scheme.empty() || scheme == "file") {
    if (path.is_absolute()) return is_there(path) ? std::optional(path) : std::nullopt;
    if (is_there(directory / path)) return directory / path;
    if (is_there(world_.parent_path() / path)) return world_.parent_path() / path;
  } else if (scheme != "model" && scheme != "package") {
    return std::nullopt;
  }
  for (const fs::path& folder : folders_) {
    if (is_there(folder / path)) return folder / path;
  }
  return std::nullopt;
}

std::string GazeboFiles::places() const {
  std::string text;
  for (const fs::path& folder : folders_) text += (text.empty() ? "" : ", ") + folder.string();
  return text;
}

void GazeboFiles::check_includes() const {
  std::map<std::string, Included> visits;
  follow_includes(world_, *this, 1, visits);
}

}  // namespace panonav
