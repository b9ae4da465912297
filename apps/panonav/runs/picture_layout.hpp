#pragma once

#include <optional>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

/// True if a flag says anything about the layout of the images.
[[nodiscard]] bool states_layout(const PictureArguments& pictures);

/// Adds --ignore-gpano.
void declare_gpano(Arguments& arguments, bool& ignore_gpano);
/// Adds --kind, --camera, --field-of-view (if narrow pictures are taken), --columns-run,
/// --forward-column, --elevation-deg and --ignore-gpano.
void declare_picture_layout(Arguments& arguments, PictureArguments& pictures);
/// Returns the image layout that the flags describe; nullopt if none of them is set. Prints a note
/// on a calibration of another program. Throws UsageError on flags that exclude each other,
/// FileError on an invalid camera file.
[[nodiscard]] std::optional<PictureSource> make_picture_source(const PictureArguments& pictures,
                                                               Session& session);

}  // namespace panonav::command
