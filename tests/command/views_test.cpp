// Verbs that show, export and rename what a memory holds.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "panonav/pipeline/memoriser.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A memory of a 4 x 4 grid.
class Views : public InTemporaryFolder {
 protected:
  void SetUp() override {
    write_dataset(folder / "grid", world, grid_poses(4));
    // Columns of the pictures fall on columns of panoramas, so that nothing is interpolated.
    std::string toml = bytes_of(folder / "grid" / "dataset.toml");
    toml.replace(toml.find("= 0.5\n"), 5, "= " + to_text(picture_forward_column(96)));
    write_file(folder / "grid" / "dataset.toml", std::string_view(toml));
    run_well({"memorise", memory, folder / "grid"});
  }
  /// The same pictures without positions and thumbnails.
  fs::path bare() const {
    const fs::path run = folder / "bare";
    fs::create_directory(run);
    for (std::size_t i = 0; i < 16; ++i) {
      fs::copy_file(folder / "grid" / view_name(i), run / view_name(i));
    }
    const fs::path file = folder / "bare.panonav";
    run_well({"memorise", file, run, "--kind", "panorama", "--elevation-deg", "-20", "20",
              "--no-thumbnails"});
    return file;
  }
  ToyWorld world = landmark_world(7);
  fs::path memory = folder / "grid.panonav";
};

TEST_F(Views, ListShowsWhatTheFileKnows) {
  const auto table = lines(run_panonav({"list", memory}).out);
  ASSERT_EQ(table.size(), 18U);
  EXPECT_TRUE(contains(table[0], "id  name          x [m]  y [m]  heading [deg]  thumbnail"));
  EXPECT_TRUE(contains(table[6], " 6  view_005.png   0.50   0.50            0.0        yes"));
  EXPECT_EQ(table[17], "16 views");

  const json said = answer_of({"list", memory, "--json"});
  EXPECT_EQ(keys_of(said), (std::set<std::string>{"maps", "memory", "routes", "views"}));
  ASSERT_EQ(said["views"].size(), 16U);
  EXPECT_EQ(said["views"][5],
            json::parse(R"({"id":6,"name":"view_005.png","floor":null,"pose":{"x_m":0.5,"y_m":0.5,
                            "heading_rad":0.0},"stamp_s":null,"links":0,
                            "connected_component":null,"thumbnail":true})"));

  const auto csv = lines(run_panonav({"list", memory, "--csv"}).out);
  ASSERT_EQ(csv.size(), 17U);
  EXPECT_EQ(csv[0], "id,name,x_m,y_m,heading_deg,stamp_s,links,component,thumbnail");
  EXPECT_EQ(csv[6], "6,view_005.png,0.5,0.5,0,,0,,1");
  expect_refusal({"list", memory, "--csv", "--json"}, "--csv and --json");
}

TEST_F(Views, ListOfAMemoryWithoutPositionsHasNoEmptyColumns) {
  const fs::path one = folder / "one.panonav";
  run_well({"memorise", one, folder / "grid" / view_name(1), "--kind", "panorama",
            "--elevation-deg", "-20", "20", "--no-thumbnails"});
  const auto table = lines(run_panonav({"list", one}).out);
  EXPECT_EQ(table.front(), "id  name");
  EXPECT_EQ(table[1], " 1  view_001.png");
}

TEST_F(Views, ListOfAMapOfImagesHasNoMetres) {
  const fs::path memory_of_images = bare();
  const auto table = lines(run_panonav({"list", memory_of_images}).out);
  EXPECT_TRUE(contains(table.front(), "x [view steps]")) << table.front();
  EXPECT_FALSE(contains(table.front(), "[m]"));
  const json said = answer_of({"list", memory_of_images, "--json"});
  EXPECT_TRUE(said["views"][0]["pose"].contains("x_steps"));
  EXPECT_FALSE(said["views"][0]["pose"].contains("x_m"));
  EXPECT_EQ(lines(run_panonav({"list", memory_of_images, "--csv"}).out).front(),
            "id,name,x_steps,y_steps,heading_deg,stamp_s,links,component,thumbnail");
}

TEST_F(Views, ListTakesNamesAndPlaces) {
  const auto near = answer_of({"list", memory, "--near", "0.5,0.5,0.6", "--json"});
  EXPECT_EQ(near["views"].size(), 5U);
  const auto named = answer_of({"list", memory, "--name", "view_01?.png", "--json"});
  EXPECT_EQ(named["views"].size(), 6U);
  EXPECT_EQ(answer_of({"list", memory, "--name", "door*", "--json"}, 1)["views"].size(), 0U);
  for (const char* wrong : {"1,2", "1,2,x", "1,2,-1", "1,2,3,4", ""}) {
    expect_refusal({"list", memory, "--near", wrong}, "--near");
  }
}

TEST_F(Views, ListNamesMapsRoutesAndComponents) {
  const fs::path drive = folder / "drive";
  std::vector<Pose2> poses;
  for (int i = 0; i < 12; ++i) poses.push_back({0.1 * i, 0.0, 0.0});
  write_dataset(drive, world, poses);
  run_well({"map", folder / "map.panonav", drive});
  const json said = answer_of({"list", folder / "map.panonav", "--json"});
  EXPECT_EQ(said["maps"], json::parse(R"(["map"])"));
  EXPECT_EQ(said["views"][3]["connected_component"], 0);
  EXPECT_EQ(said["views"][3]["links"], 2);
  EXPECT_TRUE(contains(run_panonav({"list", folder / "map.panonav"}).out, "12 views; maps: map"));
  const json shown = answer_of({"show", folder / "map.panonav", "4", "--json"});
  ASSERT_EQ(shown["links"].size(), 2U);
  EXPECT_EQ(shown["links"][0]["kind"], "sequence");
  EXPECT_EQ(shown["links"][0]["name"], view_name(2));
  EXPECT_EQ(shown["maps"][0]["map"], "map");
  EXPECT_EQ(shown["maps"][0]["edges"], 2);
}

TEST_F(Views, ShowTellsAllOfAView) {
  const fs::path picture = folder / "six.png";
  const json said = answer_of({"show", memory, "6", "--thumbnail", picture, "--json"});
  EXPECT_EQ(said, answer_of({"show", memory, view_name(5), "--json"}));
  EXPECT_EQ(said["pose"]["x_m"], 0.5);
  EXPECT_EQ(said["signature_bytes"], 2 * 12 * 15);
  EXPECT_EQ(said["thumbnail"]["width_px"], 96);
  ASSERT_EQ(said["similar"].size(), 5U);
  ASSERT_EQ(said["near"].size(), 5U);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(said["near"][static_cast<std::size_t>(i)]["distance_m"], 0.5);
    EXPECT_GE(said["similar"][static_cast<std::size_t>(i + 1)]["dissimilarity"].get<int>(),
              said["similar"][static_cast<std::size_t>(i)]["dissimilarity"].get<int>());
  }
  // Ready-made panoramas of at most 256 columns are kept as they are.
  EXPECT_EQ(read_image(picture), read_image(folder / "grid" / view_name(5)));
  const auto result = run_panonav({"show", memory, "6"});
  EXPECT_TRUE(contains(result.out, "view_005.png, view 6\n"));
  EXPECT_TRUE(contains(result.out, "0.50 m away"));

  expect_refusal({"show", memory, "17"}, "has no view of the name or id '17'");
  expect_refusal({"show", bare(), "1", "-o", folder / "no.png"},
                 "contains no thumbnail of 1; memorise stores thumbnails unless");
  EXPECT_FALSE(fs::exists(folder / "no.png"));
}

TEST_F(Views, GalleryIsOnePageWithAllThumbnails) {
  const fs::path out = folder / "gallery";
  fs::create_directory(out);
  write_file(out / ".gallery.html.tmp", std::string_view("left by a killed gallery"));
  const json said = answer_of({"gallery", memory, "-o", out, "--json"});
  EXPECT_EQ(said["shown"], 16);
  EXPECT_EQ(said["thumbnails"], 16);
  const std::string page = bytes_of(out / "gallery.html");
  EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 1);
  EXPECT_FALSE(contains(page, "<script"));
  EXPECT_FALSE(contains(page, "http"));
  std::size_t pictures = 0;
  for (std::size_t at = 0;
       (at = page.find("src=\"data:image/png;base64,", at)) != std::string::npos; ++at) {
    ++pictures;
  }
  EXPECT_EQ(pictures, 16U);
  for (std::size_t i = 0; i < 16; ++i) EXPECT_TRUE(contains(page, ": " + view_name(i) + ", x "));
  // Squares are listed with their views.
  EXPECT_LT(page.find("x 0 to 2 m, y 0 to 2 m (16 views)"), page.find(view_name(0)));

  const auto replaced = run_panonav({"gallery", memory, "-o", out, "--near", "0,0,0.1"});
  EXPECT_EQ(replaced.exit_code, 0);
  EXPECT_TRUE(contains(replaced.err, "gallery.html: replaced the file that was there"));
  EXPECT_TRUE(contains(bytes_of(out / "gallery.html"), "(1 view)"));
  expect_refusal({"gallery", memory, "-o", folder / "grid"}, "not made by panonav");
  expect_refusal({"gallery", bare(), "-o", folder / "none"},
                 "contains no thumbnails of these 16 views; to get them, memorise");
  EXPECT_FALSE(fs::exists(folder / "none"));
}

TEST_F(Views, GalleryListsThePartsOfAMapByNumber) {
  const fs::path walk = folder / "parts";
  fs::create_directory(walk);
  constexpr std::size_t images = 9;  // of each part
  for (std::size_t part = 0; part < 11; ++part) {
    const ToyWorld place = landmark_world(200 + static_cast<int>(part));
    for (std::size_t i = 0; i < images; ++i) {
      write_picture(walk / view_name(part * images + i), place,
                    {0.1 * static_cast<double>(i), 0.0, 0.0});
    }
  }
  const std::string file = folder / "parts.panonav";
  run_well({"memorise", file, walk, "--kind", "panorama", "--elevation-deg", "-20", "20"});
  run_well({"gallery", file, "-o", folder / "parts_gallery"});
  const std::string page = bytes_of(folder / "parts_gallery" / "gallery.html");
  const std::size_t second = page.find("part 2 of the map");
  const std::size_t tenth = page.find("part 10 of the map");
  ASSERT_NE(tenth, std::string::npos);
  EXPECT_LT(second, tenth);
}

TEST_F(Views, AThumbnailThatIsNoPictureReachesNoPage) {
  {
    auto file = MemoryFile::open(memory, Access::read_write);
    const std::string evil = "<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'/>";
    const ViewId first = file.views().front();
    file.append({.info = {.name = "</figure><script>alert(1)</script>"},
                 .signature = file.load().packed(first),
                 .thumbnail = {evil.begin(), evil.end()}});
  }
  run_well({"gallery", memory, "-o", folder / "gallery"});
  const std::string page = bytes_of(folder / "gallery" / "gallery.html");
  EXPECT_FALSE(contains(page, "<script"));
  EXPECT_FALSE(contains(page, "svg"));
  EXPECT_TRUE(contains(page, "17: &lt;/figure&gt;&lt;script&gt;alert(1)&lt;/script&gt;; no thumb"));
  EXPECT_TRUE(contains(page, ": position not known (1 view)</h2>"));
  EXPECT_EQ(answer_of({"show", memory, "17", "--json"})["thumbnail"]["width_px"], 0);
  expect_refusal({"show", memory, "17", "-o", folder / "x.png"}, "thumbnail");
  const json said = answer_of({"export", memory, "-o", folder / "out", "--json"});
  EXPECT_EQ(said["views"], 17);
  EXPECT_EQ(said["images"], 16);
  EXPECT_TRUE(contains(run_panonav({"export", memory, "-o", folder / "other"}).out,
                       "1 view without a thumbnail left out of the data set."));
}

TEST_F(Views, ExportMemorisedAgainIsTheSameMemory) {
  const fs::path out = folder / "out";
  const fs::path again = folder / "again.panonav";
  const json said = answer_of({"export", memory, "-o", out, "--json"});
  EXPECT_EQ(said["views"], 16);
  EXPECT_EQ(said["images"], 16);
  EXPECT_EQ(said["enlarged"], false);
  const std::vector<std::string> back{"memorise", again, out, "--config", out / "memorise.toml",
                                      "--json"};
  EXPECT_EQ(answer_of(back)["appended"], 16);
  EXPECT_EQ(answer_of(back)["known_before"], 16) << "going on";
  EXPECT_EQ(answer_of({"list", memory, "--json"})["views"],
            answer_of({"list", again, "--json"})["views"]);
  // Nothing was lost on the way, so the answers are the same to the bit.
  EXPECT_TRUE(answers_of({"localise", memory, folder / "grid", "--json"}) ==
              answers_of({"localise", again, folder / "grid", "--json"}));
  expect_refusal({"export", memory, "-o", out}, "already exists and is not empty");
  fs::create_directory(folder / "empty");
  run_well({"export", memory, "-o", folder / "empty"});
  EXPECT_TRUE(fs::exists(folder / "empty" / "dataset.toml"));
}

TEST_F(Views, ExportOfLargePanoramasFindsTheSameViews) {
  const fs::path run = folder / "wide";
  write_dataset(run, world, grid_poses(4));
  for (std::size_t i = 0; i < 16; ++i) {
    write_picture(run / view_name(i), world, grid_poses(4)[i], 512, 40);
  }
  run_well({"memorise", folder / "wide.panonav", run, "--remove-mean", "false"});
  const fs::path out = folder / "out";
  const json said = answer_of({"export", folder / "wide.panonav", "-o", out, "--json"});
  EXPECT_EQ(said["enlarged"], true);
  EXPECT_EQ(read_image_size(out / view_name(0)), read_image_size(run / view_name(0)));
  const fs::path again = folder / "again.panonav";
  run_well({"memorise", again, out, "--config", out / "memorise.toml"});
  const json before = answer_of({"info", folder / "wide.panonav", "--json"});
  const json after = answer_of({"info", again, "--json"});
  for (const char* key : {"rows", "components", "panorama_columns", "preprocessing"}) {
    EXPECT_EQ(after[key], before[key]) << key;
  }
  for (const auto& answer :
       answers_of({"localise", again, run, "--turn-randomly", "3", "--json"})) {
    EXPECT_TRUE(answer["known"].get<bool>());
    EXPECT_EQ(answer["matches"][0]["file"], answer["file"]);
    EXPECT_NEAR(angle_difference(answer["matches"][0]["heading_rad"], answer["turned_rad"]), 0.0,
                radians(0.5));
  }
}

TEST_F(Views, APageIsNoFolder) {
  expect_refusal({"gallery", memory, "-o", folder / "views.html"}, "allowed: a folder");
  EXPECT_FALSE(fs::exists(folder / "views.html"));
}

TEST_F(Views, ExportWithoutThumbnailsSaysThatNothingComesBack) {
  const fs::path out = folder / "out";
  const auto result = run_panonav({"export", bare(), "-o", out});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(
      contains(result.out, "the memory has no thumbnails. memorise cannot read this folder."));
  EXPECT_FALSE(fs::exists(out / "dataset.toml"));
  const std::string array = bytes_of(out / "signatures.npy");
  EXPECT_TRUE(contains(array, "'shape': (16, 2, 15, 12)"));
  EXPECT_EQ(array.size() % 64, (16U * 2 * 15 * 12) % 64);
  EXPECT_EQ(lines(bytes_of(out / "views.csv")).size(), 17U);
}

TEST_F(Views, RenameIsOneChangeThatCanBeUndone) {
  const json before = answer_of({"list", memory, "--json"});
  const json said = answer_of({"rename", memory, "6", "door", "--json"});
  EXPECT_EQ(said["former"], view_name(5));
  json after = before;
  after["views"][5]["name"] = "door";
  EXPECT_EQ(answer_of({"list", memory, "--json"}), after);
  run_well({"verify", memory});
  EXPECT_TRUE(contains(run_panonav({"undo", memory, "--dry-run"}).out,
                       "rename: view view_005.png to door"));
  run_well({"undo", memory});
  EXPECT_EQ(answer_of({"list", memory, "--json"}), before);

  const std::string held = bytes_of(memory);
  expect_refusal({"rename", memory, "nobody", "x"}, "no view of the name or id");
  expect_refusal({"rename", memory, "6", view_name(4)}, "already contains");
  expect_refusal({"rename", memory, "6", ""}, "view name is empty");
  expect_refusal({"rename", memory, "6", "a\nb"}, "control characters");
  expect_refusal({"rename", memory, "6", std::string(5000, 'x')}, "5000 bytes");
  expect_refusal({"rename", memory, "way", "x", "--route"}, "a route of the memory");
  EXPECT_EQ(answer_of({"list", memory, "--json"}), before);
}

TEST_F(Views, ARenamedRouteIsFollowedAndComesBack) {
  std::vector<Pose2> poses;
  for (int i = 0; i < 30; ++i) poses.push_back({0.1 * i, 0.0, 0.0});
  write_dataset(folder / "drive", world, poses);
  run_well({"route", "record", memory, folder / "drive", "--half-band-rad", "0.1"});
  const auto follow = [&](const std::string& name) {
    return answers_of({"route", "follow", memory, folder / "drive", "--name", name, "--json"});
  };
  const auto before = follow("route");
  run_well({"rename", memory, "route", "to the lab", "--route"});
  EXPECT_EQ(follow("to the lab"), before);
  EXPECT_EQ(answer_of({"info", memory, "--json"})["routes"].size(), 1U);
  run_well({"verify", memory});
  run_well({"undo", memory});
  EXPECT_EQ(follow("route"), before);
}

TEST_F(Views, FloorsAreFramesOfTheirOwn) {
  const std::string building = folder / "building.panonav";
  const std::string grid = folder / "grid";
  const std::string first = folder / "first";
  write_dataset(first, landmark_world(6), grid_poses(4));
  run_well({"memorise", building, grid, "--floor", "ground"});
  run_well({"memorise", building, first, "--floor", "first"});
  run_well({"memorise", building, first, "--floor", "first"});
  const json info = answer_of({"info", building, "--json"});
  EXPECT_EQ(info["views"], 32);
  EXPECT_EQ(info["floors"], (json{{"first", 16}, {"ground", 16}}));
  EXPECT_TRUE(contains(run_panonav({"info", building}).out, "floor       ground, 16 views"));
  EXPECT_EQ(answer_of({"list", building, "--json"})["views"][20]["floor"], "first");
  EXPECT_EQ(run_panonav({"verify", building}).exit_code, 0);

  for (const auto& [input, floor] : {std::pair(grid, "ground"), std::pair(first, "first")}) {
    const auto run = run_panonav({"localise", building, input, "--json"});
    for (const std::string& line : lines(run.out)) {
      const auto place = json::parse(line);
      EXPECT_EQ(place["floor"], floor) << line;
    }
    const auto text = run_panonav({"localise", building, input + "/" + view_name(5)});
    EXPECT_TRUE(contains(text.out, "floor " + std::string(floor) + "  x 0.5")) << text.out;
  }

  // A copy of the data set has the floors, too.
  const std::string copy = folder / "copy";
  const std::string again = folder / "again.panonav";
  run_well({"export", building, "--out", copy});
  run_well({"memorise", again, copy});
  EXPECT_EQ(answer_of({"info", again, "--json"})["floors"], info["floors"]);

  const auto refused = run_panonav({"memorise", building, first, "--floor", "a/b"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(contains(refused.err, "floor is \"a/b\"")) << refused.err;
}

}  // namespace
}  // namespace panonav::testing
