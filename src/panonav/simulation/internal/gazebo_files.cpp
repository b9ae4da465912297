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
  std::ifstream stream(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  for (auto begin = text.find("<!--"); begin != std::string::npos;
       begin = text.find("<!--", begin)) {
    const auto end = text.find("-->", begin);
    text.erase(begin, end == std::string::npos ? std::string::npos : end + 3 - begin);
  }
  return text;
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
  for (auto at = text.find("<include"); at != std::string::npos;
       at = text.find("<include", at + 1)) {
    const auto begin = text.find("<uri>", at);
    const auto end = text.find("</uri>", at);
    const auto close = text.find("</include>", at);
    if (begin == std::string::npos || end == std::string::npos || begin > end || begin > close)
      continue;
    std::string uri = text.substr(begin + 5, end - begin - 5);
    const auto first = uri.find_first_not_of(" \t\r\n");
    if (first == std::string::npos) continue;
    uris.push_back(uri.substr(first, uri.find_last_not_of(" \t\r\n") + 1 - first));
  }
  return uris;
}

enum class Visit { open, done };

void follow_includes(const fs::path& file, const GazeboFiles& files,
                     std::map<std::string, Visit>& visits) {
  const std::string key = file.lexically_normal().string();
  const auto known = visits.find(key);
  if (known != visits.end()) {
    if (known->second == Visit::open)
      throw FileError(key, "includes itself, directly or through other models");
    return;
  }
  visits[key] = Visit::open;
  const std::string text = text_without_comments(file);
  if (!is_sdf(text))
    throw FileError(file.string(), "not an SDF file: its first element is not <sdf>");
  for (const std::string& uri : included_uris(text)) {
    const auto place = files.resolve(uri, file.parent_path());
    if (!place) continue;  // the parser says what is missing
    std::error_code code;
    if (!fs::is_directory(*place, code)) {
      follow_includes(*place, files, visits);
      continue;
    }
    std::vector<fs::path> descriptions;
    for (fs::directory_iterator it(*place, code), end; !code && it != end; it.increment(code)) {
      if (it->path().extension() == ".sdf") descriptions.push_back(it->path());
    }
    std::sort(descriptions.begin(), descriptions.end());
    for (const fs::path& description : descriptions) follow_includes(description, files, visits);
  }
  visits[key] = Visit::done;
}

}  // namespace

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
  std::map<std::string, Visit> visits;
  follow_includes(world_, *this, visits);
}

}  // namespace panonav
