#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/recording_conversion.hpp"
#include "runs/picture_layout.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string input;
  std::string output;
  PictureArguments pictures;
};

/// Returns the fields that the data set has for all images, as a text.
std::string describe_fields(const Dataset::Fields& done) {
  std::string text;
  for (const auto& [has, what] : {std::pair{done.odometry, "odometry"},
                                  {done.positions, "positions"},
                                  {done.headings, "headings"},
                                  {done.tilts, "roll and pitch"}}) {
    if (has) text += (text.empty() ? " with " : ", ") + std::string(what);
  }
  return text;
}

/// Returns the flags that read the images of a recording in the layout of the data set, because a
/// recording does not contain the layout.
std::vector<std::string> list_layout_flags(const PictureSource& source,
                                           const ConvertArguments& arguments) {
  std::vector<std::string> flags{"--kind", std::string(to_string(source.kind))};
  if (source.camera) {
    const std::string file =
        arguments.pictures.camera.value_or((fs::path(arguments.input) / "camera.toml").string());
    flags.insert(flags.end(), {"--camera", fs::exists(file) ? file : "CAMERA_FILE"});
    return flags;
  }
  if (source.field_of_view_rad) {
    flags.insert(flags.end(),
                 {"--field-of-view", to_text(to_exact_degrees(*source.field_of_view_rad))});
  }
  if (source.kind == PictureKind::pinhole) return flags;
  const bool is_sphere = source.kind == PictureKind::equirectangular;
  if (source.layout.direction == ColumnDirection::counter_clockwise) {
    flags.insert(flags.end(), {"--columns-run", "counter-clockwise"});
  }
  if (source.layout.forward_column != PictureLayout{}.forward_column) {
    flags.insert(flags.end(), {"--forward-column", to_text(source.layout.forward_column)});
  }
  if (const auto& band = is_sphere ? source.layout.kept_elevations : source.layout.elevations) {
    flags.insert(flags.end(), {"--elevation-deg", to_text(to_exact_degrees(band->bottom_rad)),
                               to_text(to_exact_degrees(band->top_rad))});
  }
  return flags;
}

ExitCode convert(const ConvertArguments& arguments, Session& session) {
  const bool is_mcap_output = fs::path(arguments.output).extension() == ".mcap";
  if (!is_mcap_output && (has_dataset_file(arguments.input) || can_have_table(arguments.input))) {
    throw UsageError(arguments.output +
                     " does not end in .mcap; a folder is converted to a recording, and a "
                     "recording to a folder");
  }
  // A recording does not state the layout of its images.
  const PictureSource default_source;
  const Dataset dataset =
      open_recording(arguments.input, arguments.pictures,
                     is_mcap_output ? std::optional(default_source) : std::nullopt, session);
  Progress progress(session, "converting", dataset.entries.size());
  const auto advance = [&] { progress.advance(); };
  const Dataset::Fields done =
      is_mcap_output ? recordings::convert_to_recording(dataset, arguments.output, advance)
                     : recordings::convert_to_dataset(dataset, arguments.output, advance);
  progress.clear();
  const bool has_layout =
      is_mcap_output && (has_dataset_file(arguments.input) || states_layout(arguments.pictures));
  const auto layout_flags =
      has_layout ? list_layout_flags(dataset.source, arguments) : std::vector<std::string>{};
  if (session.json()) {
    session.print(json_line(ordered_json{{"input", arguments.input},
                                         {"output", arguments.output},
                                         {"images", dataset.entries.size()},
                                         {"stamps", done.stamps},
                                         {"odometry", done.odometry},
                                         {"positions", done.positions},
                                         {"headings", done.headings},
                                         {"tilts", done.tilts},
                                         {"layout_flags", layout_flags}}));
    return ExitCode::done;
  }
  session.print(session.bold(format_count(dataset.entries.size(), "image")) + " of " +
                arguments.input + " in " + arguments.output + describe_fields(done));
  if (is_mcap_output && !done.stamps) {
    session.print(
        "Some images have no stamp. The images are stored with an interval of one second.");
  }
  if (has_layout) {
    std::string flags;
    for (const std::string& each : layout_flags) flags += " " + quote_for_shell(each);
    session.print("A recording does not contain the layout of its images. To use " +
                  arguments.output + ", add:" + flags);
  }
  return ExitCode::done;
}

Run declare_convert(Arguments& arguments) {
  auto values = std::make_shared<ConvertArguments>();
  arguments.positional("INPUT", values->input,
                       "Data set, folder of images, or recording (MCAP, rosbag2, ROS 1 bag)");
  arguments.positional("OUTPUT", values->output,
                       "New recording (FILE.mcap), or a new folder for a data set");
  declare_pictures(arguments, values->pictures);
  arguments.declare_outputs({"OUTPUT"});
  return [values](Session& session) { return convert(*values, session); };
}

}  // namespace

Verb convert_verb() {
  return {"convert",
          VerbGroup::tools,
          "Convert a data set to a ROS 2 recording, or back",
          "Images are copied unchanged, together with their time stamps, odometry, poses, roll and "
          "pitch. To convert a recording to a data set, set --kind, because a recording does not "
          "contain the type of its images.",
          "  panonav convert walk walk.mcap\n"
          "  panonav convert drive.bag drive --kind equirectangular --image-topic /camera/image",
          declare_convert};
}

}  // namespace panonav::command
