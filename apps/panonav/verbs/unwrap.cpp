#include <memory>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

namespace {

struct UnwrapArguments {
  std::string image;
  std::string out;
  PictureArguments pictures;
  UnwarperOptions unwarper;
};

ExitCode unwrap(const UnwrapArguments& wanted, Session& session) {
  auto source = picture_source(wanted.pictures);
  if (!source) {
    throw UsageError(
        "say what the picture shows: --camera camera.toml for a mirror, or --kind equirectangular");
  }
  const PanoramaReader reader(std::move(*source), {wanted.unwarper.rows, wanted.unwarper.columns});
  const auto panorama = reader.read(wanted.image);
  const Image picture = to_picture(panorama);
  write_png(wanted.out, picture.view());

  const auto& band = panorama.elevations();
  const auto horizon = panorama.horizon_row();
  if (session.json()) {
    ordered_json json{{"image", wanted.image},     {"out", wanted.out},
                      {"rows", panorama.rows()},   {"columns", panorama.columns()},
                      {"elevations_rad", nullptr}, {"horizon_row", nullptr}};
    if (band) json["elevations_rad"] = {band->bottom_rad, band->top_rad};
    if (horizon) json["horizon_row"] = *horizon;
    session.print(json_line(json));
    return ExitCode::done;
  }
  std::string line = wanted.out + ": " + std::to_string(panorama.columns()) + " x " +
                     std::to_string(panorama.rows()) + " pixels, clockwise, forward in the middle";
  if (band) {
    line += ", elevations " + fixed(degrees(band->bottom_rad), 1) + " to " +
            fixed(degrees(band->top_rad), 1) + " degrees";
  }
  if (horizon) line += ", horizon in row " + std::to_string(*horizon);
  session.print(line);
  return ExitCode::done;
}

Run declare_unwrap(Arguments& arguments) {
  auto wanted = std::make_shared<UnwrapArguments>();
  arguments.positional("IMAGE", wanted->image, "Raw mirror image, 360 degree picture or panorama");
  arguments.required_option("-o,--out", wanted->out, "PNG picture to write");
  declare_layout(arguments, wanted->pictures);
  arguments.options("unwarper", wanted->unwarper);
  arguments.common({"--rows", "--columns"});
  return [wanted](Session& session) { return unwrap(*wanted, session); };
}

}  // namespace

Verb unwrap_verb() {
  return {
      "unwrap", "Turn a picture into the panoramic cylinder that the robot works with",
      "The picture written runs clockwise with forward in the middle, as a person would see it.",
      "  panonav unwrap mirror.jpg --camera camera.toml -o panorama.png\n"
      "  panonav unwrap photo360.jpg --kind equirectangular --elevation-deg -30 40 -o panorama.png",
      declare_unwrap};
}

}  // namespace panonav::command
