#include "panonav_simulation/internal/sdf_context.hpp"

#include <algorithm>

namespace panonav::simulation {

void SdfContext::warn(const std::string& object, const std::string& what) {
  const auto [known, is_new] = warning_index_by_text_.try_emplace(what, warnings_.size());
  if (is_new) warnings_.push_back({{}, what});
  Warning& warning = warnings_[known->second];
  ++warning.count;
  auto& objects = warning.objects;
  if (!object.empty() && (objects.empty() || objects.back() != object)) objects.push_back(object);
}

std::vector<std::string> SdfContext::warning_lines() const {
  std::vector<std::string> lines;
  for (const Warning& warning : warnings_) lines.push_back(to_line(warning));
  return lines;
}

std::string SdfContext::to_line(const Warning& warning) {
  constexpr std::size_t max_named = 3;
  const std::size_t models = warning.objects.size();
  std::string line = models == 0 ? "" : models == 1 ? "model " : "models ";
  for (std::size_t i = 0; i < std::min(models, max_named); ++i)
    line += (i == 0 ? "" : ", ") + quote(warning.objects[i]);
  if (models > max_named) line += " and " + std::to_string(models - max_named) + " more";
  line += (models == 0 ? "" : ": ") + warning.what;
  const bool is_repeated = warning.count > static_cast<int>(std::max<std::size_t>(models, 1));
  return is_repeated ? line + " (" + std::to_string(warning.count) + " times)" : line;
}

std::optional<std::filesystem::path> SdfContext::find(std::string_view uri,
                                                      const SdfOrigin& origin) {
  const auto found = files.resolve(uri, origin.directory);
  if (!found) return std::nullopt;
  if (!found->as_written) {
    warn(origin.object, quote(uri) + " was not found; taken instead, with letters of other case: " +
                            to_readable_line(found->path.string()));
  }
  return found->path;
}

}  // namespace panonav::simulation
