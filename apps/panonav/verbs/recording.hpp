#pragma once

#include <optional>
#include <string>
#include <utility>

#include "cli/arguments.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::command {

/// What a user says of pictures that come without a dataset.toml.
struct PictureArguments {
  std::optional<std::string> kind;
  std::optional<std::string> camera;
  std::optional<std::string> columns;
  std::optional<double> forward_column;
  std::optional<std::pair<double, double>> elevation_deg;
};

/// Adds --kind, --camera, --columns-run, --forward-column and --elevation-deg.
void declare_pictures(Arguments& arguments, PictureArguments& pictures);

/// Empty when the user said nothing. Throws UsageError on flags that do not fit together, FileError
/// on the camera file.
[[nodiscard]] std::optional<PictureSource> picture_source(const PictureArguments& pictures);

/// A data set, a folder of pictures or one picture. `remembered` is how pictures lay that the
/// memory was made from: it reads what comes without a description of its own. A data set describes
/// itself, so flags beside it throw UsageError. Throws FileError.
[[nodiscard]] Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                                     const std::optional<PictureSource>& remembered);

}  // namespace panonav::command
