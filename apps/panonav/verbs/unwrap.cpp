#include <algorithm>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct UnwrapArguments {
  std::string input;
  std::string out;
  PictureArguments pictures;
  UnwarperOptions unwarper;
};

ordered_json as_json(const Panorama& panorama) {
  ordered_json json{{"rows", panorama.rows()},
                    {"columns", panorama.columns()},
                    {"elevations_rad", nullptr},
                    {"horizon_row", nullptr}};
  const auto& band = panorama.elevations();
  if (band) json["elevations_rad"] = {band->bottom_rad, band->top_rad};
  if (const auto horizon = panorama.horizon_row()) json["horizon_row"] = *horizon;
  return json;
}

std::string as_text(const Panorama& panorama) {
  std::string text = std::to_string(panorama.columns()) + " x " + std::to_string(panorama.rows()) +
                     " pixels, clockwise, forward in the middle";
  if (const auto& band = panorama.elevations()) {
    text += ", elevations " + format_fixed(degrees(band->bottom_rad), 1) + " to " +
            format_fixed(degrees(band->top_rad), 1) + " degrees";
  }
  if (const auto horizon = panorama.horizon_row()) {
    text += ", horizon in row " + std::to_string(*horizon);
  }
  return text;
}

/// Its name in the folder of panoramas: "morning/view_1.jpg" becomes "morning_view_1.png".
std::string panorama_name(const std::string& file) {
  std::string name = file;
  for (const char* ending : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"}) {
    if (name.ends_with(ending)) name.resize(name.size() - std::string_view(ending).size());
  }
  std::ranges::replace(name, '/', '_');
  return name + ".png";
}

ExitCode unwrap_series(const UnwrapArguments& wanted, const Dataset& recording, Session& session) {
  std::error_code error;
  if (fs::exists(wanted.out) && (!fs::is_directory(wanted.out) || !fs::is_empty(wanted.out))) {
    throw FileError(wanted.out, "is there already and not empty; allowed: a new folder");
  }
  fs::create_directories(wanted.out, error);
  if (error) throw FileError(wanted.out, "cannot be made: " + error.message());
  const PanoramaReader reader(recording.source, {wanted.unwarper.rows, wanted.unwarper.columns});
  Progress progress(session, "unwrapping", recording.entries.size());
  std::optional<Panorama> last;
  make_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        const Observation seen = read_observation(recording.entries[i]);
        return rethrow_with_file_name(seen, [&] {
          return reader.convert(std::get<Image>(seen.picture).view(), seen.tilt.value_or(Tilt{}));
        });
      },
      [&](std::size_t i, Panorama&& panorama) {
        const Image picture = to_picture(panorama);
        write_png(fs::path(wanted.out) / panorama_name(recording.entries[i].file), picture.view());
        last = std::move(panorama);
        progress.advance();
      });
  progress.clear();
  if (session.json()) {
    ordered_json json{
        {"input", wanted.input}, {"out", wanted.out}, {"pictures", recording.entries.size()}};
    json.update(as_json(*last));
    session.print(json_line(json));
  } else {
    session.print(wanted.out + ": " + std::to_string(recording.entries.size()) + " panoramas of " +
                  as_text(*last));
  }
  return ExitCode::done;
}

ExitCode unwrap(const Arguments& arguments, const UnwrapArguments& wanted, Session& session) {
  const std::string& input = wanted.input;
  if (!is_one_picture(input)) {
    return unwrap_series(wanted, open_recording(input, wanted.pictures, std::nullopt, session),
                         session);
  }
  if (fs::exists(input)) {
    arguments.refuse_unused(recording_options(), "as " + input + " is one picture");
  }
  auto source = picture_source(wanted.pictures);
  if (!source) {
    throw UsageError(
        "say what the picture shows: --camera camera.toml for a mirror, or --kind equirectangular");
  }
  const PanoramaReader reader(std::move(*source), {wanted.unwarper.rows, wanted.unwarper.columns});
  const auto panorama = reader.read(input);
  const Image picture = to_picture(panorama);
  write_png(wanted.out, picture.view());
  if (session.json()) {
    ordered_json json{{"image", input}, {"out", wanted.out}};
    json.update(as_json(panorama));
    session.print(json_line(json));
  } else {
    session.print(wanted.out + ": " + as_text(panorama));
  }
  return ExitCode::done;
}

Run declare_unwrap(Arguments& arguments) {
  auto wanted = std::make_shared<UnwrapArguments>();
  arguments.positional("INPUT", wanted->input,
                       "Raw mirror image, 360 degree picture or panorama; or a data set, folder, "
                       "video or recording of them, or - for JPEG pictures on standard input");
  arguments.required_option("-o,--out", wanted->out,
                            "PNG picture to write; of several pictures a new folder for them");
  declare_pictures(arguments, wanted->pictures);
  arguments.options("unwarper", wanted->unwarper);
  arguments.common({"--rows", "--columns"});
  return [wanted, &arguments](Session& session) { return unwrap(arguments, *wanted, session); };
}

}  // namespace

Verb unwrap_verb() {
  return {
      "unwrap", "Turn a picture into the panoramic cylinder that the robot works with",
      "The picture written runs clockwise with forward in the middle, as a person would see it.",
      "  panonav unwrap mirror.jpg --camera camera.toml -o panorama.png\n"
      "  panonav unwrap photo360.jpg --kind equirectangular --elevation-deg -30 40 -o "
      "panorama.png\n"
      "  panonav unwrap drive.mcap --camera camera.toml --every 1s -o panoramas",
      declare_unwrap};
}

}  // namespace panonav::command
