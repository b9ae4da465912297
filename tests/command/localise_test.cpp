#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

/// A memory of a 5 x 5 grid, made once for all tests of this file.
class Localise : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    world_ = landmark_world(7);
    write_dataset(*folder_ / "grid", *world_, grid_poses(5));
    Random random(3);
    std::vector<Pose2> query_poses;
    for (int i = 0; i < 20; ++i) {
      query_poses.push_back({random.uniform(0.0, 2.0), random.uniform(0.0, 2.0),
                             random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
    query_poses_ = query_poses;
    write_dataset(*folder_ / "queries", *world_, query_poses);
    run_well({"memorise", memory(), *folder_ / "grid"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string memory() { return *folder_ / "grid.panonav"; }
  static std::string grid() { return *folder_ / "grid"; }
  static std::string queries() { return *folder_ / "queries"; }

  static std::vector<json> answers(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "localise");
    arguments.push_back("--json");
    return answers_of(arguments);
  }

  inline static std::optional<TemporaryFolder> folder_;
  inline static std::optional<ToyWorld> world_;
  inline static std::optional<std::vector<Pose2>> query_poses_;
};

TEST_F(Localise, UpdatesWhatHasChangedAndUndoTakesItBack) {
  const std::string file = *folder_ / "updated.panonav";
  std::filesystem::copy_file(memory(), file);
  const ToyWorld changed = landmark_world(11);
  std::vector<Pose2> drive;
  for (int i = 0; i < 17; ++i) drive.push_back({0.125 * i, 1.05, 0.0});
  write_dataset(*folder_ / "drive", *world_, drive);
  std::string csv = "file,odom_x_m,odom_y_m,odom_heading_deg\n";
  for (std::size_t i = 0; i < drive.size(); ++i) {
    if (i >= 7 && i < 11) write_picture(*folder_ / "drive" / view_name(i), changed, drive[i]);
    csv += view_name(i) + "," + to_text(-drive[i].y_m) + "," + to_text(drive[i].x_m) + ",90\n";
  }
  write_file(*folder_ / "drive" / "poses.csv", std::string_view(csv));
  const std::string drive_folder = *folder_ / "drive";
  const auto views = [&] { return answers_of({"list", file, "--json"}).at(0).at("views").size(); };
  const auto changes = [&] { return answers_of({"history", file, "--json"}).at(0).at("changes"); };
  const std::size_t before = views();
  EXPECT_TRUE(changes().empty());
  run_well({"localise", file, drive_folder, "--update"});
  EXPECT_GT(views(), before);
  ASSERT_EQ(changes().size(), 1U);
  EXPECT_TRUE(changes()[0].at("undoable"));
  run_well({"undo", file});
  EXPECT_EQ(views(), before);
  EXPECT_TRUE(changes().empty());

  // A run that changes nothing says why: in another place no image is localised; one image alone
  // has no witness.
  write_dataset(*folder_ / "away", landmark_world(99), drive);
  write_file(*folder_ / "away" / "poses.csv", std::string_view(csv));
  const auto away = run_panonav({"localise", file, *folder_ / "away", "--update"});
  EXPECT_TRUE(contains(away.err, "no view of " + file + " was updated: ")) << away.err;
  EXPECT_TRUE(contains(away.err, "no image was localised with a probability")) << away.err;
  write_dataset(*folder_ / "alone", *world_, {drive.front()});
  write_file(*folder_ / "alone" / "poses.csv",
             std::string_view(csv.substr(0, csv.find(view_name(1)))));
  const auto alone = run_panonav({"localise", file, *folder_ / "alone", "--update"});
  EXPECT_TRUE(contains(alone.err, "at least three other images")) << alone.err;
  EXPECT_TRUE(changes().empty());

  const auto refused = [&](const std::vector<std::string>& more, std::string_view part) {
    std::vector<std::string> arguments{"localise", file};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = run_panonav(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  };
  refused({drive_folder, "--appearances", "2"}, "without --update");
  refused({drive_folder, "--update", "--turn-randomly", "1"}, "with --add, --update");
  refused({drive_folder + "/" + view_name(0), drive_folder + "/" + view_name(1), "--update"},
          "one recording");
}

TEST_F(Localise, TheLibraryGivesTheCommandsAnswerToTheBit) {
  const PlaceRecogniser recogniser(memory());
  const auto reported = answers({memory(), queries()});
  int known = 0;
  for (std::size_t i = 0; i < reported.size(); ++i) {
    const auto file = std::filesystem::path(queries()) / view_name(i);
    const Place place = recogniser.localise(read_image(file));
    EXPECT_EQ(place.known, reported[i]["known"].get<bool>());
    EXPECT_EQ(place.known_probability, reported[i]["known_probability"].get<double>());
    ASSERT_EQ(place.matches.size(), reported[i]["matches"].size());
    for (std::size_t m = 0; m < place.matches.size(); ++m) {
      EXPECT_EQ(place.matches[m].name, reported[i]["matches"][m]["file"]);
      EXPECT_EQ(place.matches[m].column_difference,
                reported[i]["matches"][m]["column_difference"].get<double>());
    }
    EXPECT_EQ(place.bytes_read, reported[i]["bytes_read"].get<std::uint64_t>());
    if (!place.known) continue;
    ++known;
    EXPECT_EQ(place.position->x_m, reported[i]["position"]["x_m"].get<double>());
    EXPECT_EQ(place.position->y_m, reported[i]["position"]["y_m"].get<double>());
    EXPECT_EQ(place.heading_rad.value(), reported[i]["heading_rad"].get<double>());
  }
  EXPECT_GT(known, 10);
}

TEST_F(Localise, JsonLinesHaveExactlyTheDocumentedFields) {
  const auto all = answers({memory(), queries()});
  ASSERT_EQ(all.size(), 20U);
  for (const auto& answer : all) {
    EXPECT_EQ(keys_of(answer),
              (std::set<std::string>{"alternatives", "bytes_read", "components", "file", "floor",
                                     "heading_rad", "known", "known_probability", "matches",
                                     "position", "probability", "turned_rad"}));
    double shared = answer["probability"];
    for (const auto& other : answer["alternatives"]) {
      EXPECT_EQ(keys_of(other), (std::set<std::string>{"floor", "heading_rad", "match", "position",
                                                       "probability"}));
      shared += other["probability"].get<double>();
    }
    EXPECT_LE(shared, answer["known_probability"].get<double>() + 1e-9);
    EXPECT_GE(shared, 0.8 * answer["known_probability"].get<double>());
    if (!answer["position"].is_null()) {
      EXPECT_EQ(keys_of(answer["position"]),
                (std::set<std::string>{"along_route", "radius_m", "x_m", "y_m"}));
    }
    EXPECT_TRUE(answer["known"].is_boolean());
    EXPECT_TRUE(answer["components"].is_number_integer());
    EXPECT_TRUE(answer["bytes_read"].is_number_unsigned());
    EXPECT_EQ(answer["turned_rad"].get<double>(), 0.0);
    ASSERT_FALSE(answer["matches"].empty());
    for (const auto& match : answer["matches"]) {
      EXPECT_EQ(match.size(), match.contains("verified_features") ? 5U : 4U);
      EXPECT_TRUE(match.at("file").is_string());
      EXPECT_TRUE(match.at("dissimilarity").is_number());
      EXPECT_TRUE(match.at("column_difference").is_number());
      EXPECT_TRUE(match.at("heading_rad").is_number() || match.at("heading_rad").is_null());
    }
    if (!answer["position"].is_null()) {
      EXPECT_EQ(answer["position"].size(), 4U);
      EXPECT_TRUE(answer["position"].at("along_route").is_null()) << "the views form a grid";
      const json& radius_m = answer["position"].at("radius_m");
      EXPECT_TRUE(radius_m.is_null() || radius_m.get<double>() > 0.0);
    }
  }
}

TEST_F(Localise, FindsPlaceAndHeadingOfPosesBetweenTheReferences) {
  const auto all = answers({memory(), queries()});
  ASSERT_EQ(all.size(), query_poses_->size());
  int near = 0;
  int heading_right = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i]["file"], view_name(i));
    if (all[i]["position"].is_null()) continue;
    const Point2 found{all[i]["position"]["x_m"], all[i]["position"]["y_m"]};
    near += distance(found, (*query_poses_)[i].position()) <= 0.5 ? 1 : 0;
    if (!all[i]["heading_rad"].is_null()) {
      const double error = angle_difference(all[i]["heading_rad"], (*query_poses_)[i].heading_rad);
      heading_right += std::abs(error) <= radians(15.0) ? 1 : 0;
    }
  }
  EXPECT_GE(near, 18);
  EXPECT_GE(heading_right, 18);
}

TEST_F(Localise, TurnedByWholeColumnsEveryViewFindsItselfAndItsTurn) {
  const auto all = answers({memory(), grid(), "--turn-randomly", "11"});
  ASSERT_EQ(all.size(), 25U);
  int turned = 0;
  for (const auto& answer : all) {
    const auto& best = answer["matches"][0];
    EXPECT_EQ(best["file"], answer["file"]);
    EXPECT_EQ(best["dissimilarity"], 0);
    // The robot turned by +turned_rad, so its heading relative to the reference grew by that much.
    const double turn_rad = answer["turned_rad"];
    EXPECT_NEAR(angle_difference(best["heading_rad"], turn_rad), 0.0, radians(2.0));
    const double columns = turn_rad * 96.0 / (2.0 * std::numbers::pi);
    EXPECT_NEAR(columns, std::round(columns), 1e-9);
    turned += std::abs(turn_rad) > 0.1 ? 1 : 0;
  }
  EXPECT_GE(turned, 15);
  EXPECT_EQ(answers({memory(), grid(), "--turn-randomly", "11"}), all);
  EXPECT_NE(answers({memory(), grid(), "--turn-randomly", "12"}), all);
}

TEST_F(Localise, ExcludeSameFileLeavesOnlyThatViewOut) {
  const auto all = answers({memory(), grid(), "--exclude-same-file", "--top", "24"});
  for (const auto& answer : all) {
    EXPECT_EQ(answer["matches"].size(), 24U);
    for (const auto& match : answer["matches"]) EXPECT_NE(match["file"], answer["file"]);
  }
}

TEST_F(Localise, ComponentsAndTopAreObeyed) {
  const auto all = answers({memory(), queries(), "--components", "3", "--top", "2"});
  for (const auto& answer : all) {
    EXPECT_EQ(answer["matches"].size(), 2U);
    EXPECT_EQ(answer["components"], 3);
  }
}

TEST_F(Localise, AnswersDoNotDependOnTheNumberOfThreads) {
  const auto one = run_panonav({"localise", memory(), queries(), "--json", "--threads", "1"});
  const auto three = run_panonav({"localise", memory(), queries(), "--json", "--threads", "3"});
  EXPECT_EQ(one.exit_code, 0);
  EXPECT_FALSE(one.out.empty());
  EXPECT_EQ(one.out, three.out);
}

TEST_F(Localise, AnotherWorldIsUnknownAndExitCodeSaysSo) {
  write_dataset(*folder_ / "elsewhere", landmark_world(1234), grid_poses(4));
  const auto result = run_panonav({"localise", memory(), *folder_ / "elsewhere", "--json"});
  const auto said = lines(result.out);
  ASSERT_EQ(said.size(), 16U);
  int known = 0;
  for (const auto& line : said) {
    const auto answer = json::parse(line);
    known += answer["known"].get<bool>() ? 1 : 0;
    EXPECT_FALSE(answer["matches"].empty());
    if (!answer["known"].get<bool>()) {
      EXPECT_TRUE(answer["position"].is_null());
      EXPECT_TRUE(answer["heading_rad"].is_null());
    }
  }
  EXPECT_LE(known, 1);
  EXPECT_EQ(result.exit_code, known == 0 ? 1 : 0);
}

TEST_F(Localise, OneImageAsksToo) {
  const auto all = answers({memory(), (std::filesystem::path(queries()) / view_name(3)).string()});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0]["file"], view_name(3));
  EXPECT_EQ(all[0]["matches"], answers({memory(), queries()})[3]["matches"]);
}

TEST_F(Localise, SeveralPicturesAndATable) {
  const std::filesystem::path folder = queries();
  const std::string gone = folder / "gone.png";
  const std::string broken = *folder_ / "a, \"broken\".png";
  std::ofstream(broken) << "no image";
  const std::string table = *folder_ / "answers.csv";
  const std::vector<std::string> pictures{gone, folder / view_name(3), broken,
                                          folder / view_name(7)};
  const auto result =
      run_panonav(with(with({"localise", memory()}, pictures), {"-o", table, "--json"}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(lines(result.err).size(), 2U) << result.err;
  EXPECT_TRUE(contains(result.err, "skipped: " + gone));
  EXPECT_TRUE(contains(result.err, "skipped: " + broken));
  const auto said = lines(result.out);
  ASSERT_EQ(said.size(), 4U);
  EXPECT_EQ(keys_of(json::parse(said[0])), (std::set<std::string>{"error", "file"}));
  const json one = answers({memory(), pictures[1]})[0];
  EXPECT_EQ(json::parse(said[1])["matches"], one["matches"]);
  const auto rows = lines(bytes_of(table));
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[0],
            "file,answer,known_probability,x_m,y_m,radius_m,along_route_m,heading_deg,best,"
            "dissimilarity,column_difference,turn_deg,next,next_dissimilarity,next_column_"
            "difference,probability,alternative,alternative_probability,error");
  EXPECT_EQ(rows[1].find(gone + ",unreadable,,,,,,,,,,,,,,,,,"), 0U) << rows[1];
  EXPECT_EQ(rows[2].find(pictures[1] + ",known," + format_fixed(one["known_probability"], 4) + "," +
                         to_text(one["position"]["x_m"].get<double>())),
            0U)
      << rows[2];
  EXPECT_TRUE(contains(rows[2], "," + one["matches"][1]["file"].get<std::string>() + ","));
  EXPECT_TRUE(contains(rows[3], "\"\"broken\"\".png\",unreadable"));

  expect_refusal({"localise", memory(), gone, broken}, gone);
  expect_refusal({"localise", memory(), gone, queries()}, "is a folder");
}

TEST_F(Localise, RunsInOrderKeepImagesThatCannotBeRead) {
  const std::filesystem::path data = *folder_ / "in_order";
  write_dataset(data, *world_, grid_poses(2));
  std::ofstream(data / view_name(1)) << "no image";
  const std::string table = *folder_ / "in_order.csv";
  const std::vector<std::string> in_order{"localise", memory(), data, "--record",
                                          *folder_ / "in_order.mcap"};
  const auto result = run_panonav(with(in_order, {"--json", "-o", table}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto said = lines(result.out);
  ASSERT_EQ(said.size(), 4U);
  EXPECT_EQ(keys_of(json::parse(said[1])), (std::set<std::string>{"error", "file"}));
  EXPECT_EQ(json::parse(said[1])["file"], view_name(1));
  EXPECT_EQ(lines(bytes_of(table))[2].find(view_name(1) + ",unreadable,"), 0U);
  for (std::size_t i = 0; i < 4; ++i) std::ofstream(data / view_name(i)) << "no image";
  const auto none = run_panonav(with(in_order, {"--json"}));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_TRUE(contains(none.err, view_name(0)));
}

TEST_F(Localise, ABoundIsNeverRoundedToZero) {
  const std::string data = *folder_ / "tiny";
  write_dataset(data, *world_, grid_poses(6));
  std::string csv = "file,x_m,y_m,heading_deg\n";  // of a place of a few millimetres
  for (std::size_t i = 0; i < 36; ++i) {
    csv += view_name(i) + "," + to_text(0.0005 * static_cast<double>(i / 6)) + "," +
           to_text(0.0005 * static_cast<double>(i % 6)) + ",0\n";
  }
  write_file(*folder_ / "tiny" / "poses.csv", std::string_view(csv));
  run_well({"memorise", *folder_ / "tiny.panonav", data});
  const auto result = run_panonav({"localise", *folder_ / "tiny.panonav", data});
  EXPECT_TRUE(contains(result.out, "within 0.01 m")) << result.out;
  EXPECT_FALSE(contains(result.out, "within 0.00")) << result.out;
}

TEST_F(Localise, ANewMemoryHasNothingToReport) {
  const std::filesystem::path data = *folder_ / "few";
  const std::filesystem::path report = *folder_ / "few_report";
  write_dataset(data, *world_, grid_poses(2));
  const auto result =
      run_panonav({"localise", *folder_ / "few.panonav", data, "--add", "--report", report});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.err, "no report"));
  EXPECT_FALSE(std::filesystem::exists(report / "index.html"));
}

TEST_F(Localise, TheReportShowsEachPictureAboveItsBestMatch) {
  const std::filesystem::path report = *folder_ / "report";
  run_well({"localise", memory(), queries(), "--report", report, "--turn-randomly", "5"});
  const std::string page = bytes_of(report / "index.html");
  (void)text_of_page(page);
  const auto panels = panels_of(page);
  ASSERT_EQ(panels.size(), 1U);
  const json& run = panels[0].data;
  const auto reported = answers({memory(), queries(), "--turn-randomly", "5"});
  ASSERT_EQ(run["moments"].size(), reported.size());
  std::size_t known = 0;
  for (std::size_t i = 0; i < reported.size(); ++i) {
    const json& best = reported[i]["matches"][0];
    const bool is_known = reported[i]["known"];
    known += is_known ? 1 : 0;
    const std::string title =
        view_name(i) + ": " +
        (is_known ? "near the stored view " + best["file"].get<std::string>() : "unknown place");
    const json& shown = run["moments"][i];
    EXPECT_EQ(shown["values"]["image"].get<std::string>() + ": " +
                  shown["values"]["answer"].get<std::string>(),
              title);
    EXPECT_TRUE(shown["values"]["difference from the best match"].get<std::string>().starts_with(
        format_fixed(best["column_difference"], 3)));
    const auto decoded = [&](const char* which) {
      return decode_image(bytes_of_url(shown["data"][which].get<std::string>()), which);
    };
    const Image seen = decoded("panorama");
    const Image match = decoded("best");
    ASSERT_EQ(match.width(), seen.width());
    ASSERT_EQ(match.height(), seen.height());
    if (!is_known) continue;
    // Turned alike, both show the same things: as no other turn does.
    const int turn = static_cast<int>(
        std::lround(shown["turn"].get<double>() / (2.0 * std::numbers::pi) * seen.width()));
    const auto difference = [&](int turned) {
      double sum = 0.0;
      for (int v = 0; v < seen.height(); ++v) {
        for (int u = 0; u < seen.width(); ++u) {
          sum += std::abs(seen.at(u, v, 0) -
                          match.at((u - turn + turned + 2 * seen.width()) % seen.width(), v, 0));
        }
      }
      return sum;
    };
    for (const double share : {0.15, 0.3, 0.5, 0.7, 0.85}) {
      EXPECT_LT(difference(0), difference(static_cast<int>(share * seen.width())));
    }
  }
  EXPECT_GT(known, 10U);
  EXPECT_TRUE(contains(page, "<b>" + std::to_string(known) + " of 20</b>"));

  // A memory that keeps no thumbnails.
  run_well({"memorise", *folder_ / "bare.panonav", grid(), "--no-thumbnails"});
  run_well({"localise", *folder_ / "bare.panonav", grid(), "--report", report});
  const std::string bare = bytes_of(report / "index.html");
  EXPECT_TRUE(contains(bare, "no thumbnail of the best match"));
  EXPECT_EQ(panels_of(bare)[0].data["moments"].size(), 25U);
}

TEST_F(Localise, TextForPeopleNamesEachImage) {
  const auto result = run_panonav({"localise", memory(), queries()});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(contains(result.out, view_name(0)));
  EXPECT_EQ(result.out.find('\033'), std::string::npos) << "colours in a pipe";
}

TEST_F(Localise, WrongArgumentsAreRefused) {
  expect_refusal({"localise", memory(), queries(), "--components", "0"}, "components");
  expect_refusal({"localise", memory(), queries(), "--components", "400"}, "components");
  expect_refusal({"localise", memory(), queries(), "--top", "0"}, "top");
  expect_refusal({"localise", *folder_ / "nothing.panonav", queries()}, "nothing.panonav");
  expect_refusal({"localise", memory(), *folder_ / "nowhere"}, "nowhere");
  expect_refusal({"localise", memory()}, "INPUT");
}

TEST_F(Localise, BadQueriesAreNamed) {
  const std::filesystem::path data = *folder_ / "bad";
  const auto table = [&](const std::string& rows) {
    std::ofstream(data / "poses.csv") << "file,x_m,y_m,heading_deg\n" << rows;
  };
  const auto refused = [&](const std::vector<std::string>& words) {
    const auto line = refusal({"localise", memory(), data});
    for (const auto& word : words) EXPECT_TRUE(contains(line, word));
  };
  write_dataset(data, *world_, grid_poses(2));
  run_well({"localise", memory(), data});
  table("view_000.png,0,nan,0\n");
  refused({"poses.csv", "y_m", "nan"});
  table("view_000.png,0,0\n");
  refused({"poses.csv"});
  table("view_000.png,0,0,0\nview_000.png,1,0,0\n");
  refused({"poses.csv", "view_000.png"});
  table("");
  refused({"poses.csv"});
  table("gone.png,0,0,0\n");
  refused({"gone.png"});
  table("view_000.png,0,0,0\n");
  std::ofstream(data / view_name(0)) << "no image";
  refused({view_name(0)});
}

TEST_F(Localise, AreasShrinkAndAreListedComponentByComponent) {
  for (const auto& answer : answers({memory(), queries(), "--areas"})) {
    const auto& areas = answer.at("areas");
    ASSERT_EQ(areas.size(), 15U);
    for (std::size_t i = 0; i < areas.size(); ++i) {
      EXPECT_EQ(areas[i].size(), 5U);
      EXPECT_EQ(areas[i]["components"], i + 1);
      EXPECT_GE(areas[i]["candidates"].get<int>(), 1);
      EXPECT_GT(areas[i]["area_m2"].get<double>(), 0.0);
      if (i == 0) continue;
      EXPECT_LE(areas[i]["candidates"], areas[i - 1]["candidates"]);
      EXPECT_LE(areas[i]["area_m2"].get<double>(), areas[i - 1]["area_m2"].get<double>() + 1e-9);
      EXPECT_LE(areas[i]["radius_m"].get<double>(), areas[i - 1]["radius_m"].get<double>() + 1e-9);
      EXPECT_GE(areas[i]["bytes_read"], areas[i - 1]["bytes_read"]);
    }
  }
  // Stopping at an accuracy, and a memory without positions.
  const auto coarse = answers({memory(), queries(), "--areas", "--area-components", "2"});
  EXPECT_EQ(coarse.front()["areas"].size(), 2U);
  const std::string plain = *folder_ / "plain.panonav";
  std::filesystem::create_directory(*folder_ / "plain");
  for (const int i : {0, 7, 13}) {  // unrelated worlds, which no map connects
    write_picture(*folder_ / "plain" / view_name(static_cast<std::size_t>(i)),
                  landmark_world(100 + i), {});
  }
  run_well({"memorise", plain, *folder_ / "plain", "--kind", "panorama", "--elevation-deg", "-20",
            "20"});
  const auto result = run_panonav({"localise", plain, *folder_ / "plain", "--areas", "--json"});
  EXPECT_LE(result.exit_code, 1) << result.err;
  const auto first = json::parse(lines(result.out).at(0));
  EXPECT_TRUE(first["areas"][0]["area_m2"].is_null());
  EXPECT_TRUE(first["areas"][0]["radius_m"].is_null());
  EXPECT_TRUE(first["position"].is_null());
  EXPECT_TRUE(first["heading_rad"].is_null());
}

TEST_F(Localise, ViewsOfAnotherSizeAreRefused) {
  write_dataset(*folder_ / "small", *world_, grid_poses(2));
  for (int i = 0; i < 4; ++i) {
    write_picture(*folder_ / "small" / view_name(static_cast<std::size_t>(i)), *world_,
                  {0.5 * i, 0.0, 0.0}, 96, 10);
  }
  const auto line = refusal({"localise", memory(), *folder_ / "small"});
  EXPECT_TRUE(contains(line, "view_000.png"));
  EXPECT_TRUE(contains(line, "12"));
}

}  // namespace
}  // namespace panonav::testing
