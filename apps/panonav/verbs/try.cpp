#include <array>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"
#include "reports/report_page.hpp"
#include "reports/try_report.hpp"
#include "runs/trial.hpp"

namespace panonav::command {

namespace {

struct TryArguments {
  std::vector<std::string> inputs;
  std::optional<std::string> out;
};

ordered_json to_json(const Trial& trial, const TrialVerdict& verdict,
                     const std::filesystem::path& folder) {
  constexpr std::array forms{"equirectangular", "two lenses", "mirror", "panorama", "ordinary"};
  ordered_json json{{"input", trial.inputs.front()},
                    {"form", forms.at(static_cast<std::size_t>(trial.guess.form))},
                    {"good", verdict.is_good},
                    {"standing", trial.is_standing()},
                    {"verdict", verdict.headline},
                    {"findings", verdict.findings},
                    {"commands", verdict.commands},
                    {"images", trial.image_count},
                    {"tried", trial.queries.size()},
                    {"recognised", trial.count_known()},
                    {"in_order", trial.is_in_order},
                    {"connected_steps", trial.count_connected_steps()},
                    {"tracked", nullptr},
                    {"part_sizes", ordered_json::array()},
                    {"unread", trial.unread},
                    {"memory", nullptr},
                    {"page", (folder / "index.html").string()}};
  if (trial.tracked) json["tracked"] = *trial.tracked;
  if (trial.map_summary) json["part_sizes"] = trial.map_summary->part_sizes;
  if (!trial.queries.empty()) json["memory"] = trial.memory.string();
  return json;
}

ExitCode try_images(const TryArguments& arguments, Session& session) {
  namespace fs = std::filesystem;
  for (const std::string& input : arguments.inputs) {
    if (fs::path(input).extension() != ".panonav" || !memory_exists(input)) continue;
    throw FileError(input,
                    "is a memory; allowed: a folder of images, a video or a recording. To see what "
                    "the memory contains: panonav info " +
                        quote_for_shell(input));
  }
  const std::string stem = fs::path(arguments.inputs.front()).lexically_normal().stem().string();
  const fs::path folder = arguments.out.value_or((stem.empty() ? "images" : stem) + "_try");
  const Trial trial = run_trial(arguments.inputs, folder, session);
  const TrialVerdict verdict = judge_trial(trial);
  write_try_report(folder, trial, verdict);
  if (session.json()) {
    session.print(command::json_line(to_json(trial, verdict, folder)));
  } else {
    session.print(session.bold(verdict.headline));
    for (const std::string& finding : verdict.findings) session.print(finding);
    for (const std::string& command : verdict.commands) session.print("  " + command);
    print_report_path(folder, session);
  }
  return trial.count_known() > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_try(Arguments& arguments) {
  auto values = std::make_shared<TryArguments>();
  arguments.positionals("INPUT", values->inputs,
                        "Folder of images, video or recording of your own camera, or the videos "
                        "into which the camera has cut a long one, in order");
  arguments.option("-o,--out FOLDER", values->out,
                   "Folder for the page and the memory; by default the name of the input with "
                   "_try");
  arguments.declare_outputs({"--out"});
  arguments.explain_interruption(
      "The page is not complete. To start over, run the same command again.");
  return [values](Session& session) { return try_images(*values, session); };
}

}  // namespace

Verb try_verb() {
  return {"try",
          VerbGroup::first_steps,
          "Try panonav with images of your own camera",
          "Finds out what the images are: a 360 degree camera, raw images of two lenses, a mirror "
          "camera, or panoramas. Stores them in a memory, makes a map if their order "
          "shows the motion, searches for each image among the others, and tracks a robot with "
          "them. Writes a page with a verdict and the next "
          "commands. Of more than 400 images, 400 at equal intervals are tried. The exit code is 1 "
          "if no image is recognised.",
          "  panonav try photos\n"
          "  panonav try walk.mp4 -o walk_tried",
          declare_try};
}

}  // namespace panonav::command
