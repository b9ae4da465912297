#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_simulation/mirror.hpp"
#include "support/command_runner.hpp"
#include "support/patch_views.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Three pictures of the simulated mirror camera, made once for all tests of this file.
class CameraVerbs : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    run_well({"simulate", "office", *folder_ / "run", "--random", "3", "--rays-per-axis", "1",
              "--exposure", "2"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string picture(int i) {
    return *folder_ / ("run/view_0000" + std::to_string(i) + ".png");
  }
  static std::string true_camera() { return *folder_ / "run/camera.toml"; }

  TemporaryFolder out_;
  inline static std::optional<TemporaryFolder> folder_;
};

TEST_F(CameraVerbs, CalibrateFindsTheSimulatedMirror) {
  const auto said = answer_of({"calibrate", picture(0), picture(1), picture(2), "-o",
                               out_ / "camera.toml", "--overlay", out_ / "overlay.png", "--json"});
  EXPECT_EQ(keys_of(said), (std::set<std::string>{"images", "width_px", "height_px", "centre_u_px",
                                                  "centre_v_px", "rim_radius_px", "inner_radius_px",
                                                  "inner_radius_found", "quality", "residual_px",
                                                  "deviation_over_images", "assumed", "camera"}));
  EXPECT_EQ(said["images"], 3);
  const Camera truth = simulation::make_simulated_mirror_camera();
  const Camera found = read_camera(out_ / "camera.toml").camera;
  EXPECT_NEAR(found.centre.u_px, truth.centre.u_px, 0.3);
  EXPECT_NEAR(found.centre.v_px, truth.centre.v_px, 0.3);
  EXPECT_NEAR(found.rim_radius_px, truth.rim_radius_px, 0.5);
  // The camera's body, not the lens within it.
  EXPECT_NEAR(found.inner_radius_px, truth.inner_radius_px, 1.5);
  EXPECT_EQ(found.image_size, truth.image_size);
  EXPECT_EQ(read_image(out_ / "overlay.png").size(), truth.image_size);
}

TEST_F(CameraVerbs, AssumedShapesOfMirrorsAreNamedAndGiveNoMetres) {
  const std::string camera = out_ / "camera.toml";
  const auto assumed_with = [&](const std::vector<std::string>& more) {
    const auto call = with({"calibrate", picture(0), picture(1), "-o", camera, "--json"}, more);
    const json said = answer_of(call);
    EXPECT_EQ(read_camera(camera).camera.has_assumed_elevations, !said["assumed"].empty());
    return said["assumed"];
  };
  const std::vector<std::string> all{
      "--profile",     "hyperboloidal", "--mirror-a-mm",       "28.095",
      "--mirror-b-mm", "23.4125",       "--rim-elevation-deg", "20"};
  EXPECT_EQ(assumed_with(all), json::array());
  EXPECT_EQ(assumed_with({"--profile", "unified", "--xi", "0.9"}), (json{"rim_elevation_deg"}));
  EXPECT_EQ(assumed_with({}), (json{"profile", "inner_elevation_deg", "rim_elevation_deg"}));
  const auto text =
      run_panonav({"calibrate", picture(0), "-o", camera, "--profile", "hyperboloidal"});
  EXPECT_TRUE(contains(text.out,
                       "assumed: --mirror-a-mm 28.095, --mirror-b-mm 23.4125, "
                       "--rim-elevation-deg 20"))
      << text.out;

  const std::string plain = out_ / "plain";
  fs::create_directory(plain);
  for (int i = 0; i < 3; ++i) fs::copy(picture(i), plain);
  const std::string memory = out_ / "map.panonav";
  const std::vector<std::string> images{memory, plain, "--kind", "mirror", "--camera", camera};
  expect_refusal(with(with({"map"}, images), {"--camera-height-m", "0.6"}),
                 "whose shape was assumed");
  EXPECT_FALSE(fs::exists(memory));
  run_well(with({"memorise"}, images));
  // Other cameras are named, with the elevations that both show.
  const auto other =
      run_panonav({"localise", memory, picture(0), "--kind", "mirror", "--camera", true_camera()});
  EXPECT_TRUE(contains(other.err, "is not that of the reference images")) << other.err;
  EXPECT_TRUE(contains(other.err, "degrees")) << other.err;
  const auto same = run_panonav({"localise", memory, picture(0)});
  EXPECT_FALSE(contains(same.err, "reference images")) << same.err;
}

TEST_F(CameraVerbs, CalibrationsOfOtherProgramsAreConvertedAndWritten) {
  const auto exported = answer_of(
      {"calibrate", true_camera(), "-o", out_ / "mei.yaml", "--export", "opencv", "--json"});
  EXPECT_EQ(exported["format"], "camera file");
  const auto said = answer_of(
      {"calibrate", out_ / "mei.yaml", "-o", out_ / "back.toml", "--mount", "mirror", "--json"});
  EXPECT_EQ(keys_of(said), (std::set<std::string>{"input", "format", "elevations_rad", "camera"}));
  EXPECT_EQ(said["format"], "OpenCV (omnidir) calibration");
  const Camera truth = read_camera(true_camera()).camera;
  const Camera back = read_camera(out_ / "back.toml").camera;
  for (const double radius_px : {60.0, 100.0, 150.0, 200.0}) {
    const PixelPoint pixel{truth.centre.u_px + radius_px, truth.centre.v_px};
    EXPECT_NEAR(degrees(unproject(back, pixel)->elevation_rad()),
                degrees(unproject(truth, pixel)->elevation_rad()), 0.05);
  }
  expect_refusal({"calibrate", true_camera(), "-o", out_ / "x.toml", "--mount", "down"}, "--mount");
  expect_refusal({"calibrate", picture(0), "-o", out_ / "x.toml", "--mount", "down"}, "--mount");
  expect_refusal({"calibrate", true_camera(), "-o", out_ / "x.toml", "--profile", "unified"},
                 "--profile");
  EXPECT_FALSE(fs::exists(out_ / "x.toml"));
}

TEST_F(CameraVerbs, ACalibrationOfAnotherProgramIsACameraFile) {
  const auto [width, height] = read_image(picture(0)).size();
  const std::string centre = std::to_string(width / 2) + ", " + std::to_string(height / 2);
  const auto write = [&](const std::string& name, const std::string& distortion) {
    std::ofstream(out_ / name) << "cam0:\n  camera_model: pinhole\n  intrinsics: [150, 150, " +
                                      centre + "]\n  distortion_model: " + distortion +
                                      "\n  distortion_coeffs: [0.01, 0, 0, 0]\n  resolution: [" +
                                      std::to_string(width) + ", " + std::to_string(height) + "]\n";
  };
  write("lens.yaml", "equidistant");
  const auto unwrapped =
      run_panonav({"unwrap", picture(0), "--camera", out_ / "lens.yaml", "-o", out_ / "seen.png"});
  EXPECT_EQ(unwrapped.exit_code, 0) << unwrapped.err;
  EXPECT_TRUE(contains(unwrapped.err, "lens.yaml: Kalibr (pinhole-equi) calibration"));
  EXPECT_TRUE(fs::exists(out_ / "seen.png"));
  const auto info = answer_of({"info", out_ / "lens.yaml", "--json"});
  EXPECT_TRUE(contains(info["summary"].get<std::string>(), "Kalibr (pinhole-equi) calibration"));
  write("narrow.yaml", "radtan");
  const std::string narrow = out_ / "narrow.yaml";
  expect_refusal({"unwrap", picture(0), "--camera", narrow, "-o", out_ / "no.png"},
                 "narrow.yaml, of the model pinhole");
  const auto converted = answer_of({"calibrate", narrow, "-o", out_ / "narrow.toml", "--json"});
  EXPECT_EQ(converted["format"], "Kalibr (pinhole-radtan) calibration");
  EXPECT_NEAR(converted["field_of_view_rad"].get<double>(),
              field_of_view(read_camera(out_ / "narrow.toml").camera), 1e-9);
  expect_refusal({"calibrate", narrow, "-o", out_ / "x.toml", "--mount", "down"}, "looks forward");
  expect_refusal({"calibrate", out_ / "narrow.toml", "-o", out_ / "x.yaml", "--export", "kalibr"},
                 "pinhole");
  EXPECT_EQ(answer_of({"info", narrow, "--json"})["verbs"],
            json::array({"localise --kind pinhole --camera"}));
}

TEST_F(CameraVerbs, ARigIsOneCamera) {
  const fs::path set = out_ / "rig_set";
  const std::vector<std::string> folders{"front", "left", "back", "right"};
  std::string list = "file\n";
  for (int place = 0; place < 3; ++place) {
    const Panorama view = make_patch_view(static_cast<std::uint64_t>(place));
    for (std::size_t i = 0; i < folders.size(); ++i) {
      fs::create_directories(set / folders[i]);
      const Image seen = take_narrow_picture(view, static_cast<double>(i) * std::numbers::pi / 2,
                                             std::numbers::pi / 2, {160, 120});
      write_png(set / folders[i] / (std::to_string(place) + ".png"), seen.view());
    }
    list += "front/" + std::to_string(place) + ".png\n";
  }
  const std::string camera = set / "rig.toml";
  write_camera(camera, {rig_camera(4), {}, {}});
  std::ofstream(set / "list.csv") << list;
  std::ofstream(set / "dataset.toml")
      << "[images]\nkind = \"mirror\"\ncamera = \"rig.toml\"\n"
         "folders = [\"front\", \"left\", \"back\", \"right\"]\n[list]\nfile = \"list.csv\"\n";
  const std::string memory = out_ / "rig.panonav";
  run_well({"memorise", memory, set});
  std::vector<std::string> question{"localise", memory, "--camera", camera};
  for (const std::string& name : folders) question.push_back(set / name / "1.png");
  const auto answers = answers_of(with(question, {"--json"}));
  ASSERT_EQ(answers.size(), 1U) << "one question of four images";
  EXPECT_EQ(answers[0]["matches"][0]["file"], "front/1.png");
  question.pop_back();
  expect_refusal(question, "a multiple of its 4 cameras");
  EXPECT_TRUE(contains(answer_of({"info", camera, "--json"})["verbs"].dump(), "memorise --camera"));

  const std::string front = out_ / "front.toml";  // three of the four cameras
  write_camera(front, {rig_camera(3), {}, {}});
  EXPECT_EQ(answer_of({"info", front, "--json"})["verbs"],
            json::array({"localise --kind pinhole --camera"}));
  expect_refusal({"unwrap", picture(0), "--camera", front, "-o", out_ / "no.png"},
                 "front.toml, of the model rig, which shows a part of the azimuth");
  expect_refusal({"localise", memory, picture(0), "--kind", "pinhole", "--camera", front},
                 "stores no features for narrow pictures");
  expect_refusal({"calibrate", camera, "-o", out_ / "x.yaml", "--export", "kalibr"}, "rig");
}

TEST_F(CameraVerbs, CalibrateWithoutAMirrorIsNoAnswer) {
  Image plain(200, 160);
  for (auto& pixel : plain.pixels()) pixel = 90;
  write_png(out_ / "plain.png", plain.view());
  const auto result = run_panonav({"calibrate", out_ / "plain.png", "-o", out_ / "camera.toml"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_TRUE(contains(result.err, "plain.png"));
  EXPECT_FALSE(fs::exists(out_ / "camera.toml"));
}

// The camera moved relative to the mirror: no calibration fits all images.
TEST_F(CameraVerbs, CalibrateRefusesARimThatMoves) {
  const int shifts_px[] = {-9, 0, 9};
  std::vector<std::string> arguments{"calibrate"};
  for (int i = 0; i < 3; ++i) {
    const Image image = read_image(picture(i));
    Image shifted(image.width(), image.height(), image.channels());
    for (int v = 0; v < image.height(); ++v) {
      for (int u = 0; u < image.width(); ++u) {
        const int from = std::clamp(u - shifts_px[i], 0, image.width() - 1);
        for (int c = 0; c < image.channels(); ++c) {
          shifted.at(u, v, c) = image.at(from, v, c);
        }
      }
    }
    arguments.push_back(out_ / ("shifted" + std::to_string(i) + ".png"));
    write_png(arguments.back(), shifted.view());
  }
  // With a low limit the mirror is found, although the mean of the images blurs its rim.
  const auto result =
      run_panonav(with(arguments, {"--min-quality", "0.2", "-o", out_ / "camera.toml"}));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(contains(result.err, "its centre varies by 9.")) << result.err;
  EXPECT_FALSE(fs::exists(out_ / "camera.toml"));
}

TEST_F(CameraVerbs, CalibrateRefusesBadInput) {
  const std::string camera = out_ / "camera.toml";
  std::ofstream(out_ / "text.png") << "no image";
  Image other(64, 48);
  write_png(out_ / "other.png", other.view());
  const auto refused = [&](const std::vector<std::string>& images, const std::string& word) {
    std::vector<std::string> arguments{"calibrate"};
    arguments.insert(arguments.end(), images.begin(), images.end());
    arguments.insert(arguments.end(), {"-o", camera});
    expect_refusal(arguments, word);
    EXPECT_FALSE(fs::exists(camera));
  };
  refused({out_ / "nowhere.png"}, "nowhere.png");
  refused({out_ / "text.png"}, "text.png");
  refused({picture(0), out_ / "other.png"}, "64 x 48; allowed: 640 x 480");
  refused({picture(0), "--rim-elevation-deg", "100"}, "rim_elevation_deg is 100");
  refused({picture(0), "--min-quality", "0"}, "min_quality is 0");
  expect_refusal({"calibrate", picture(0)}, "--out is required");
  expect_refusal({"calibrate", picture(0), "-o", out_ / "text.png/camera.toml"},
                 "text.png/camera.toml");
}

TEST_F(CameraVerbs, TwoLensesAreCalibratedAndUnwrapped) {
  std::ofstream(out_ / "turns.csv")
      << "stamp_s,x_m,y_m,heading_deg\n0,2.5,1,0\n1,2.5,1,85\n2,2.5,1,-170\n";
  run_well({"simulate", "office", out_ / "turned", "--trajectory", out_ / "turns.csv", "--kind",
            "dual-fisheye", "--lens-seed", "4", "--rays-per-axis", "1"});
  std::vector<std::string> arguments{"calibrate"};
  for (int i = 0; i < 3; ++i) {
    arguments.push_back(out_ / ("turned/view_0000" + std::to_string(i) + ".png"));
  }
  const auto with = [&](const std::vector<std::string>& more) {
    auto all = arguments;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const auto said = answer_of(with({"--profile", "dual-fisheye", "-o", out_ / "found.toml",
                                    "--overlay", out_ / "circles.png", "--json"}));
  EXPECT_EQ(keys_of(said),
            (std::set<std::string>{"images", "width_px", "height_px", "matches", "inlier_share",
                                   "residual_deg", "azimuth_deviation_deg", "field_of_view_deg",
                                   "turns_deg", "camera"}));
  EXPECT_LT(said["azimuth_deviation_deg"], 0.1);
  EXPECT_NEAR(said["turns_deg"][1], 85, 0.2);
  EXPECT_EQ(read_image(out_ / "circles.png").size(), (ImageSize{1280, 640}));
  // Stitched with what was found and with the lenses as they are: the same but for the left lens's
  // azimuth, which no picture shows, and noise.
  const Camera truth = read_camera(out_ / "turned/camera.toml").camera;
  Camera found = read_camera(out_ / "found.toml").camera;
  const double off = std::get<DualFisheyeModel>(truth.model).lenses[0].azimuth_rad;
  for (FisheyeLens& lens : std::get<DualFisheyeModel>(found.model).lenses) lens.azimuth_rad += off;
  double worst = 0;
  for (int i = 0; i < 360; ++i) {
    const auto d = Direction3::from_angles(radians(i), 0);
    const auto again = unproject(found, project(truth, d).value());
    ASSERT_TRUE(again);
    worst = std::max(worst, std::abs(angle_difference(again->azimuth_rad(), d.azimuth_rad())));
  }
  EXPECT_LT(degrees(worst), 0.2);
  const auto unwrapped =
      answer_of({"unwrap", arguments[1], "--camera", out_ / "found.toml", "--elevation-deg", "-40",
                 "40", "-o", out_ / "p.png", "--json"});
  EXPECT_EQ(unwrapped["columns"], 512);

  expect_refusal(with({"--left-roll-deg", "90", "-o", out_ / "no.toml"}), "dual-fisheye");
  const auto one =
      run_panonav({"calibrate", arguments[1], "--profile", "dual-fisheye", "-o", out_ / "no.toml"});
  EXPECT_EQ(one.exit_code, 1);
  EXPECT_EQ(lines(one.err).size(), 1U) << one.err;
  EXPECT_TRUE(contains(one.err, "uncertain"));
  EXPECT_FALSE(fs::exists(out_ / "no.toml"));
}

TEST_F(CameraVerbs, UnwrapGivesTheCylinder) {
  const auto said =
      answer_of({"unwrap", picture(0), "--camera", true_camera(), "-o", out_ / "p.png", "--json"});
  EXPECT_EQ(keys_of(said), (std::set<std::string>{"image", "out", "rows", "columns",
                                                  "elevations_rad", "horizon_row"}));
  EXPECT_EQ(said["rows"], 80);
  EXPECT_EQ(said["columns"], 512);
  const int horizon = said["horizon_row"];
  EXPECT_GT(horizon, 5);
  EXPECT_LT(horizon, 75);
  const Image panorama = read_image(out_ / "p.png");
  EXPECT_EQ(panorama.size(), (ImageSize{512, 80}));
  const auto [darkest, brightest] =
      std::minmax_element(panorama.pixels().begin(), panorama.pixels().end());
  EXPECT_GT(*brightest - *darkest, 60) << "a plain image";

  run_well({"unwrap", picture(0), "--camera", true_camera(), "-o", out_ / "s.png", "--rows", "20",
            "--columns", "128"});
  EXPECT_EQ(read_image(out_ / "s.png").size(), (ImageSize{128, 20}));
}

TEST_F(CameraVerbs, RecordingsAreCalibratedAndUnwrappedAsTheirPicturesAre) {
  const std::string run = *folder_ / "run";
  const std::string recording = out_ / "run.mcap";
  run_well({"convert", run, recording});
  const auto calibrate = [&](const std::vector<std::string>& inputs) {
    json said = answer_of(with(with({"calibrate"}, inputs), {"-o", out_ / "c.toml", "--json"}));
    EXPECT_EQ(said["images"], 3);
    return said;
  };
  const json by_pictures = calibrate({picture(0), picture(1), picture(2)});
  EXPECT_EQ(calibrate({run}), by_pictures);
  EXPECT_EQ(calibrate({recording}), by_pictures);
  // A damaged image of a folder is skipped and named.
  const std::filesystem::path mixed = std::string(out_ / "mixed");
  std::filesystem::create_directory(mixed);
  for (int i = 0; i < 3; ++i)
    std::filesystem::copy_file(picture(i), mixed / ("p" + std::to_string(2 * i) + ".png"));
  std::string damaged = bytes_of(picture(1));
  damaged[damaged.size() - 30] ^= 1;  // in the pixels
  std::ofstream(mixed / "p1.png", std::ios::binary) << damaged;
  const auto result = run_panonav({"calibrate", mixed, "-o", out_ / "c.toml", "--json"});
  EXPECT_EQ(json::parse(result.out), by_pictures);
  EXPECT_TRUE(contains(result.err, "skipped: " + (mixed / "p1.png").string())) << result.err;

  run_well({"unwrap", picture(1), "--camera", true_camera(), "-o", out_ / "one.png"});
  const auto said = answer_of({"unwrap", run, "-o", out_ / "by_folder", "--json"});
  EXPECT_EQ(said["images"], 3);
  EXPECT_EQ(said["rows"], 80);
  EXPECT_EQ(read_image(out_ / "by_folder/view_00001.png"), read_image(out_ / "one.png"));
  run_well({"unwrap", recording, "--camera", true_camera(), "-o", out_ / "by_recording"});
  EXPECT_EQ(read_image(out_ / "by_recording/1_000000000.png"), read_image(out_ / "one.png"));
  expect_refusal({"unwrap", run, "-o", out_ / "by_folder"}, "allowed: a new folder");
  expect_refusal({"unwrap", recording, "-o", out_ / "none"}, "--kind");
  for (const char* verb : {"unwrap", "calibrate"}) {
    expect_refusal({verb, picture(1), "-o", out_ / "x", "--every", "2"}, "image");
  }
}

TEST_F(CameraVerbs, UnwrapRefusesBadInput) {
  std::ofstream(out_ / "text.png") << "no image";
  Image other(64, 48);
  write_png(out_ / "other.png", other.view());
  std::ofstream(out_ / "bad.toml") << "model = \"unified\"\nxi = nan\n";
  const std::string panorama = out_ / "p.png";
  const auto refused = [&](const std::string& image, const std::vector<std::string>& more,
                           const std::vector<std::string>& words) {
    std::vector<std::string> arguments{"unwrap", image, "-o", panorama};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto line = refusal(arguments);
    for (const auto& word : words) EXPECT_TRUE(contains(line, word));
    EXPECT_FALSE(fs::exists(panorama));
  };
  refused(picture(0), {}, {"--camera"});
  refused(out_ / "nowhere.png", {"--camera", true_camera()}, {"nowhere.png"});
  refused(out_ / "text.png", {"--camera", true_camera()}, {"text.png"});
  refused(out_ / "other.png", {"--camera", true_camera()}, {"other.png", "64", "640"});
  refused(picture(0), {"--camera", out_ / "bad.toml"}, {"bad.toml"});
  refused(picture(0), {"--camera", out_ / "no.toml"}, {"no.toml"});
  refused(picture(0), {"--camera", true_camera(), "--rows", "0"}, {"rows is 0"});
  refused(picture(0), {"--kind", "equirectangular", "--elevation-deg", "40", "-30"},
          {"--elevation-deg is 40 -30; allowed"});
  expect_refusal({"unwrap", picture(0), "--camera", true_camera(), "-o", out_ / "text.png/p.png"},
                 "text.png/p.png");
  EXPECT_TRUE(contains(refusal({"unwrap", picture(0), "--camera", true_camera(), "-o", panorama},
                               {.file_size_limit_bytes = 2000, .kill_after_ms = {}}),
                       "p.png"));
  EXPECT_FALSE(fs::exists(panorama)) << "half an image";
}

TEST_F(CameraVerbs, MemoriseSaysWhereColumnsRunOtherwiseThanStated) {
  const std::string run = out_ / "run";
  run_well({"simulate", "office", run, "--path", "walk", "--poses", "60", "--spacing-m", "0.2",
            "--heading", "path", "--kind", "panorama", "--rows", "20", "--columns", "128"});
  const auto right = answer_of({"memorise", out_ / "right.panonav", run, "--json"});
  EXPECT_TRUE(right["orientation_fault"].is_null()) << right;
  EXPECT_FALSE(contains(run_panonav({"memorise", out_ / "again.panonav", run}).out, "orientation"));

  write_file(fs::path(run) / "dataset.toml",
             std::string_view("[images]\nkind = \"panorama\"\ncolumns = \"counter-clockwise\"\n"
                              "forward_column = 0.25\nelevation_deg = [-30, 40]\n"
                              "[poses]\nfile = \"poses.csv\"\n"));
  const auto wrong = answer_of({"memorise", out_ / "wrong.panonav", run, "--json"});
  const json& fault = wrong["orientation_fault"];
  ASSERT_TRUE(fault.is_object());
  EXPECT_EQ(fault["columns_run_opposite"], true);
  EXPECT_GT(fault["opposite_turns"], 10);
  EXPECT_NEAR(fault["forward_turn_deg"].get<double>(), 90.0, 10.0);
  const auto said = run_panonav({"memorise", out_ / "wrong2.panonav", run}).out;
  const std::string finding = "columns run clockwise, not counter-clockwise";
  EXPECT_TRUE(contains(said, finding)) << said;
  EXPECT_TRUE(contains(said, "columns = \"clockwise\"")) << said;

  // All verbs that read the images or the views say the same.
  EXPECT_TRUE(contains(run_panonav({"info", out_ / "wrong.panonav"}).out, finding));
  EXPECT_TRUE(contains(run_panonav({"info", run}).out, finding));
  EXPECT_TRUE(contains(run_panonav({"localise", out_ / "right.panonav", run}).err, finding));
  const auto info = answer_of({"info", run, "--json"});
  EXPECT_EQ(info["orientation_fault"]["columns_run_opposite"], true);

  expect_refusal({"calibrate", "--orientation", run, "-o", run + "/dataset.toml"}, "dataset.toml");
  const std::string corrected = out_ / "corrected.toml";
  run_well({"calibrate", "--orientation", run, "-o", corrected});
  fs::copy_file(corrected, fs::path(run) / "dataset.toml", fs::copy_options::overwrite_existing);
  EXPECT_TRUE(
      answer_of({"memorise", out_ / "corrected.panonav", run, "--json"})["orientation_fault"]
          .is_null());
  const auto now =
      answer_of({"calibrate", "--orientation", run, "-o", out_ / "none.toml", "--json"});
  EXPECT_EQ(now["columns_right"], true);
  EXPECT_EQ(now["forward_right"], true);
  EXPECT_TRUE(now["out"].is_null());
  EXPECT_FALSE(fs::exists(out_ / "none.toml"));
}

TEST_F(CameraVerbs, EvaluateSaysThatAMapWasMadeOfMisreadImages) {
  const std::string run = out_ / "run";
  run_well({"simulate", "office", run, "--path", "walk", "--poses", "60", "--spacing-m", "0.2",
            "--heading", "path", "--kind", "panorama", "--rows", "20", "--columns", "128"});
  write_file(fs::path(run) / "dataset.toml",
             std::string_view("[images]\nkind = \"panorama\"\ncolumns = \"counter-clockwise\"\n"
                              "elevation_deg = [-30, 40]\n[poses]\nfile = \"poses.csv\"\n"));
  run_well({"map", out_ / "map.panonav", run});
  const auto said =
      run_panonav({"evaluate", out_ / "map.panonav", run + "/poses.csv", "--align", "similarity"});
  EXPECT_TRUE(contains(said.out, "columns run clockwise, not counter-clockwise")) << said.out;
}

}  // namespace
}  // namespace panonav::testing
