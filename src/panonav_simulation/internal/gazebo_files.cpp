#include "panonav_simulation/internal/gazebo_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/load_gazebo.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

bool path_exists(const fs::path& path) {
  std::error_code code;
  return fs::exists(path, code);
}

// Returns `path` below `base` with the case of letters that the folders on disk have, or nullopt if
// it does not exist. If several names match, the first in alphabetical order is used.
std::optional<fs::path> find_path_in_any_case(const fs::path& base, const fs::path& path) {
  fs::path found = base;
  for (const fs::path& part : path) {
    if (part == "/" || part.empty() || path_exists(found / part)) {
      found /= part;
      continue;
    }
    std::vector<fs::path> names;
    std::error_code code;
    for (fs::directory_iterator it(found, code), end; !code && it != end; it.increment(code)) {
      if (equals_ignoring_case(it->path().filename().string(), part.string()))
        names.push_back(it->path().filename());
    }
    if (names.empty()) return std::nullopt;
    found /= *std::min_element(names.begin(), names.end());
  }
  return path_exists(found) ? std::optional(found) : std::nullopt;
}

// Returns NAME/FILE of https://SERVER/1.0/OWNER/models/NAME[/VERSION/files/FILE]; empty for other
// addresses.
std::string parse_fuel_path(std::string_view uri) {
  constexpr std::string_view folder = "/models/";
  const auto at = uri.find(folder);
  if (at == std::string_view::npos) return {};
  const std::string_view path = uri.substr(at + folder.size());
  const std::string_view name = path.substr(0, path.find('/'));
  const auto files = path.find("/files/");
  return std::string(name) + (files == std::string_view::npos
                                  ? std::string()
                                  : "/" + std::string(path.substr(files + 7)));
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

std::string read_scene_file(const fs::path& file) {
  require_scene_file(file);
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

bool equals_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
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
  // Packages keep worlds in PACKAGE/worlds or one folder deeper, and models in PACKAGE/models;
  // addresses may begin with the name of the package.
  const fs::path world_folder = fs::absolute(world_).lexically_normal().parent_path();
  const fs::path package = world_folder.parent_path();
  for (const fs::path& folder : {world_folder / "models", package / "models", world_folder, package,
                                 package.parent_path() / "models", package.parent_path()}) {
    if (std::ranges::find(folders_, folder) == folders_.end()) folders_.push_back(folder);
  }
}

std::optional<FoundFile> GazeboFiles::resolve(std::string_view uri,
                                              const fs::path& directory) const {
  if (uri.empty() || uri.find('\0') != std::string_view::npos) return std::nullopt;
  const auto scheme_end = uri.find("://");
  const std::string_view scheme =
      scheme_end == std::string_view::npos ? "" : uri.substr(0, scheme_end);
  const bool on_server = scheme == "http" || scheme == "https";
  const fs::path path = on_server ? fs::path(parse_fuel_path(uri))
                                  : fs::path(scheme.empty() ? uri : uri.substr(scheme_end + 3));
  if (path.empty()) return std::nullopt;
  std::vector<fs::path> bases;
  if (scheme.empty() || scheme == "file") {
    bases = {directory, world_.parent_path()};
    if (path.is_absolute()) bases = {"/"};
  } else if (!on_server && scheme != "model" && scheme != "package") {
    return std::nullopt;
  }
  if (!path.is_absolute()) bases.insert(bases.end(), folders_.begin(), folders_.end());
  for (const fs::path& base : bases) {
    if (path_exists(base / path)) return FoundFile{base / path};
  }
  for (const fs::path& base : bases) {
    if (auto found = find_path_in_any_case(base, path)) return FoundFile{std::move(*found), false};
  }
  return std::nullopt;
}

std::string GazeboFiles::list_folders() const {
  std::string text;
  for (const fs::path& folder : folders_) text += (text.empty() ? "" : ", ") + folder.string();
  return text;
}

pugi::xml_node GazeboFiles::read_sdf_root(const fs::path& file) {
  const std::string key = file.lexically_normal().string();
  if (const auto known = files_.find(key); known != files_.end())
    return known->second.document_element();
  pugi::xml_document document;
  try {
    document = parse_xml(read_scene_file(file));
  } catch (const FileError&) {
    throw;
  } catch (const Error& error) {
    throw FileError(file.string(), "not an SDF file: " + to_readable_line(error.what()));
  }
  const std::string name = document.document_element().name();
  if (name != "sdf" && name != "gazebo") {
    throw FileError(file.string(), "not an SDF file: its first element is <" +
                                       to_readable_line(name) + ">, not <sdf>");
  }
  return files_.emplace(key, std::move(document)).first->second.document_element();
}

fs::path GazeboFiles::find_description(const fs::path& folder) {
  std::error_code code;
  for (const char* list : {"model.config", "manifest.xml"}) {
    if (!fs::is_regular_file(folder / list, code)) continue;
    pugi::xml_document config;
    try {
      config = parse_xml(read_scene_file(folder / list));
    } catch (const Error&) {
      break;  // use the usual names instead
    }
    std::optional<fs::path> best;
    double best_version = -1.0;
    for (const pugi::xml_node& entry : config.document_element().children("sdf")) {
      const auto version = parse_numbers(entry.attribute("version").value());
      const double number = version && version->size() == 1 ? version->front() : 0.0;
      const std::string name = element_text(entry);
      if (name.empty() || number <= best_version) continue;
      const auto found = find_path_in_any_case(folder, name);
      if (!found) continue;
      best = found;
      best_version = number;
    }
    if (best) return *best;
  }
  if (const auto usual = find_path_in_any_case(folder, "model.sdf")) return *usual;
  std::vector<fs::path> others;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (it->path().extension() == ".sdf") others.push_back(it->path());
  }
  if (others.empty()) throw FileError(folder.string(), "contains no model description (model.sdf)");
  return *std::min_element(others.begin(), others.end());
}

}  // namespace panonav::simulation
