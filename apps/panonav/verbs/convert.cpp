#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/recording_conversion.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string input;
  std::string output;
  PictureArguments pictures;
};

/// What some pictures lack, and so none has in a data set.
std::string parts(const Dataset::Fields& done) {
  std::string text;
  for (const auto& [has, what] : {std::pair{done.odometry, "odometry"},
                                  {done.positions, "positions"},
                                  {done.headings, "headings"},
                                  {done.tilts, "roll and pitch"}}) {
    if (has) text += (text.empty() ? " with " : ", ") + std::string(what);
  }
  return text;
}

ExitCode convert(const ConvertArguments& wanted, Session& session) {
  std::error_code ignored;
  const bool records = fs::path(wanted.output).extension() == ".mcap";
  if (!records &&
      (fs::exists(fs::path(wanted.input) / "dataset.toml", ignored) ||
       (fs::is_directory(wanted.input, ignored) && !recordings::is_recording(wanted.input)))) {
    throw UsageError(wanted.output +
                     " does not end in .mcap; pictures of a folder become a "
                     "recording, and a recording becomes a folder");
  }
  // A recording does not say how its pictures lie.
  PictureSource any{.kind = PictureKind::equirectangular};
  any.layout.elevations = ElevationBand{-1.0, 1.0};
  const Dataset dataset = open_recording(wanted.input, wanted.pictures,
                                         records ? std::optional(any) : std::nullopt, session);
  Progress progress(session, "converting", dataset.entries.size());
  const auto advance = [&] { progress.advance(); };
  const Dataset::Fields done =
      records ? recordings::convert_to_recording(dataset, wanted.output, advance)
              : recordings::convert_to_dataset(dataset, wanted.output, advance);
  progress.clear();
  if (session.json()) {
    session.print(json_line(ordered_json{{"input", wanted.input},
                                         {"output", wanted.output},
                                         {"pictures", dataset.entries.size()},
                                         {"stamps", done.stamps},
                                         {"odometry", done.odometry},
                                         {"positions", done.positions},
                                         {"headings", done.headings},
                                         {"tilts", done.tilts}}));
    return ExitCode::done;
  }
  session.print(session.strong(std::to_string(dataset.entries.size())) + " pictures of " +
                wanted.input + " in " + wanted.output + parts(done));
  if (records && !done.stamps) {
    session.print("Not all pictures have a stamp; they are one second apart.");
  }
  return ExitCode::done;
}

Run declare_convert(Arguments& arguments) {
  auto wanted = std::make_shared<ConvertArguments>();
  arguments.positional("INPUT", wanted->input,
                       "Data set, folder of pictures, or recording (MCAP, rosbag2, ROS 1 bag)");
  arguments.positional("OUTPUT", wanted->output,
                       "Recording to write, FILE.mcap, or a new folder for a data set");
  declare_pictures(arguments, wanted->pictures);
  return [wanted](Session& session) { return convert(*wanted, session); };
}

}  // namespace

Verb convert_verb() {
  return {"convert", "Turn a data set into a recording of ROS 2 messages, or one into a data set",
          "Pictures keep their bytes, and stamps, odometry, poses, roll and pitch come along. A "
          "data set needs --kind, as a recording does not say how its pictures lie.",
          "  panonav convert walk walk.mcap\n"
          "  panonav convert drive.bag drive --kind equirectangular --image-topic /camera/image",
          declare_convert};
}

}  // namespace panonav::command
