#include <chrono>
#include <filesystem>
#include <memory>
#include <vector>

#include "arguments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/evaluation/m04_figures.hpp"
#include "panonav/evaluation/place_recording.hpp"
#include "panonav/evaluation/plot.hpp"
#include "panonav/evaluation/statistics.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/simulation/mirror.hpp"
#include "panonav/simulation/renderer.hpp"
#include "panonav/simulation/sensor.hpp"
#include "panonav/storage/memory_file.hpp"
#include "report_page.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct DemoArguments {
  std::string out = "demo";
  std::optional<std::uint64_t> seed;
};

constexpr int kComponents = 15;
// 80 x 15 magnitudes of preprocessed offices stay below; larger ones saturate, which does no harm
// to speak of.
constexpr float kFullScale = 0.5F;

FourierSignature signature_of(const Panorama& view) {
  return compute_signature(preprocess(view, PreprocessingOptions{}), kComponents);
}

std::string percent(double share) {
  return fixed(100.0 * share, 0) + " %";
}

// What the robot's camera sees at the first query, and the cylinder made of it.
void show_camera(const PlaceRecording& place, const fs::path& out, Session& session,
                 ReportPage& page) {
  const Camera camera = simulated_mirror_camera();
  const Renderer renderer(place.scene, {.channels = 3}, session.executor());
  const Viewpoint viewpoint{.pose = place.queries.front().pose,
                            .height_m = place.scene.camera_height_m};
  const Image raw = apply_sensor(renderer.render_image(viewpoint, camera, 2, session.executor()),
                                 camera, SensorOptions{}, 1);
  write_png(out / "mirror.png", raw.view());
  const Unwarper unwarper(camera);
  const Panorama cylinder = unwarper.unwrap(raw.view());
  const Image picture = to_picture(cylinder);
  write_png(out / "cylinder.png", picture.view());
  page.section("What the robot sees");
  page.text(
      "A camera looks up into a hyperboloidal mirror and sees all around. The middle shows the "
      "camera itself. "
      "The picture is unwarped to a panoramic cylinder, here with forward in the middle, and of "
      "each of its 80 rows "
      "only the first 15 Fourier components are kept: 2.4 kB. Their magnitudes tell the place "
      "whichever way the robot "
      "faces, their phases tell the heading.");
  page.pictures({{"mirror.png", "Raw picture of the mirror camera, 640 x 480"},
                 {"cylinder.png", "The panoramic cylinder, 512 x 80, forward in the middle"}});
}

MemoryFile memorise_place(const PlaceRecording& place, const fs::path& path) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(path.string() + suffix, ignored);
  MemoryHeader header;
  header.shape = {place.references.front().panorama.rows(), kComponents};
  header.full_scale = kFullScale;
  header.elevations = place.references.front().panorama.elevations();
  MemoryFile file = MemoryFile::create(path, header);
  std::vector<NewView> views;
  for (std::size_t i = 0; i < place.references.size(); ++i) {
    const Pose2& pose = place.references[i].pose;
    views.push_back({{.name = "view " + std::to_string(i),
                      .pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad},
                      .stamp_s = std::nullopt},
                     pack(signature_of(place.references[i].panorama), kFullScale),
                     {}});
  }
  (void)file.append(views);
  return file;
}

struct Answers {
  std::vector<double> errors_m;
  std::vector<double> nearest_errors_m;
  std::vector<double> heading_errors_deg;
  std::size_t known = 0;
  double bytes_share = 0.0;
};

Answers ask(const Localiser& localiser, const VisualMemory& memory,
            const std::vector<PlacedView>& queries) {
  Answers answers;
  for (const auto& query : queries) {
    const auto found = localiser.localise(pack(signature_of(query.panorama), kFullScale));
    answers.known += found.known ? 1 : 0;
    answers.bytes_share += static_cast<double>(found.bytes_read) /
                           static_cast<double>(found.bytes_in_full) /
                           static_cast<double>(queries.size());
    const Point2 truth = query.pose.position();
    if (!found.matches.empty()) {
      answers.nearest_errors_m.push_back(
          distance(memory.info(found.matches.front().view).pose->position(), truth));
    }
    if (found.position) answers.errors_m.push_back(distance(found.position->position, truth));
    if (found.heading_rad) {
      answers.heading_errors_deg.push_back(
          degrees(std::abs(angle_difference(*found.heading_rad, query.pose.heading_rad))));
    }
  }
  return answers;
}

void show_map(const PlaceRecording& place, const Localiser& localiser, const fs::path& out) {
  MapPlot map{.title = "Where the robot was, and where its memory says it was", .layers = {}};
  MapLayer references;
  references.label = "reference views";
  for (const auto& view : place.references) references.circles.push_back(view.pose.position());
  MapLayer truth;
  truth.label = "true position";
  truth.colour = "#009e73";
  MapLayer error;
  error.label = "error";
  error.colour = "#d55e00";
  for (const auto& query : place.queries) {
    const auto found = localiser.localise(pack(signature_of(query.panorama), kFullScale));
    truth.crosses.push_back(query.pose.position());
    if (found.position) error.lines.push_back({query.pose.position(), found.position->position});
  }
  map.layers = {references, truth, error};
  write_plot(out / "map.png", map);
}

ExitCode demonstrate(const DemoArguments& wanted, Session& session) {
  const auto start = std::chrono::steady_clock::now();
  const fs::path out(wanted.out);
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw FileError(out.string(), "cannot be made: " + error.message());
  Progress progress("demo", 6);
  const std::uint64_t seed = wanted.seed.value_or(1);
  const PlaceRecording office =
      record_place({.scene = "office", .seed = seed, .queries = 40}, session.executor());
  progress.advance();
  const PlaceRecording elsewhere = record_place(
      {.scene = "lab", .seed = seed + 1, .spacing_m = 0.5, .queries = 40}, session.executor());
  progress.advance();

  ReportPage page("panonav: a robot that remembers what places look like",
                  "A simulated robot with one mirror camera drives through an office, remembers a "
                  "view every 25 cm, "
                  "is put down elsewhere, and says where it is and which way it faces. No laser, "
                  "no GPU, no training.");
  show_camera(office, out, session, page);
  progress.advance();

  const fs::path memory_path = out / "office.panonav";
  const MemoryFile file = memorise_place(office, memory_path);
  const VisualMemory memory = file.load();
  const Localiser localiser(memory);
  const Answers own = ask(localiser, memory, office.queries);
  const Answers foreign = ask(localiser, memory, elsewhere.queries);
  show_map(office, localiser, out);
  progress.advance();
  const double queries = static_cast<double>(office.queries.size());
  const std::string median_error =
      own.errors_m.empty() ? "none" : fixed(100.0 * median(own.errors_m), 1) + " cm";
  const std::string median_heading = own.heading_errors_deg.empty()
                                         ? "none"
                                         : fixed(median(own.heading_errors_deg), 2) + " degrees";

  page.section("Remember and localise");
  page.figures(
      {{std::to_string(memory.size()), "views remembered, 25 cm apart"},
       {median_error, "median error of the position"},
       {median_heading, "median error of the heading"},
       {percent(static_cast<double>(own.known) / queries), "of its own places recognised"},
       {percent(static_cast<double>(foreign.known) / static_cast<double>(elsewhere.queries.size())),
        "of views of another room taken for this one"},
       {percent(own.bytes_share), "of the bytes of a full scan read per question"}});
  page.text(
      "Circles are the remembered views. The robot was put down at the crosses with a random "
      "heading; each line runs "
      "to where its memory says it is. Median distance to the nearest remembered view alone: " +
      fixed(100.0 * median(own.nearest_errors_m), 1) + " cm.");
  page.pictures({{"map.png", "True positions, and the error of the answer for each"}});

  page.section("As accurate as needed");
  page.text(
      "With one Fourier component compared the robot may be in a large area; with each further "
      "component the area "
      "shrinks. In the open the coarse answer is enough and costs less; at a door the fine one is "
      "needed.");
  Reproduction figures;
  reproduce_hierarchical_areas({office}, out, figures);
  progress.advance();
  reproduce_similarity_surface(office, out, figures);
  std::vector<ReportPicture> pictures;
  for (const auto& picture : figures.pictures)
    pictures.push_back({picture.file.string(), picture.caption});
  page.pictures(pictures);
  progress.advance();

  page.section("Go on");
  page.text("The memory of this run lies beside this page.");
  page.commands({"panonav info " + memory_path.string(), "panonav verify " + memory_path.string(),
                 "panonav --help"});
  page.write(out);
  progress.clear();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  session.print("panonav demo: " + std::to_string(memory.size()) +
                " views of an office remembered, " + std::to_string(office.queries.size()) +
                " questions asked, " + fixed(seconds, 0) + " s");
  session.print("  position: median error " + median_error + "; heading: " + median_heading);
  session.print(
      "  own places recognised: " + percent(static_cast<double>(own.known) / queries) +
      "; another room taken for this one: " +
      percent(static_cast<double>(foreign.known) / static_cast<double>(elsewhere.queries.size())));
  session.print("Open " + session.strong((out / "index.html").string()) + " in a browser.");
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<DemoArguments>();
  arguments.option("-o,--out", wanted->out, "Folder for the report (default: demo)");
  arguments.option("--seed", wanted->seed, "Of the simulated office (default: 1)");
  return [wanted](Session& session) { return demonstrate(*wanted, session); };
}

}  // namespace

Verb demo_verb() {
  return {"demo", "The whole story on a simulated office, with a report to look at",
          "Takes under a minute. Needs nothing but this program and gnuplot.",
          "  panonav demo\n  panonav demo --seed 5 -o other_office", declare};
}

}  // namespace panonav::command
