#pragma once

#include <filesystem>
#include <functional>
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

/// File and model from which a part of a world comes.
struct SdfOrigin {
  std::filesystem::path directory;  ///< folder of its file
  std::string object;               ///< its top-level model; empty in the world itself
};

/// Shared state of the readers of one Gazebo world: the scene built so far, files and textures, and
/// the warnings, each stored once with its number of occurrences.
class SdfContext {
 public:
  SdfContext(const std::filesystem::path& world, const GazeboOptions& options)
      : textures(options.textures),
        files(world, options.model_folders),
        before_mesh(options.before_mesh) {}

  Scene scene;
  TextureStore textures;
  GazeboFiles files;
  std::function<void(const std::filesystem::path&)> before_mesh;  // of the options; may be empty

  /// Adds a warning about the model `object`; an empty `object` means the world itself.
  void warn(const std::string& object, const std::string& what);

  /// Returns the lines of all warnings, in the order of their first occurrence.
  [[nodiscard]] std::vector<std::string> warning_lines() const;

  /// Finds the file that `uri` names, as GazeboFiles::resolve does; warns if the names differ in
  /// the case of letters.
  std::optional<std::filesystem::path> find(std::string_view uri, const SdfOrigin& origin);

  /// Calls `add` and turns its errors into a warning that the part `thing` is left out, so that the
  /// rest of the world is still read.
  template <class Add>
  void try_to_add(const std::string& thing, const std::string& object, const Add& add) {
    try {
      add();
    } catch (const UnusablePart& fault) {
      warn(object, thing + " is left out: " + fault.why);
    } catch (const Error& error) {
      warn(object, thing + " is left out: " + to_readable_line(error.what()));
    }
    while (copied_texture_warnings_ < textures.warnings().size())
      warn(object, to_readable_line(textures.warnings()[copied_texture_warnings_++]));
  }

 private:
  struct Warning {
    std::vector<std::string> objects;  // models it is about; empty: the world itself
    std::string what;
    int count = 0;
  };
  static std::string to_line(const Warning& warning);

  std::vector<Warning> warnings_;
  std::map<std::string, std::size_t> warning_index_by_text_;
  std::size_t copied_texture_warnings_ = 0;  // texture warnings already copied to this list
};

}  // namespace panonav::simulation
