#include <algorithm>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/io/unfinished_folder.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "runs/picture_layout.hpp"
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

ordered_json to_json(const Panorama& panorama) {
  ordered_json json{{"rows", panorama.rows()},
                    {"columns", panorama.columns()},
                    {"elevations_rad", nullptr},
                    {"horizon_row", nullptr}};
  const auto& band = panorama.elevations();
  if (band) json["elevations_rad"] = {band->bottom_rad, band->top_rad};
  if (const auto horizon = panorama.horizon_row()) json["horizon_row"] = *horizon;
  return json;
}

std::string format_line(const Panorama& panorama) {
  std::string text = std::to_string(panorama.columns()) + " x " + std::to_string(panorama.rows()) +
                     " pixels, clockwise, forward direction in the middle";
  if (const auto& band = panorama.elevations()) {
    text += ", elevations " + format_fixed(degrees(band->bottom_rad), 1) + " to " +
            format_fixed(degrees(band->top_rad), 1) + " degrees";
  }
  if (const auto horizon = panorama.horizon_row()) {
    text += ", horizon in row " + std::to_string(*horizon);
  }
  return text;
}

/// Returns the file name of a panorama: "morning/view_1.jpg" becomes "morning_view_1.png".
std::string panorama_name(const std::string& file) {
  std::string name = file;
  for (const char* ending : {".png", ".jpg", ".jpeg", ".insp"}) {
    if (to_lower_case(name).ends_with(ending)) {
      name.resize(name.size() - std::string_view(ending).size());
    }
  }
  std::ranges::replace(name, '/', '_');
  return name + ".png";
}

Panorama convert(const PanoramaReader& reader, const DatasetEntry& entry) {
  const Observation observation = read_observation(entry);
  return rethrow_with_file_name(observation, [&] {
    return reader.convert(std::get<Image>(observation.picture).view(),
                          observation.tilt.value_or(Tilt{}));
  });
}

ExitCode unwrap_series(const UnwrapArguments& arguments, const Dataset& recording,
                       Session& session) {
  UnfinishedFolder unfinished(arguments.out);
  const PanoramaReader reader(recording.source,
                              {arguments.unwarper.rows, arguments.unwarper.columns});
  Progress progress(session, "unwrapping", recording.entries.size());
  SkippedImages skipped(recording.entries.size(), session);
  std::size_t written = 0;
  std::optional<Panorama> last;
  process_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) { return convert(reader, recording.entries[i]); },
      [&](std::size_t i, Panorama&& panorama) {
        const Image picture = to_picture(panorama);
        unfinished.append(unescape_name(panorama_name(recording.entries[i].file)),
                          encode_png(picture.view()));
        last = std::move(panorama);
        ++written;
        progress.advance();
      },
      [&](std::size_t, const std::exception_ptr& failure) {
        progress.clear();
        skipped.add(failure);
        progress.advance();
      });
  unfinished.finish();
  progress.clear();
  if (session.json()) {
    ordered_json json{{"input", arguments.input}, {"out", arguments.out}, {"images", written}};
    json.update(to_json(*last));
    session.print(json_line(json));
  } else {
    session.print(arguments.out + ": " + format_count(written, "panorama") + " of " +
                  format_line(*last));
  }
  return ExitCode::done;
}

ExitCode unwrap(const Arguments& declared, const UnwrapArguments& arguments, Session& session) {
  const std::string& input = arguments.input;
  if (!is_one_picture(input)) {
    return unwrap_series(arguments,
                         open_recording(input, arguments.pictures, std::nullopt, session), session);
  }
  if (fs::exists(input)) {
    declared.reject_options(recording_flags(), "as " + input + " is one image");
  }
  if (!make_picture_source(arguments.pictures, session)) {
    throw UsageError(
        "set the type of the image: --camera camera.toml for a mirror, or --kind equirectangular");
  }
  const Dataset recording = open_recording(input, arguments.pictures, std::nullopt, session);
  const PanoramaReader reader(recording.source,
                              {arguments.unwarper.rows, arguments.unwarper.columns});
  const Panorama panorama = convert(reader, recording.entries.front());
  const Image picture = to_picture(panorama);
  write_png(arguments.out, picture.view());
  if (session.json()) {
    ordered_json json{{"image", input}, {"out", arguments.out}};
    json.update(to_json(panorama));
    session.print(json_line(json));
  } else {
    session.print(arguments.out + ": " + format_line(panorama));
  }
  return ExitCode::done;
}

Run declare_unwrap(Arguments& arguments) {
  auto values = std::make_shared<UnwrapArguments>();
  arguments.positional(
      "INPUT", values->input,
      "Raw mirror image, 360 degree image or panorama. A data set, folder, video or recording of "
      "such images is also allowed; with -, JPEG images are read from standard input");
  arguments.required_option("-o,--out", values->out,
                            "Name of the new PNG image; for several images: a new folder");
  declare_pictures(arguments, values->pictures);
  values->pictures.check = PictureArguments::Check::heads;
  arguments.options("unwarper", values->unwarper);
  arguments.show_in_help({"--rows", "--columns"});
  arguments.declare_outputs({"--out"});
  return [values, &arguments](Session& session) { return unwrap(arguments, *values, session); };
}

}  // namespace

Verb unwrap_verb() {
  return {"unwrap",
          VerbGroup::first_steps,
          "Convert images to panoramas",
          "From the left to the right edge of the panorama, the view turns clockwise. The forward "
          "direction is in the middle.",
          "  panonav unwrap mirror.jpg --camera camera.toml -o panorama.png\n"
          "  panonav unwrap photo360.jpg --kind equirectangular --elevation-deg -30 40 -o "
          "panorama.png\n"
          "  panonav unwrap drive.mcap --camera camera.toml --every 1s -o panoramas",
          declare_unwrap};
}

}  // namespace panonav::command
