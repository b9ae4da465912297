#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "command/own_images.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "support/command_runner.hpp"
#include "support/gpano_pictures.hpp"
#include "support/landmark_pictures.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::vector<std::string> split_command(const std::string& command) {
  std::istringstream text(command);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  words.erase(words.begin());  // panonav
  return words;
}

TEST_F(OwnImages, LeadFromTheMemoryToTrackingRoutesAndMetres) {
  memorise();
  const std::string tum = folder / "track.tum";
  const auto tracked = run_panonav({"track", memory(), walk(), "--tum", tum});
  EXPECT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_TRUE(contains(tracked.out, "view steps")) << tracked.out;
  EXPECT_FALSE(contains(tracked.out, " m  ")) << tracked.out;
  EXPECT_TRUE(contains(bytes_of(tum), "# unit: view steps\n# stamps: image numbers\n"));
  EXPECT_TRUE(contains(run_panonav({"export", memory(), "-o", folder / "out"}).out,
                       "positions and headings (they are in view steps"));
  const json recorded = answer_of({"route", "record", memory(), walk(), "--json"});
  EXPECT_TRUE(recorded.contains("length_steps"));
  EXPECT_FALSE(recorded.contains("length_m"));
  EXPECT_TRUE(recorded["bytes_per_km"].is_null());
  const std::string table = folder / "follow.csv";
  const auto followed =
      run_panonav({"route", "follow", memory(), walk(), "--json", "--tum", table});
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_EQ(lines(bytes_of(table)).front(), "image,x_steps,y_steps,heading_deg");
  expect_refusal({"route", "record", memory(), walk(), "--name", "other", "--every-m", "1"},
                 "--every-m");
  const json scaled =
      answer_of({"scale", memory(), "--distance", view_name(0), view_name(25), "200cm", "--json"});
  EXPECT_GT(scaled["factor"].get<double>(), 0.0);
  const json first = answer_of({"show", memory(), view_name(0), "--json"});
  const json second = answer_of({"show", memory(), view_name(25), "--json"});
  const double x_m = second["pose"]["x_m"].get<double>() - first["pose"]["x_m"].get<double>();
  const double y_m = second["pose"]["y_m"].get<double>() - first["pose"]["y_m"].get<double>();
  EXPECT_NEAR(std::hypot(x_m, y_m), 2.0, 1e-6);
  EXPECT_TRUE(answer_of({"route", "record", memory(), walk(), "--name", "metric", "--json"})
                  .contains("length_m"));
}

TEST_F(OwnImages, RoutesSayWhichFrameTheirPosesHave) {
  memorise();
  EXPECT_EQ(answer_of({"route", "record", memory(), walk(), "--name", "a", "--json"})["frame"],
            "map");
  for (const auto& entry : fs::directory_iterator(walk()))
    fs::rename(entry.path(), entry.path().parent_path() / ("x" + entry.path().filename().string()));
  const auto own = run_panonav({"route", "record", memory(), walk(), "--name", "b"});
  EXPECT_TRUE(contains(own.out, "in a frame of its own")) << own.out << own.err;
  const auto followed = run_panonav({"route", "follow", memory(), walk(), "--name", "b"});
  EXPECT_TRUE(contains(followed.out, "in the route's own frame")) << followed.out;
  const auto on_map = run_panonav({"route", "follow", memory(), walk(), "--name", "a"});
  EXPECT_FALSE(contains(on_map.out, "in the route's own frame")) << on_map.out;
  EXPECT_FALSE(contains(on_map.out, "x, y and heading are in")) << on_map.out;
}

TEST_F(OwnImages, AMergeWithACopyAddsNothing) {
  memorise();
  run_well({"copy", memory(), folder / "copy.panonav"});
  const auto merged =
      run_panonav({"merge", memory(), folder / "copy.panonav", "-o", folder / "both.panonav"});
  EXPECT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_TRUE(contains(merged.out, "copy.panonav are in ")) << merged.out;
}

TEST_F(OwnImages, AMergeWithMetresNamesTheCommandThatScales) {
  memorise();
  const std::string metric = folder / "metric.panonav";
  write_dataset(folder / "run", landmark_world(7), grid_poses(4));
  run_well({"memorise", metric, folder / "run"});
  expect_refusal({"merge", memory(), metric, "-o", folder / "both.panonav"},
                 "first scale it to metres: panonav scale " + memory() + ", with --distance");
}

TEST_F(OwnImages, AMemoryWithoutPositionsSaysWhatItCanDo) {
  memorise();
  const auto verbs = answer_of({"info", memory(), "--json"})["verbs"];
  const auto has = [](const json& list, const char* verb) {
    return std::ranges::find(list, json(verb)) != list.end();
  };
  EXPECT_TRUE(has(verbs, "scale"));
  EXPECT_TRUE(has(verbs, "track"));
  const std::string far = folder / "far";
  fs::create_directory(far);
  for (std::size_t i = 0; i < 3; ++i)
    write_picture(far + "/" + view_name(i), landmark_world(50 + i), {});
  const std::string other = folder / "far.panonav";
  run_well({"memorise", other, far, "--kind", "panorama", "--elevation-deg", "-20", "20"});
  const auto fewer = answer_of({"info", other, "--json"})["verbs"];
  EXPECT_FALSE(has(fewer, "scale"));
  EXPECT_FALSE(has(fewer, "track"));
  EXPECT_TRUE(contains(run_panonav({"info", other}).out, "positions   none"));
  const std::string arranged = run_panonav({"arrange", other}).out;
  EXPECT_TRUE(contains(arranged, "The views still have no positions")) << arranged;
  EXPECT_TRUE(contains(arranged, "Next: panonav memorise " + other)) << arranged;
}

TEST_F(OwnImages, ViewsWithoutPositionInAMemoryOfADataSetAreNamed) {
  const std::string grid = folder / "grid";
  const std::string known = folder / "grid.panonav";
  write_dataset(grid, world, grid_poses(3));
  const auto first = run_panonav({"memorise", known, grid});
  EXPECT_FALSE(contains(first.out, "no position")) << first.out;
  for (const auto& entry : fs::directory_iterator(walk()))
    fs::rename(entry.path(), entry.path().parent_path() / ("x" + entry.path().filename().string()));
  const auto more = run_panonav(
      {"memorise", known, walk(), "--kind", "panorama", "--elevation-deg", "-20", "20"});
  EXPECT_EQ(more.exit_code, 0) << more.err;
  EXPECT_TRUE(contains(more.out, "40 of 49 views have no position")) << more.out;
}

TEST_F(OwnImages, EachInputIsAPathWhateverItsImagesAreCalled) {
  // One walk with several endings is one path.
  for (std::size_t i = 0; i < count; i += 3) {
    const fs::path image = walk() / view_name(i);
    fs::rename(image, fs::path(image).replace_extension(".PNG"));
  }
  memorise();
  EXPECT_EQ(answer_of({"info", memory(), "--json"})["map"]["part_sizes"], json({count}));
  // Images of another place continue the numbers, but not the walk.
  const fs::path later = fs::path(std::string(folder / "later"));
  fs::create_directory(later);
  for (std::size_t i = 0; i < count; ++i)
    write_picture(later / view_name(count + i), landmark_world(50),
                  {0.08 * static_cast<double>(i) - 1.5, 0.2, 0.0});
  const json more = answer_of({"memorise", memory(), later, "--json"});
  EXPECT_EQ(more["map"]["part_sizes"], json({count, count}));
}

TEST_F(OwnImages, ARenamedViewIsNotStoredAgain) {
  const fs::path rest = fs::path(std::string(folder / "rest"));
  fs::create_directory(rest);
  for (std::size_t i = count / 2; i < count; ++i)
    fs::rename(walk() / view_name(i), rest / view_name(i));
  memorise();
  run_well({"rename", memory(), view_name(0), "door"});
  run_well({"rename", memory(), view_name(9), "kitchen"});
  run_well({"rename", memory(), view_name(10), "table"});
  for (std::size_t i = count / 2; i < count; ++i)
    fs::rename(rest / view_name(i), walk() / view_name(i));
  const json more = answer_of({"memorise", memory(), walk(), "--json"});
  EXPECT_EQ(more["appended"], count / 2);
  EXPECT_EQ(more["known_before"], count / 2);
  EXPECT_EQ(more["map"]["part_sizes"], json({count}));
  EXPECT_FALSE(answer_of({"show", memory(), "kitchen", "--json"})["pose"].is_null());
}

TEST_F(OwnImages, NavigateKnowsNoTrueDistanceFromPositionsOfAMap) {
  memorise();
  const auto driven = run_panonav(
      {"navigate", memory(), "--goal", view_name(5), "--scene", "office", "--seed", "2"});
  EXPECT_TRUE(contains(driven.out, "driven ")) << driven.out << driven.err;
  EXPECT_FALSE(contains(driven.out, "distance from the goal's view")) << driven.out;
  EXPECT_FALSE(contains(driven.out, "shortest path")) << driven.out;
}

TEST_F(OwnImages, TryReportsAGoodRecordingAndItsCommandsRun) {
  const std::string out = folder / "tried";
  const json tried = answer_of({"try", walk(), "-o", out, "--json"});
  EXPECT_EQ(tried["form"], "panorama");
  EXPECT_TRUE(tried["good"].get<bool>()) << tried.dump();
  EXPECT_FALSE(tried["standing"].get<bool>());
  EXPECT_EQ(tried["tried"], count);
  EXPECT_GE(tried["recognised"].get<std::size_t>(), count * 9 / 10);
  EXPECT_TRUE(fs::exists(fs::path(out) / "index.html"));
  for (const json& command : tried["commands"]) {
    auto words = split_command(command.get<std::string>());
    if (const auto at = std::ranges::find(words, "gallery"); at != words.begin()) {
      for (auto& word : words) {
        if (word == "answers" || word == "tracked" || word == "gallery") word = folder / word;
      }
    } else {
      words.back() = folder / "pictures";
    }
    run_well(words);
  }
  // A second call starts over, but not over the route that was recorded since.
  expect_refusal({"try", walk(), "-o", out}, "has a route");
  fs::remove(tried["memory"].get<std::string>());
  EXPECT_EQ(answer_of({"try", walk(), "-o", out, "--json"})["recognised"], tried["recognised"]);
  EXPECT_EQ(answer_of({"try", walk(), "-o", out, "--json"})["recognised"], tried["recognised"]);
}

// A data set with positions needs no map, and a missing one leaves no folder.
TEST_F(OwnImages, TryTakesThePositionsOfADataSet) {
  write_dataset(folder / "posed", world, grid_poses(5));
  const json tried = answer_of({"try", folder / "posed", "-o", folder / "tried", "--json"});
  for (const json& finding : tried["findings"]) {
    EXPECT_FALSE(contains(finding.get<std::string>(), "too far apart")) << finding;
  }
  EXPECT_TRUE(tried["part_sizes"].empty());
  expect_refusal({"try", folder / "none", "-o", folder / "none_try"}, "none");
  EXPECT_FALSE(fs::exists(fs::path(folder / "none_try")));
}

// A camera on a stand, and one in the hand of somebody who stands and turns around.
TEST_F(OwnImages, TryNoticesACameraThatHardlyMoves) {
  for (const double sway_m : {0.0, 0.03}) {
    const fs::path still = std::string(folder / ("still" + to_text(sway_m)));
    fs::create_directory(still);
    Random random(5);
    for (std::size_t i = 0; i < count; ++i) {
      const double turn_rad = sway_m > 0.0 ? 0.1 * static_cast<double>(i) : 0.0;
      Image image =
          landmark_picture(world, {sway_m * random.normal(), sway_m * random.normal(), turn_rad});
      for (std::uint8_t& pixel : image.pixels()) {
        pixel = static_cast<std::uint8_t>(std::clamp(pixel + 3.0 * random.normal(), 0.0, 255.0));
      }
      write_png(still / view_name(i), image.view());
    }
    const json tried = json::parse(
        run_panonav({"try", still, "-o", folder / ("tried" + to_text(sway_m)), "--json"}).out);
    EXPECT_TRUE(tried["standing"].get<bool>()) << tried.dump();
    EXPECT_FALSE(tried["good"].get<bool>());
    EXPECT_TRUE(contains(tried["verdict"].get<std::string>(), "hardly moves")) << tried.dump();
    EXPECT_TRUE(contains(tried["findings"][0].get<std::string>(), "Walk through the place"));
  }
}

TEST_F(OwnImages, TryReportsABadRecording) {
  const fs::path apart = std::string(folder / "apart");
  fs::create_directory(apart);
  for (std::size_t i = 0; i < 15; ++i) {  // another place in each image
    write_picture(apart / view_name(i), landmark_world(100 + static_cast<int>(i)), {});
  }
  const auto far = run_panonav({"try", apart, "-o", folder / "a", "--json"});
  EXPECT_LE(far.exit_code, 1) << far.err;
  const json reported = json::parse(far.out);
  EXPECT_FALSE(reported["good"].get<bool>());
  EXPECT_LE(reported["recognised"].get<int>(), 3);
  EXPECT_TRUE(contains(reported["findings"][0].get<std::string>(), "too far apart"));
  const fs::path photos = std::string(folder / "photos");
  fs::create_directory(photos);
  for (std::size_t i = 0; i < 3; ++i) {
    const Image whole = landmark_picture(world, {0.1 * static_cast<double>(i), 0.0, 0.0}, 200, 150);
    write_png(photos / view_name(i), whole.view());
  }
  const json ordinary = json::parse(run_panonav({"try", photos, "-o", folder / "b", "--json"}).out);
  EXPECT_EQ(ordinary["form"], "ordinary");
  EXPECT_EQ(ordinary["memory"], nullptr);
}

// Images with random names are no walk. Those that memorise arranges by similarity are good for all
// but a route.
TEST_F(OwnImages, TryNoticesImagesInNoOrder) {
  const fs::path mixed = std::string(folder / "mixed");
  fs::create_directory(mixed);
  for (std::size_t i = 0; i < count; ++i) {
    fs::copy_file(walk() / view_name(i), mixed / view_name(i * 17 % count));  // a permutation
  }
  const json tried = json::parse(run_panonav({"try", mixed, "-o", folder / "tried", "--json"}).out);
  EXPECT_FALSE(tried["in_order"].get<bool>()) << tried.dump();
  ASSERT_GE(10 * tried["part_sizes"][0].get<std::size_t>(), 9 * count) << tried.dump();
  EXPECT_TRUE(tried["good"].get<bool>()) << tried.dump();
  EXPECT_TRUE(contains(tried["findings"][1].get<std::string>(), "arranged by their similarity"));
  EXPECT_FALSE(contains(tried.dump(), "Record again")) << tried.dump();
  ASSERT_EQ(tried["commands"].size(), 2U) << tried.dump();
  for (const json& command : tried["commands"]) {
    std::vector<std::string> words = split_command(command.get<std::string>());
    EXPECT_NE(words.front(), "route") << command;
    words.back() = folder / words.back();
    run_well(words);
  }
  EXPECT_TRUE(contains(bytes_of(folder / "tried/index.html"), "Map of the images"));
}

TEST_F(OwnImages, ImagesMemorisedOneByOneAreOneWalk) {
  json stored;
  for (std::size_t i = 0; i < 12; ++i) {
    stored = answer_of({"memorise", memory(), walk() / view_name(i), "--kind", "panorama",
                        "--elevation-deg", "-20", "20", "--json"});
  }
  EXPECT_EQ(stored["map"]["part_sizes"], json({12})) << stored;
  expect_refusal({"try", memory()}, "is a memory");
  expect_refusal({"memorise", folder / "new.panonav", walk()}, "to find it out: panonav try ");
}

// "Record again" has a reason and what to do, also where images have positions.
TEST_F(OwnImages, TrySaysWhyImagesAreNotRecognised) {
  const fs::path sparse = std::string(folder / "sparse");
  fs::create_directory(sparse);
  std::string table = "file,x_m,y_m,heading_deg\n";
  for (std::size_t i = 0; i < 12; ++i) {  // another place in each image
    write_picture(sparse / view_name(i), landmark_world(100 + static_cast<int>(i)), {});
    table += view_name(i) + "," + std::to_string(2 * i) + ",0,0\n";
  }
  write_file(sparse / "poses.csv", std::string_view(table));
  write_file(sparse / "dataset.toml",
             std::string_view("[images]\nkind = \"panorama\"\nelevation_deg = [-20, 20]\n"
                              "[poses]\nfile = \"poses.csv\"\n"));
  const json tried =
      json::parse(run_panonav({"try", sparse, "-o", folder / "tried", "--json"}).out);
  EXPECT_FALSE(tried["good"].get<bool>()) << tried.dump();
  const std::string unknown = std::to_string(12 - tried["recognised"].get<int>());
  EXPECT_EQ(tried["findings"][0],
            unknown +
                " of 12 images are not recognised among the others; the nearest other image "
                "is 2.00 m away (median). Take images closer to each other, one every 20 to "
                "50 cm, or a video.");
  EXPECT_TRUE(contains(tried["commands"][0].get<std::string>(), "-o sparse_gallery"));
}

// Raw images of two lenses need a calibration: the commands make it, and work as printed.
TEST_F(OwnImages, TryPrintsTheCommandsForTwoLenses) {
  write_file(folder / "turns.csv",
             std::string_view("stamp_s,x_m,y_m,heading_deg\n0,2.5,1,0\n1,2.5,1,90\n2,2.5,1,180\n"
                              "3,2.5,1,-90\n"));
  const auto take = [&](const std::string& name, const std::vector<std::string>& path) {
    run_well(
        with({"simulate", "office", folder / ("all_" + name), "--kind", "dual-fisheye"}, path));
    fs::create_directory(folder / name);
    for (const auto& file : fs::directory_iterator(folder / ("all_" + name))) {
      if (file.path().stem().string().starts_with("view")) {
        fs::copy_file(file.path(), folder / name / file.path().filename());
      }
    }
  };
  take("turned", {"--trajectory", folder / "turns.csv"});
  take("lenses", {"--random", "3"});
  const auto result =
      run_panonav({"try", folder / "lenses", "-o", folder / "tried_lenses", "--json"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const json tried = json::parse(result.out);
  ASSERT_EQ(tried["commands"].size(), 2U) << tried.dump();
  for (const json& command : tried["commands"]) {
    auto words = split_command(command.get<std::string>());
    for (auto& word : words) {
      if (word == "turned" || word == "camera.toml" || word == "lenses.panonav") {
        word = folder / word;
      }
    }
    run_well(words);
  }
  EXPECT_EQ(answer_of({"info", folder / "lenses.panonav", "--json"})["views"], 3);
}

// One rule: images of a folder that cannot be used are left out, counted and named.
TEST_F(OwnImages, EveryVerbSkipsUnusableImages) {
  const std::vector<std::string> layout{"--kind", "panorama", "--elevation-deg", "-20", "20"};
  write_file(walk() / "view_007b.png", std::string_view("this is no image"));
  write_picture(walk() / "view_012b.png", world, {}, 48, 6);
  std::string damaged = bytes_of(walk() / view_name(3));
  damaged[damaged.size() - 30] ^= 1;  // in the pixels
  write_file(walk() / "view_020b.png", std::string_view(damaged));
  write_file(walk() / "._view_000.png", std::string_view("companion"));
  const auto expect_skipped = [&](const std::vector<std::string>& arguments) {
    SCOPED_TRACE(arguments.front());
    const auto result = run_panonav(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    for (const char* name : {"view_007b.png", "view_012b.png", "view_020b.png", "._view_000.png"}) {
      EXPECT_TRUE(contains(result.err, name)) << result.err;
    }
    return result;
  };
  const auto stored = expect_skipped(with({"memorise", memory(), walk()}, layout));
  EXPECT_TRUE(contains(stored.out, "40 views stored")) << stored.out;
  EXPECT_TRUE(contains(stored.out, "3 skipped")) << stored.out;
  expect_skipped({"localise", memory(), walk()});
  expect_skipped({"track", memory(), walk()});
  expect_skipped({"route", "record", memory(), walk()});
  expect_skipped({"route", "follow", memory(), walk()});
  const auto mapped = expect_skipped(with({"map", folder / "map.panonav", walk()}, layout));
  EXPECT_TRUE(contains(mapped.err, "2 of 43 images cannot be used and are skipped")) << mapped.err;
  EXPECT_TRUE(contains(mapped.err, "skipped: " + (walk() / "view_020b.png").string()));
  EXPECT_TRUE(contains(mapped.out, "from 41 images")) << mapped.out;
  expect_skipped(with({"home", walk() / view_name(0), walk()}, layout));
  expect_skipped(with({"unwrap", walk(), "-o", folder / "unwrapped"}, layout));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "unwrapped"), {}), 40);
  expect_skipped({"convert", walk(), folder / "walk.mcap"});
  expect_skipped(with({"catchment", walk(), "--ahead", "2"}, layout));
  const auto tried = expect_skipped({"try", walk(), "-o", folder / "tried", "--json"});
  EXPECT_TRUE(contains(tried.out, "\"view_020b.png\"")) << tried.out;
  EXPECT_TRUE(contains(tried.err, "skipped: " + (walk() / "view_020b.png").string()));
  // One image that is named is refused, and nothing is left behind.
  const std::string bad = walk() / "view_007b.png";
  expect_refusal({"localise", memory(), bad}, "view_007b.png");
  expect_refusal(with({"unwrap", bad, "-o", folder / "bad.png"}, layout), "view_007b.png");
  expect_refusal(with({"memorise", folder / "bad.panonav", bad}, layout), "view_007b.png");
  const fs::path only = std::string(folder / "only");
  fs::create_directory(only);
  for (const char* name : {"a.png", "b.png"}) write_file(only / name, std::string_view("no image"));
  expect_refusal(with({"unwrap", only, "-o", folder / "none"}, layout), "a.png");
  for (const char* name : {"bad.png", "bad.panonav", "none"}) {
    EXPECT_FALSE(fs::exists(folder / name)) << name;
  }
}

// Two names that are not UTF-8 stay two, in all outputs, and can be typed as printed or in bytes.
TEST_F(OwnImages, NamesThatAreNotUtf8HaveOneReversibleEscape) {
  const std::string first =
      "K\xFC"
      "che.png";
  const std::string second =
      "K\xE9"
      "che.png";
  fs::rename(walk() / view_name(0), walk() / first);
  fs::rename(walk() / view_name(1), walk() / second);
  fs::rename(walk() / view_name(2), walk() / "K%FCche.png");
  memorise();
  std::vector<std::string> names;
  const json listed = answer_of({"list", memory(), "--json"});
  for (const json& view : listed["views"]) names.push_back(view["name"]);
  for (const char* name : {"K%FCche.png", "K%E9che.png", "K%25FCche.png"}) {
    EXPECT_EQ(std::ranges::count(names, name), 1) << name;
  }
  const std::string table = folder / "answers.csv";
  run_well({"localise", memory(), walk(), "-o", table});
  EXPECT_TRUE(is_utf8(bytes_of(table)));
  EXPECT_TRUE(contains(bytes_of(table), "K%FCche.png,known,"));
  EXPECT_EQ(answer_of({"show", memory(), "K%FCche.png", "--json"})["name"], "K%FCche.png");
  EXPECT_EQ(answer_of({"show", memory(), first, "--json"})["name"], "K%FCche.png");
  // A data set made from the answers, and one made by export, have the same names and files.
  write_file(walk() / "dataset.toml",
             std::string_view("[images]\nkind = \"panorama\"\nelevation_deg = [-20, 20]\n[list]\n"
                              "file = \"images.csv\"\n"));
  write_file(walk() / "images.csv", std::string_view("file\nK%FCche.png\nK%E9che.png\n"));
  const auto again = answers_of({"localise", memory(), walk(), "--json"});
  ASSERT_EQ(again.size(), 2U);
  EXPECT_EQ(again[0]["matches"][0]["file"], "K%FCche.png");
  EXPECT_EQ(again[1]["matches"][0]["file"], "K%E9che.png");
  run_well({"export", memory(), "-o", folder / "exported"});
  EXPECT_TRUE(fs::exists(fs::path(std::string(folder / "exported")) / first));
  EXPECT_TRUE(fs::exists(folder / "exported/K%FCche.png")) << "the file of that name";
  EXPECT_EQ(
      answer_of({"memorise", folder / "copy.panonav", folder / "exported", "--json"})["views"],
      count);
  EXPECT_EQ(answer_of({"show", folder / "copy.panonav", second, "--json"})["name"], "K%E9che.png");
  EXPECT_EQ(answer_of({"rename", memory(), second, "T\xFCr.png", "--json"})["name"], "T%FCr.png");
  EXPECT_EQ(answer_of({"forget", memory(), "T%FCr.png", first, "--json"})["forgotten"], 2);
}

TEST_F(OwnImages, GpanoDataLevelImages) {
  const auto write_jpeg = [&](const std::string& name, double roll_deg,
                              const GpanoProperties& said) {
    const Image picture = take_sphere(0.0, radians(roll_deg));
    write_file(folder / name, insert_xmp(encode_jpeg(picture.view(), 98), make_xmp(said, true)));
  };
  write_jpeg("level.jpg", 0.0, {});
  write_jpeg("rolled.jpg", 20.0, {{"PoseRollDegrees", "20"}});
  const auto unwrap = [&](const std::string& name, const std::vector<std::string>& more) {
    const std::string out = folder / ("of_" + name + ".png");
    const auto result =
        run_panonav(with({"unwrap", folder / name, "--kind", "equirectangular", "-o", out}, more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(contains(result.err, "--ignore-gpano"), name == "rolled.jpg" && more.empty());
    return read_image(out);
  };
  const auto mean_difference = [](const Image& a, const Image& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i) {
      sum += std::abs(a.pixels()[i] - b.pixels()[i]) / static_cast<double>(a.pixels().size());
    }
    return sum;
  };
  const Image level = unwrap("level.jpg", {});
  EXPECT_LT(mean_difference(unwrap("rolled.jpg", {}), level), 1.0);
  EXPECT_GT(mean_difference(unwrap("rolled.jpg", {"--ignore-gpano"}), level), 5.0);
  write_jpeg("sector.jpg", 0.0,
             {{"FullPanoWidthPixels", "1024"},
              {"FullPanoHeightPixels", "512"},
              {"CroppedAreaImageWidthPixels", "512"},
              {"CroppedAreaImageHeightPixels", "256"}});
  expect_refusal(
      {"unwrap", folder / "sector.jpg", "--kind", "equirectangular", "-o", folder / "s.png"},
      "azimuths from -90 to 90 degrees");
  EXPECT_FALSE(fs::exists(folder / "s.png"));
  expect_refusal({"info", folder / "sector.jpg"}, "a sector of 180 degrees");
  fs::create_directory(folder / "sectors");
  fs::rename(folder / "sector.jpg", folder / "sectors" / "a.jpg");
  expect_refusal({"info", folder / "sectors"}, "only a sector");
}

}  // namespace
}  // namespace panonav::testing
