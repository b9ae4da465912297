#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"
#include "panonav_simulation/internal/sdf_values.hpp"
#include "panonav_simulation/load_gazebo.hpp"

namespace panonav::simulation {

/// Origin of a part of a world.
struct SdfOrigin {
  std::filesystem::path directory;  ///< of its file
  std::string object;  ///< the model at the top that it belongs to; empty in the world itself
};

/// State of the readers of one Gazebo world: the growing scene, its files and pictures, and
/// the warnings, each once however often its cause occurs.
class SdfContext {
 public:
  SdfContext(const std::filesystem::path& world, const GazeboOptions& options)
      : textures(options.textures), files(world, options.model_folders) {}

  Scene scene;
  TextureStore textures;
  GazeboFiles files;

  /// Adds a warning that concerns the model `object`; "": the world itself.
  void warn(const std::string& object, const std::string& what);

  /// Returns the lines of all warnings, in the order of their first occurrence.
  [[nodiscard]] std::vector<std::string> warning_lines() const;

  /// Finds the file that `uri` names, as GazeboFiles::resolve finds it; warns where only the case
  /// of letters differs.
  std::optional<std::filesystem::path> find(std::string_view uri, const SdfOrigin& origin);

  /// Calls `add`; what cannot be shown is left out with a warning, the rest of the world is read.
  template <class Add>
  void try_to_add(const std::string& thing, const std::string& object, const Add& add) {
    try {
      add();
    } catch (const Unusable& fault) {
      warn(object, thing + " is left out: " + fault.why);
    } catch (const Error& error) {
      warn(object, thing + " is left out: " + to_readable_line(error.what()));
    }
    while (texture_warnings_ < textures.warnings().size())
      warn(object, to_readable_line(textures.warnings()[texture_warnings_++]));
  }

 private:
  struct Warning {
    std::vector<std::string> objects;  // the models that it concerns; none for the world itself
    std::string what;
    int count = 0;
  };
  static std::string to_line(const Warning& warning);

  std::vector<Warning> warnings_;
  std::map<std::string, std::size_t> warning_of_text_;
  std::size_t texture_warnings_ = 0;  // of those of the textures, how many are taken over
};

}  // namespace panonav::simulation
