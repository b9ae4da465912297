#include <algorithm>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/camera/calibrate_dual_fisheye.hpp"
#include "panonav/camera/find_mirror.hpp"
#include "panonav/camera/mirror_camera.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "runs/file_content.hpp"
#include "runs/mirror_options.hpp"
#include "runs/orientation_note.hpp"
#include "runs/picture_layout.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

constexpr int dual_fisheye_profile = 3;

/// Known properties of a camera with two fisheye lenses.
struct LensesOptions {
  double left_roll_deg = 0.0;
  double right_roll_deg = 0.0;
  double left_azimuth_deg = 0.0;
  double field_of_view_deg = 0.0;
  double turn_deg = 0.0;
};

void visit_options(LensesOptions& options, OptionVisitor& visitor) {
  using T = LensesOptions;
  constexpr OptionTable table{
      option<&T::left_roll_deg>(
          "Direction of the sky in the left circle: 0 is up, 90 is left, -90 is right", -360, 360),
      option<&T::right_roll_deg>("Direction of the sky in the right circle", -360, 360),
      option<&T::left_azimuth_deg>("Azimuth of the left lens relative to the robot's forward "
                                   "direction, counter-clockwise positive",
                                   -360, 360),
      option<&T::field_of_view_deg>(
          "Field of view of each lens; 0: estimate a value from 185 to 220", 0, 300),
      option<&T::turn_deg>(
          "Rotation of the camera to the left from one image to the next; 0: estimate the rotation",
          -360, 360),
  };
  table.visit(options, visitor);
}

struct CalibrateArguments {
  std::vector<std::string> inputs;
  PictureArguments pictures{.check = PictureArguments::Check::heads};  // topics and part
  std::string out;
  std::optional<std::string> overlay;
  std::optional<std::string> mount;
  std::optional<std::string> export_format;
  std::optional<double> inner_radius_px;
  bool orientation = false;
  MirrorCircle::SearchOptions search;
  MirrorOptions mirror;
  LensesOptions lenses;
};

/// Returns the images of one input. Of more than 64 images it returns 64 at equal intervals, which
/// are enough to find the mirror's circle.
std::vector<DatasetEntry> choose_entries(const std::string& input,
                                         const CalibrateArguments& arguments, Session& session) {
  if (is_one_picture(input)) {
    DatasetEntry entry;
    entry.file = input;
    entry.path = input;
    return {entry};
  }
  constexpr std::size_t max_pictures = 64;
  std::optional<PictureSource> default_source;
  if (!has_dataset_file(input)) default_source.emplace();
  std::vector<DatasetEntry> all =
      open_recording(input, arguments.pictures, default_source, session).entries;
  if (all.size() <= max_pictures) return all;
  session.note("of the " + format_count(all.size(), "image") + " of " + to_readable_line(input) +
               " " + std::to_string(max_pictures) + " are used, at equal intervals");
  std::vector<DatasetEntry> selected;
  for (std::size_t i = 0; i < max_pictures; ++i) {
    selected.push_back(all[i * (all.size() - 1) / (max_pictures - 1)]);
  }
  return selected;
}

/// Reads all images and appends their names to `names`. Images of a folder that cannot be read are
/// skipped and named. Throws FileError if sizes differ.
std::vector<Image> read_images(const CalibrateArguments& arguments, std::vector<std::string>& names,
                               Session& session) {
  std::vector<Image> images;
  for (const std::string& input : arguments.inputs) {
    const std::vector<DatasetEntry> entries = choose_entries(input, arguments, session);
    Progress progress(session, "reading", entries.size());
    SkippedImages skipped(entries.size(), session);
    for (const DatasetEntry& entry : entries) {
      progress.advance();
      try {
        images.push_back(read_picture(entry));
      } catch (const FileError&) {
        progress.clear();
        skipped.add(std::current_exception());
        continue;
      }
      names.push_back(entry.store ? entry.file : entry.path.string());
      const auto size = images.back().size();
      const auto first = images.front().size();
      if (size == first) continue;
      throw FileError(names.back(), "size is " + std::to_string(size.width) + " x " +
                                        std::to_string(size.height) +
                                        "; allowed: " + std::to_string(first.width) + " x " +
                                        std::to_string(first.height) + ", as in " + names.front());
    }
  }
  return images;
}

ordered_json to_json(const CalibrateArguments& arguments, std::size_t images,
                     const MirrorCircle& mirror, const Camera& camera,
                     const std::vector<MirrorAssumption>& assumed) {
  ordered_json json{{"images", images},
                    {"width_px", mirror.image_size.width},
                    {"height_px", mirror.image_size.height},
                    {"centre_u_px", mirror.centre.u_px},
                    {"centre_v_px", mirror.centre.v_px},
                    {"rim_radius_px", mirror.rim_radius_px},
                    {"inner_radius_px", camera.inner_radius_px},
                    {"inner_radius_found", mirror.inner_radius_px.has_value()},
                    {"quality", mirror.quality},
                    {"residual_px", mirror.residual_px},
                    {"deviation_over_images", nullptr},
                    {"assumed", ordered_json::array()},
                    {"camera", arguments.out}};
  for (const MirrorAssumption& each : assumed) json["assumed"].push_back(each.option);
  if (const auto spread = agreement(mirror)) {
    json["deviation_over_images"] = {{"images", spread->images},
                                     {"centre_u_px", spread->centre_u_px},
                                     {"centre_v_px", spread->centre_v_px},
                                     {"rim_radius_px", spread->rim_radius_px}};
  }
  return json;
}

void print_text(const std::vector<MirrorAssumption>& assumed, const CalibrateArguments& arguments,
                bool several, const MirrorCircle& mirror, const Camera& camera, Session& session) {
  session.print(session.bold("mirror found") + ": centre " + format_fixed(mirror.centre.u_px, 1) +
                ", " + format_fixed(mirror.centre.v_px, 1) + " px, rim radius " +
                format_fixed(mirror.rim_radius_px, 1) + " px, inner radius " +
                format_fixed(camera.inner_radius_px, 1) + " px" +
                (mirror.inner_radius_px || arguments.inner_radius_px
                     ? ""
                     : " (not found; set --inner-radius-px)"));
  session.print("quality " + format_fixed(mirror.quality, 2) + " of 1, edges within " +
                format_fixed(mirror.residual_px, 2) + " px of the rim");
  if (const auto spread = agreement(mirror)) {
    session.print("over the " + format_count(spread->images, "image") +
                  " that show the rim, the centre varies by " +
                  format_fixed(spread->centre_u_px, 2) + ", " +
                  format_fixed(spread->centre_v_px, 2) + " px and the radius by " +
                  format_fixed(spread->rim_radius_px, 2) + " px (standard deviations)");
  }
  if (!assumed.empty()) {
    std::string text;
    for (const MirrorAssumption& each : assumed) text += (text.empty() ? "" : ", ") + each.text;
    session.print("Images do not show the shape of the mirror; assumed: " + text +
                  ". Lengths cannot be computed from the ground (--camera-height-m) with such a "
                  "camera file. If you know the mirror, set these options.");
  }
  session.suggest({"panonav", "unwrap", arguments.inputs.front(), "--camera", arguments.out, "-o",
                   several ? "panoramas" : "panorama.png"},
                  arguments.overlay ? "Next: look at " + *arguments.overlay + ", then" : "Next:");
  session.suggest({"panonav", "memorise", "place.panonav", "IMAGES", "--kind", "mirror", "--camera",
                   arguments.out},
                  "For the images of a walk:");
}

ExitCode refuse_scattered_rim(const MirrorCircle& mirror, Session& session) {
  const MirrorCircle::Agreement spread = agreement(mirror).value();
  return session.no_answer(
      "panonav calibrate: over the " + format_count(spread.images, "image") +
      " that show a rim, its centre varies by " + format_fixed(spread.centre_u_px, 1) + ", " +
      format_fixed(spread.centre_v_px, 1) + " px and its radius by " +
      format_fixed(spread.rim_radius_px, 1) +
      " px (allowed: " + format_fixed(max_rim_scatter * mirror.rim_radius_px, 1) +
      "); no camera file was written. Use images in which the camera is fixed to the mirror, and "
      "leave out images in which another round object is larger than the mirror");
}

/// Draws the circles of both lenses over the image, in the style of draw_mirror.
Image draw_lenses(ImageView picture, const Camera& camera) {
  const auto draw = [&camera](ImageView on, int lens) {
    const ImageCircle circle = image_circle(camera, lens);
    MirrorCircle drawn;
    drawn.image_size = camera.image_size;
    drawn.centre = circle.centre;
    drawn.rim_radius_px = circle.rim_radius_px;
    return draw_mirror(on, drawn);
  };
  const Image with_left = draw(picture, 0);
  return draw(with_left.view(), 1);
}

ordered_json to_json(const DualFisheyeCalibration& found, std::size_t images,
                     const std::string& file) {
  const auto& lenses = std::get<DualFisheyeModel>(found.camera.model).lenses;
  ordered_json json{{"images", images},
                    {"width_px", found.camera.image_size.width},
                    {"height_px", found.camera.image_size.height},
                    {"matches", found.matches},
                    {"inlier_share", found.inlier_share},
                    {"residual_deg", degrees(found.residual_rad)},
                    {"azimuth_deviation_deg", degrees(found.azimuth_deviation_rad)},
                    {"field_of_view_deg", ordered_json::array()},
                    {"turns_deg", ordered_json::array()},
                    {"camera", file}};
  for (const FisheyeLens& lens : lenses) {
    json["field_of_view_deg"].push_back(degrees(2 * lens.max_angle_rad));
  }
  for (const double turn : found.turns_rad) json["turns_deg"].push_back(degrees(turn));
  return json;
}

/// Writes the camera file, or with --export the file of another program.
void write_result(const CalibrateArguments& arguments, const CameraFile& camera, Session& session) {
  if (!arguments.export_format) return write_camera(arguments.out, camera);
  const bool is_kalibr = *arguments.export_format == "kalibr";
  try {
    const double residual_rad = write_calibration(
        arguments.out, camera.camera, is_kalibr ? ExportFormat::kalibr : ExportFormat::opencv);
    session.note(arguments.out + ": elevations differ from the camera's by at most " +
                 format_number(degrees(residual_rad), "deg") + " degrees");
  } catch (const ContractError& error) {
    throw FileError(arguments.out, std::string("the camera cannot be exported: ") + error.what());
  }
}

ExitCode calibrate_lenses(const CalibrateArguments& arguments,
                          const std::vector<std::string>& names, const std::vector<ImageView>& all,
                          Session& session) {
  // Uses at most 12 images at equal intervals, as more cost time and memory but hardly improve the
  // result.
  constexpr std::size_t max_pictures = 12;
  const std::size_t count = std::min(all.size(), max_pictures);
  std::vector<ImageView> views;
  for (std::size_t i = 0; i < count; ++i) views.push_back(all[i * all.size() / count]);
  if (arguments.lenses.turn_deg != 0 && all.size() > count) {
    throw UsageError("--turn-deg needs equal rotations between at most 12 images; there are " +
                     std::to_string(all.size()));
  }
  const LensesOptions& options = arguments.lenses;
  DualFisheyeCalibration::Knowledge known;
  known.left_roll_rad = radians(options.left_roll_deg);
  known.right_roll_rad = radians(options.right_roll_deg);
  known.left_azimuth_rad = radians(options.left_azimuth_deg);
  if (options.field_of_view_deg > 0) known.field_of_view_rad = radians(options.field_of_view_deg);
  if (options.turn_deg != 0) known.turn_rad = radians(options.turn_deg);
  if (arguments.mirror.direction != 0) known.direction = ColumnDirection::counter_clockwise;
  const auto answer = calibrate_dual_fisheye(views, known, session.executor());
  if (const auto* refusal = std::get_if<std::string>(&answer)) {
    return session.no_answer("panonav calibrate: " + names.front() +
                             (views.size() > 1 ? " and the others: " : ": ") + *refusal);
  }
  const auto& found = std::get<DualFisheyeCalibration>(answer);
  if (arguments.overlay) {
    const Image overlay = draw_lenses(views.front(), found.camera);
    write_png(*arguments.overlay, overlay.view());
  }
  write_result(arguments, {found.camera, std::nullopt, {}}, session);
  if (session.json()) {
    session.print(json_line(to_json(found, views.size(), arguments.out)));
    return ExitCode::done;
  }
  const auto& lenses = std::get<DualFisheyeModel>(found.camera.model).lenses;
  session.print(session.bold("two lenses found") + ": " +
                format_fixed(degrees(2 * lenses[0].max_angle_rad), 1) + " and " +
                format_fixed(degrees(2 * lenses[1].max_angle_rad), 1) +
                " degrees, brightness 1 to " + format_fixed(lenses[1].gain / lenses[0].gain, 2));
  session.print(std::to_string(found.matches) + " patches matched, " +
                format_fixed(100 * found.inlier_share, 0) + " % of those with structure, within " +
                format_fixed(degrees(found.residual_rad), 3) + " degrees");
  session.print("azimuths are uncertain by " +
                format_fixed(degrees(found.azimuth_deviation_rad), 3) +
                " degrees (standard deviation, distant objects)");
  session.suggest({"panonav", "unwrap", arguments.inputs.front(), "--camera", arguments.out,
                   "--elevation-deg", "-40", "40", "-o", "panorama.png"});
  return ExitCode::done;
}

bool is_camera_file(const std::string& input) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(input, error)) return false;
  const FileContent kind = identify_content(input).kind;
  return kind == FileContent::toml || kind == FileContent::calibration;
}

/// Converts a camera file, or the calibration of another program.
ExitCode convert_camera(const CalibrateArguments& arguments, Session& session) {
  const std::string& input = arguments.inputs.front();
  const std::string mount = arguments.mount.value_or("up");
  const CameraFile camera = read_camera(input, mount == "up"     ? CameraMount::up
                                               : mount == "down" ? CameraMount::down
                                                                 : CameraMount::mirror);
  if (camera.format.empty() && arguments.mount) {
    throw UsageError("--mount is " + mount + "; allowed: nothing, as " + input +
                     " contains the direction of the camera");
  }
  const bool is_narrow = std::holds_alternative<PinholeModel>(camera.camera.model);
  if (is_narrow && arguments.mount) {
    throw UsageError("--mount is " + mount + "; allowed: nothing, as the perspective camera of " +
                     input + " looks forward");
  }
  write_result(arguments, camera, session);
  const std::string format = camera.format.empty() ? "camera file" : camera.format + " calibration";
  nlohmann::ordered_json answer{{"input", input}, {"format", format}};
  std::string shown;
  if (is_narrow) {
    const double width_rad = field_of_view(camera.camera);
    answer["field_of_view_rad"] = width_rad;
    shown = "images show " + format_number(degrees(width_rad), "deg") +
            " degrees of the azimuth at the height of the camera";
  } else {
    const auto [bottom_rad, top_rad] = visible_elevations(camera.camera);
    answer["elevations_rad"] = {bottom_rad, top_rad};
    shown = "all azimuths show the elevations from " + format_number(degrees(bottom_rad), "deg") +
            " to " + format_number(degrees(top_rad), "deg") + " degrees";
  }
  answer["camera"] = arguments.out;
  if (session.json()) {
    session.print(json_line(answer));
    return ExitCode::done;
  }
  session.print(input + ": " + format + "; " + shown);
  session.print(arguments.out + " is written");
  return ExitCode::done;
}

ExitCode calibrate(const Arguments& declared, const CalibrateArguments& arguments,
                   Session& session) {
  if (arguments.orientation) {
    return correct_recording(arguments.inputs, arguments.pictures, arguments.out, session);
  }
  if (arguments.inputs.size() == 1 && is_camera_file(arguments.inputs.front())) {
    auto unused = recording_flags();
    for (const char* flag :
         {"--overlay", "--inner-radius-px", "[mirror]", "[lenses]", "[mirror_search]"}) {
      unused.emplace_back(flag);
    }
    declared.reject_options(unused, "as the input is the calibration of a camera");
    return convert_camera(arguments, session);
  }
  if (std::ranges::all_of(arguments.inputs, [](const std::string& input) {
        return std::filesystem::exists(input);
      })) {
    declared.reject_options({"--mount"}, "as the input is no calibration of another program");
  }
  if (std::ranges::all_of(arguments.inputs, is_one_picture)) {
    declared.reject_options(recording_flags(), "as all inputs are single images");
  }
  std::vector<std::string> names;
  const auto images = read_images(arguments, names, session);
  std::vector<ImageView> views;
  for (const auto& image : images) views.push_back(image.view());
  if (arguments.mirror.profile == dual_fisheye_profile) {
    return calibrate_lenses(arguments, names, views, session);
  }
  const auto mirror = find_mirror(views, arguments.search);
  if (!mirror) {
    return session.no_answer(
        "panonav calibrate: no mirror found in " + names.front() +
        (images.size() > 1 ? " and the others" : "") +
        "; add more images, or reduce --min-quality to accept a less visible rim");
  }
  if (is_scattered(*mirror)) return refuse_scattered_rim(*mirror, session);
  const double forward_rad = radians(arguments.mirror.forward_angle_deg);
  const auto assumed = list_assumptions(declared, arguments.mirror);
  const Camera camera = camera_from_mirror(
      *mirror, {.model = make_mirror_model(arguments.mirror, mirror->rim_radius_px),
                .inner_radius_px = arguments.inner_radius_px,
                .direction = arguments.mirror.direction == 0 ? ColumnDirection::clockwise
                                                             : ColumnDirection::counter_clockwise,
                .forward_angle_rad = forward_rad,
                .is_model_assumed = !assumed.empty()});
  if (arguments.overlay) {
    const Image overlay = draw_mirror(views.front(), *mirror, forward_rad);
    write_png(*arguments.overlay, overlay.view());
  }
  write_result(arguments, {camera, std::nullopt, {}}, session);
  if (session.json()) {
    session.print(json_line(to_json(arguments, images.size(), *mirror, camera, assumed)));
  } else {
    print_text(assumed, arguments, images.size() > arguments.inputs.size(), *mirror, camera,
               session);
  }
  return ExitCode::done;
}

Run declare_calibrate(Arguments& arguments) {
  auto values = std::make_shared<CalibrateArguments>();
  arguments.positionals("INPUT", values->inputs,
                        "Raw images of one mirror camera; more images give a better result. For a "
                        "camera with two fisheye lenses: images from one place, each with a "
                        "different rotation of the camera. Folders, videos and recordings are also "
                        "allowed; with -, JPEG images are read from standard input. A camera file, "
                        "or a calibration of OCamCalib, Kalibr, OpenCV, ROS or stella_vslam, is "
                        "converted");
  declare_topics(arguments, values->pictures.topics);
  declare_part(arguments, values->pictures.part, true);
  arguments.required_option("-o,--out", values->out, "Name of the new camera file (camera.toml)");
  arguments.flag(
      "--orientation", values->orientation,
      "Correct the direction of columns and the forward direction by the poses or "
      "odometry of INPUT, a recording; write its camera file, or dataset.toml, to --out");
  declare_picture_layout(arguments, values->pictures);
  arguments.hide_from_help({"--kind", "--camera", "--columns-run", "--forward-column",
                            "--elevation-deg", "--ignore-gpano"});
  arguments.reject_options_unless(
      {"--kind", "--camera", "--columns-run", "--forward-column", "--elevation-deg",
       "--ignore-gpano"},
      [values] { return values->orientation; }, "without --orientation");
  arguments.reject_options_unless(
      {"--overlay", "--inner-radius-px", "--mount", "--export", "[mirror]", "[lenses]",
       "[mirror_search]"},
      [values] { return !values->orientation; }, "with --orientation");
  arguments.option("--overlay FILE", values->overlay,
                   "Write a PNG image that shows the calibration drawn over the first input image");
  arguments.option(
      "--inner-radius-px", values->inner_radius_px,
      "Radius of the camera's reflection in the mirror; by default, it is measured in the images");
  arguments.choice("--mount", values->mount, {"up", "down", "mirror"},
                   "Direction of a camera calibrated by another program: a lens that looks up "
                   "(default) or down, or a camera that looks up into a mirror");
  arguments.choice("--export", values->export_format, {"kalibr", "opencv"},
                   "Write --out for another program: a Kalibr camchain or an OpenCV YAML file");
  arguments.options("mirror", values->mirror);
  arguments.options("lenses", values->lenses);
  arguments.options("mirror_search", values->search);
  arguments.show_in_help({"--profile", "--inner-elevation-deg", "--rim-elevation-deg",
                          "--direction", "--forward-angle-deg"});
  arguments.hide_from_help({"--inner-radius-px"});
  const auto make_profile_check = [values](int profile) {
    return [values, profile] { return values->mirror.profile == profile; };
  };
  arguments.reject_options_unless({"--inner-elevation-deg"}, make_profile_check(0),
                                  "without --profile equiangular");
  arguments.reject_options_unless({"--mirror-a-mm", "--mirror-b-mm"}, make_profile_check(1),
                                  "without --profile hyperboloidal");
  arguments.reject_options_unless({"--xi"}, make_profile_check(2), "without --profile unified");
  arguments.reject_options_unless({"[lenses]"}, make_profile_check(dual_fisheye_profile),
                                  "without --profile dual-fisheye");
  arguments.reject_options_unless(
      {"--rim-elevation-deg", "--forward-angle-deg", "--inner-radius-px", "[mirror_search]"},
      [make_profile_check] { return !make_profile_check(dual_fisheye_profile)(); },
      "with --profile dual-fisheye");
  arguments.declare_outputs({"--out", "--overlay"});
  return [values, &arguments](Session& session) { return calibrate(arguments, *values, session); };
}

}  // namespace

Verb calibrate_verb() {
  return {
      "calibrate",
      VerbGroup::first_steps,
      "Calibrate a mirror camera or a 360 degree camera",
      "For a camera with two lenses, take three or four images at one place that has many objects "
      "around it. Rotate the camera on its stand by about 90 degrees between the images. Check the "
      "image of --overlay before you use the camera file. The exit code is 1 if no image shows the "
      "rim of a mirror, if the rim is not at the same pixels in all images, or if the images are "
      "not sufficient to calibrate two lenses, and with --orientation, if the poses do not show "
      "it.",
      "  panonav calibrate mirror1.jpg mirror2.jpg -o camera.toml --overlay overlay.png\n"
      "  panonav calibrate camchain.yaml -o camera.toml --mount down\n"
      "  panonav calibrate camera.toml -o camchain.yaml --export kalibr\n"
      "  panonav calibrate --orientation office_run -o corrected.toml\n"
      "  panonav calibrate turned?.jpg --profile dual-fisheye -o camera.toml\n"
      "  panonav calibrate theta?.jpg --profile dual-fisheye --left-roll-deg 90 "
      "--right-roll-deg -90 -o camera.toml",
      declare_calibrate};
}

}  // namespace panonav::command
