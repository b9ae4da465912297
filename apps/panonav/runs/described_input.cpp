#include "runs/described_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "cli/option_values.hpp"
#include "cli/texts.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav_recordings/live_pictures.hpp"
#include "runs/file_content.hpp"
#include "runs/picture_facts.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// The verbs that take a kind, in the order of the help, and the option by which they do if it is
/// no argument.
struct Takers {
  InputKind kind;
  std::string_view verbs;
  std::string_view option = {};
};
constexpr std::array<Takers, 12> takers{{
    {InputKind::memory,
     "list show gallery verify rename forget prune undo history copy export localise track home "
     "serve ros2 map scale arrange memorise route_record route_follow merge synchronise navigate "
     "evaluate"},
    {InputKind::dataset,
     "memorise localise track home map route_record route_follow unwrap convert catchment"},
    {InputKind::narrow_dataset, "localise track convert"},
    {InputKind::pictures,
     "try memorise localise track map route_record route_follow unwrap calibrate convert "
     "catchment"},
    {InputKind::picture, "localise memorise home unwrap calibrate"},
    {InputKind::video,
     "try memorise localise track map route_record route_follow unwrap calibrate convert "
     "catchment"},
    {InputKind::recording,
     "try memorise localise track map route_record route_follow unwrap calibrate convert evaluate "
     "catchment"},
    {InputKind::live, "localise memorise track"},
    {InputKind::camera_file, "unwrap memorise localise map", "--camera"},
    {InputKind::narrow_camera_file, "localise", "--kind pinhole --camera"},
    {InputKind::trajectory, "evaluate simulate"},
    {InputKind::scene, "simulate navigate"},
}};

std::string format_size(ImageSize size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
}

std::uint64_t find_file_bytes(const fs::path& file) {
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  return error ? 0 : bytes;
}

std::uint64_t sum_file_bytes(const Dataset& dataset) {
  std::uint64_t bytes = 0;
  for (const auto& entry : dataset.entries) bytes += find_file_bytes(entry.path);
  return bytes;
}

std::string format_kind_and_band(const PictureSource& source) {
  std::string text(to_string(source.kind));
  auto band = source.layout.kept_elevations;
  if (source.kind == PictureKind::panorama) band = source.layout.elevations;
  if (source.kind == PictureKind::equirectangular && !band) band = default_equirectangular_band;
  if (band) {
    text += ", elevations " + format_number(degrees(band->bottom_rad)) + " to " +
            format_number(degrees(band->top_rad)) + " degrees";
  }
  if (source.field_of_view_rad) {
    text += ", " + format_number(degrees(*source.field_of_view_rad)) + " degrees wide";
  }
  return text;
}

/// Returns the size of the first image that can be read. Throws FileError if there is none.
ImageSize read_first_size(const Dataset& dataset) {
  for (const DatasetEntry& entry : dataset.entries) {
    try {
      return entry.store ? read_picture(entry).size() : read_image_size(entry.path);
    } catch (const FileError&) {
      if (&entry == &dataset.entries.back()) throw;
    }
  }
  throw FileError(dataset.folder.string(), "contains no image");
}

DescribedInput describe_dataset(const std::string& folder) {
  const Dataset dataset = open_input(folder);
  const auto fields = find_shared_fields(dataset);
  const ImageSize size = read_first_size(dataset);
  DescribedInput described{.type = "data set",
                           .summary = format_count(dataset.entries.size(), "image") + " of " +
                                      format_size(size) + ", " +
                                      format_kind_and_band(dataset.source),
                           .bytes = sum_file_bytes(dataset),
                           .images = dataset.entries.size()};
  std::string known;
  for (const auto& [has, name] : {std::pair{fields.stamps, "time stamps"},
                                  {fields.positions, "positions"},
                                  {fields.headings, "headings"},
                                  {fields.odometry, "odometry"},
                                  {fields.tilts, "tilts"}}) {
    if (has) known += (known.empty() ? "" : ", ") + std::string(name);
  }
  described.facts.push_back("known of each image: " + (known.empty() ? "nothing" : known));
  const auto some = find_known_fields(dataset);
  if (some.positions || some.odometry) described.posed_dataset = folder;
  for (const auto& warning : dataset.warnings) described.facts.push_back(warning);
  if (dataset.source.kind == PictureKind::pinhole) {
    described.use = {list_verbs_that_take(InputKind::narrow_dataset),
                     {"panonav", "localise", "MEMORY", folder}};
    return described;
  }
  described.use = {list_verbs_that_take(InputKind::dataset), make_memorise_command(folder, {})};
  std::erase_if(described.use.verbs, [&](const std::string& verb) {
    return (verb == "route record" && !fields.positions && !fields.odometry) ||
           (verb == "catchment" && !fields.headings);
  });
  return described;
}

/// Describes what a folder without images contains, for an error message.
std::string list_contents(const fs::path& folder) {
  std::map<std::string, int> endings;
  std::size_t folders = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_directory(error)) {
      ++folders;
    } else {
      const std::string ending = to_lower_case(entry.path().extension().string());
      ++endings[ending];
    }
  }
  std::string text;
  for (const auto& [ending, count] : endings) {
    text += (text.empty() ? "" : ", ") + (ending.empty()
                                              ? format_count(count, "file") + " without an ending"
                                              : std::to_string(count) + " *" + ending);
  }
  if (folders > 0) text += (text.empty() ? "" : ", ") + format_count(folders, "folder");
  return text.empty() ? "nothing" : text;
}

/// Returns the first file with one of the endings in the folder or below it; empty: none.
std::string find_file_below(const fs::path& folder, std::span<const std::string_view> endings) {
  std::vector<fs::path> found;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied,
                                         error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const std::string ending = to_lower_case(entry->path().extension().string());
    if (std::ranges::find(endings, ending) != endings.end()) found.push_back(entry->path());
  }
  return found.empty() ? "" : std::ranges::min(found).string();
}

/// Throws FileError on a folder without images of its own; names a file in it that was probably
/// meant.
[[noreturn]] void reject_folder(const std::string& folder, const std::string& meant) {
  throw FileError(folder,
                  "no verb takes it; it is a folder with neither dataset.toml, metadata.yaml, "
                  "index.html nor PNG or JPEG images, but with " +
                      list_contents(folder) +
                      (meant.empty() ? "" : "; try panonav info " + quote_for_shell(meant)));
}

/// Reads the images of a folder, or of those below it if it has none itself and is not a folder of
/// worlds, whose images are textures. Returns also true if they are below it.
std::pair<Dataset, bool> read_pictures(const std::string& folder) {
  constexpr std::array<std::string_view, 2> worlds{".world", ".sdf"};
  constexpr std::array<std::string_view, 8> inputs{".panonav", ".mcap", ".bag", ".db3",
                                                   ".mp4",     ".mkv",  ".dae", ".obj"};
  if (const auto reader = find_dataset_reader(folder)) return {reader->read(folder, {}, {}), false};
  try {
    return {read_picture_folder(folder, {}), false};
  } catch (const FileError&) {
    for (const std::string_view& ending : worlds) {
      const std::string world = find_file_below(folder, std::span(&ending, 1));
      if (!world.empty()) reject_folder(folder, world);
    }
  }
  try {
    return {read_picture_tree(folder, {}), true};
  } catch (const FileError&) {
    reject_folder(folder, find_file_below(folder, inputs));
  }
}

DescribedInput describe_picture_folder(const std::string& folder) {
  const auto [images, recursive] = read_pictures(folder);
  const ImageSize size = read_first_size(images);
  if (std::ranges::all_of(images.entries,
                          [](const DatasetEntry& entry) { return is_sector(entry.path); })) {
    throw FileError(folder, "no verb takes it; its images show only a sector (panonav info " +
                                quote_for_shell(images.entries.front().path.string()) + ")");
  }
  const GuessedKind guess = guess_kind(size);
  DescribedInput described{.type = "folder of images",
                           .summary = format_count(images.entries.size(), "image") +
                                      (recursive ? " in the folders within (--recursive)" : "") +
                                      ", the first of " + format_size(size) + ", no dataset.toml",
                           .bytes = sum_file_bytes(images),
                           .images = images.entries.size(),
                           .facts = {std::string(guess.text)},
                           .use = {list_verbs_that_take(InputKind::pictures),
                                   make_memorise_command(folder, guess.kind)}};
  if (guess.kind.empty()) {
    described.use.next = {"panonav", "calibrate", folder, "-o", "camera.toml"};
  }
  if (recursive && !guess.kind.empty()) described.use.next.emplace_back("--recursive");
  if (!images.left_out.empty()) {
    described.facts.push_back(format_count(images.left_out.size(), "other file or folder") +
                              " in it: not read");
  }
  return described;
}

DescribedInput describe_picture(const std::string& file, const std::string& description) {
  const auto reader = find_dataset_reader(file);
  const ImageSize size =
      reader ? read_first_size(reader->read(file, {}, {})) : read_image_size(file);
  const GuessedKind guess = guess_kind(size);
  DescribedInput described{.type = "image",
                           .summary = description + ", " + format_size(size),
                           .bytes = find_file_bytes(file),
                           .images = 1,
                           .facts = {std::string(guess.text)}};
  if (reader) {
    described.facts.emplace_back("read by the program ffmpeg");
  } else {
    for (auto& fact : list_picture_facts(file)) described.facts.push_back(std::move(fact));
  }
  if (is_sector(file)) {
    throw FileError(file, "no verb takes it as it is; it is " + described.summary + "; " +
                              join_texts(std::span(described.facts).subspan(1)));
  }
  described.use.verbs = list_verbs_that_take(InputKind::picture);
  described.use.next = {
      "panonav", "unwrap", file, "-o", "seen.png", "--kind", std::string(guess.kind)};
  if (guess.kind.empty()) described.use.next = {"panonav", "calibrate", file, "-o", "camera.toml"};
  return described;
}

std::string model_name(const CameraModel& model) {
  constexpr std::array<std::string_view, 9> names{
      "hyperboloidal", "polynomial", "unified", "equiangular", "equirectangular",
      "dual fisheye",  "fisheye",    "pinhole", "rig"};
  static_assert(std::variant_size_v<CameraModel> == names.size());
  return std::string(names[model.index()]);
}

DescribedInput describe_camera_file(const std::string& file) {
  const CameraFile camera = read_camera(file);
  const std::string format = camera.format.empty() ? "" : camera.format + " ";
  const bool is_narrow = !shows_all_azimuths(camera.camera);
  InputUse use{list_verbs_that_take(InputKind::camera_file),
               {"panonav", "unwrap", "IMAGE", "--camera", file, "-o", "seen.png"}};
  if (is_narrow) {
    use = {list_verbs_that_take(InputKind::narrow_camera_file),
           {"panonav", "localise", "MEMORY", "IMAGE", "--kind", "pinhole", "--camera", file}};
  }
  return {.type = "camera file",
          .summary = format + "calibration of a camera with images of " +
                     format_size(camera.camera.image_size) + ", model " +
                     model_name(camera.camera.model) + (camera.mask ? ", with a mask" : ""),
          .bytes = find_file_bytes(file),
          .facts = {(is_narrow ? "use it as --kind pinhole --camera " : "use it as --camera ") +
                    quote_for_shell(file)},
          .use = std::move(use)};
}

/// Returns the names of the sections "[NAME]" and the keys before the first section.
std::pair<std::set<std::string>, std::set<std::string>> list_sections_and_keys(
    const std::string& file) {
  constexpr std::size_t max_bytes = 1U << 20U;
  const auto bytes = read_file(file, max_bytes);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::set<std::string> sections;
  std::set<std::string> keys;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (line.starts_with('[')) {
      sections.emplace(line.substr(1, line.find(']') - 1));
    } else if (sections.empty() && !line.starts_with('#')) {
      keys.emplace(line.substr(0, line.find_first_of(" =\t\r")));
    }
  }
  return {std::move(sections), std::move(keys)};
}

DescribedInput describe_toml(const std::string& file) {
  const auto [sections, keys] = list_sections_and_keys(file);
  if (keys.contains("model") || sections.contains("[camera")) return describe_camera_file(file);
  if (sections.contains("images")) {
    const fs::path folder = fs::path(file).parent_path();
    return describe_dataset(folder.empty() ? "." : folder.string());
  }
  DescribedInput described{.type = "file of options", .bytes = find_file_bytes(file)};
  std::set<std::string> known;
  for (const auto& [verb, arguments] : describe(all_verbs())) {
    bool is_taken = false;
    for (const auto& argument : arguments) {
      if (!sections.contains(argument.section)) continue;
      known.insert(argument.section);
      is_taken = true;
    }
    if (is_taken) described.use.verbs.emplace_back(verb.name);
  }
  if (known.empty()) {
    throw FileError(file,
                    "is a TOML file that no verb takes: it is no camera file (key 'model'), no "
                    "dataset.toml (section [images]) and has no section of options; panonav VERB "
                    "--config-template prints a file of options");
  }
  described.summary =
      "sections " + join_texts(std::vector<std::string>(known.begin(), known.end()));
  described.facts = {"use it as --config " + quote_for_shell(file) +
                     "; each verb reads its own sections"};
  return described;
}

DescribedInput describe_trajectory(const std::string& file) {
  const TrajectoryFile trajectory = read_trajectory_file(file);
  const auto& [format, units, poses, repeated, has_rotations, is_estimate] = trajectory;
  double length_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    length_m += distance(poses[i - 1].pose.position, poses[i].pose.position);
  }
  std::string summary = format_count(poses.size(), "pose") + " (" + format + " format)";
  if (!has_rotations) summary += " without headings";
  summary +=
      units.times == TrajectoryUnits::Times::stamps
          ? " in " + format_number(poses.back().stamp_s - poses.front().stamp_s, {}, 4) + " s"
          : " without stamps";
  summary += " over " + format_number(length_m, "m", 4) + (units.is_metric ? " m" : " view steps");
  return {.type = "trajectory",
          .summary = summary,
          .bytes = find_file_bytes(file),
          .facts = repeated == 0 ? std::vector<std::string>{}
                                 : std::vector{format_count(repeated, "pose") +
                                               " left out, because the pose before has the "
                                               "same stamp"},
          .use = {list_verbs_that_take(InputKind::trajectory),
                  {"panonav", "evaluate", "ESTIMATE", file}}};
}

DescribedInput describe_scene(const std::string& file, const std::string& description) {
  return {.type = "scene",
          .summary = description + " for the simulator",
          .bytes = find_file_bytes(file),
          .use = {list_verbs_that_take(InputKind::scene),
                  {"panonav", "simulate", file, fs::path(file).stem().string() + "_run", "--grid",
                   "0.5", "--kind", "panorama"}}};
}

DescribedInput describe_page(const fs::path& page) {
  return {.type = "report",
          .summary = "page that panonav wrote; open " + page.string() + " in a browser",
          .bytes = find_file_bytes(page)};
}

DescribedInput describe_live(const std::string& address) {
  const bool is_input = address == "-";
  return {
      .type = "live source",
      .summary = is_input ? "JPEG images, one after the other, on standard input"
                          : "video or image stream over " + address.substr(0, address.find(':')) +
                                ", which the program ffmpeg opens",
      .facts = {"it was not opened"},
      .use = {list_verbs_that_take(InputKind::live), {"panonav", "localise", "MEMORY", address}}};
}

DescribedInput describe_folder(const std::string& folder) {
  if (has_dataset_file(folder)) return describe_dataset(folder);
  for (const char* name : {"index.html", "gallery.html"}) {
    const fs::path page = fs::path(folder) / name;
    std::error_code error;
    if (fs::is_regular_file(page, error) && identify_content(page).kind == FileContent::page) {
      return describe_page(page);
    }
  }
  return describe_picture_folder(folder);
}

}  // namespace

GuessedKind guess_kind(ImageSize size) {
  constexpr double tolerance = 0.02;
  const double ratio = static_cast<double>(size.width) / size.height;
  if (std::abs(ratio - 2.0) <= 2.0 * tolerance) {
    return {"equirectangular",
            "twice as wide as high: probably the whole sphere (--kind equirectangular), or the two "
            "circles of a 360 degree camera (calibrate)"};
  }
  if (ratio > 2.0) return {"panorama", "a strip: probably a panorama (--kind panorama)"};
  return {"", "if it shows a ring, it is the image of a mirror camera: calibrate the camera first"};
}

std::vector<std::string> list_verbs_that_take(InputKind kind) {
  std::vector<std::string> verbs;
  const auto built = verb_names();
  const auto* const found = std::ranges::find(takers, kind, &Takers::kind);
  for (std::string name : split_words(found->verbs)) {
    std::ranges::replace(name, '_', ' ');
    if (std::ranges::find(built, name) == built.end()) continue;
    if (!found->option.empty()) name.append(" ").append(found->option);
    verbs.push_back(std::move(name));
  }
  return verbs;
}

std::vector<std::string> make_memorise_command(const std::string& input,
                                               std::string_view image_kind) {
  fs::path path = fs::absolute(input).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  std::vector<std::string> words{"panonav", "memorise", path.stem().string() + ".panonav", input};
  if (!image_kind.empty()) words.insert(words.end(), {"--kind", std::string(image_kind)});
  return words;
}

DescribedInput describe_input(const std::string& input) {
  if (recordings::is_live(input)) return describe_live(input);
  std::error_code error;
  if (!fs::exists(input, error)) throw FileError(input, "no such file or folder");
  if (fs::is_directory(input, error)) return describe_folder(input);
  const IdentifiedContent content = identify_content(input);
  switch (content.kind) {
    case FileContent::picture:
      return describe_picture(input, content.description);
    case FileContent::toml:
      return describe_toml(input);
    case FileContent::calibration:
      return describe_camera_file(input);
    case FileContent::table:
      return describe_trajectory(input);
    case FileContent::world:
    case FileContent::mesh:
      return describe_scene(input, content.description);
    case FileContent::page:
      return describe_page(input);
    case FileContent::other:
      break;
  }
  throw FileError(input, "no verb takes it; it is " + content.description);
}

}  // namespace panonav::command
