// Videos and streams as input, and `localise --add`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command/walk.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/recorded_messages.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void expect_same_signatures(const VisualMemory& a, const VisualMemory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.packed(a.views()[i]), b.packed(b.views()[i])) << i;
  }
}

TEST_F(Walk, AVideoGivesTheMemoryAndTheAnswersOfItsPictures) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  run_well(with({"memorise", path("b.panonav"), path("walk.mp4")}, panoramas_));
  expect_same_signatures(views(path("a.panonav")), views(path("b.panonav")));
  const auto by_folder = answers_of({"localise", path("a.panonav"), path("walk"), "--json"});
  const auto by_video = answers_of({"localise", path("a.panonav"), path("walk.mp4"), "--json"});
  ASSERT_EQ(by_folder.size(), by_video.size());
  for (std::size_t i = 0; i < by_folder.size(); ++i) {
    EXPECT_EQ(by_folder[i].at("matches"), by_video[i].at("matches"));
    EXPECT_EQ(by_folder[i].at("position"), by_video[i].at("position"));
  }
  // The same again knows every view.
  const json again =
      answer_of(with({"memorise", path("b.panonav"), path("walk.mp4"), "--json"}, {}));
  EXPECT_EQ(again.at("known_before"), count);
}

TEST_F(Walk, InfoSaysWhatIsInAVideo) {
  const json info = answer_of({"info", path("walk.mp4"), "--json"});
  EXPECT_EQ(info.at("images"), count);
  EXPECT_EQ(info.at("width"), 96);
  EXPECT_EQ(info.at("height"), 12);
  EXPECT_NEAR(info.at("end_s").get<double>(), 3.5, 1e-3);
}

TEST_F(Walk, PartsOfAVideoAreTaken) {
  const auto names = [&](const std::vector<std::string>& part) {
    std::vector<std::string> found;
    run_well({"memorise", path("a.panonav"), path("walk")});
    for (const auto& answer :
         answers_of(with({"localise", path("a.panonav"), path("walk.mp4"), "--json"}, part))) {
      found.push_back(answer.at("matches").at(0).at("file"));
    }
    return found;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names({"--every", "1s"}),
            (Names{view_name(0), view_name(10), view_name(20), view_name(30)}));
  EXPECT_EQ(names({"--from", "0.5", "--to", "0.7"}),
            (Names{view_name(5), view_name(6), view_name(7)}));
  EXPECT_EQ(names({"--every", "20"}), (Names{view_name(0), view_name(20)}));
  const std::vector<std::string> ask{"localise", path("a.panonav"), path("walk.mp4")};
  expect_refusal(with(ask, {"--every", "0"}), "--every is 0");
  expect_refusal(with(ask, {"--every", "-1s"}), "--every is -1s");
  expect_refusal(with(ask, {"--from", "60"}), "no image in the requested time");
  expect_refusal({"localise", path("a.panonav"), path("walk"), "--to", "1"}, "stamp_s");
  expect_refusal({"localise", path("a.panonav"), path("walk/view_000.png"), "--every", "2"},
                 "one image");
  expect_refusal({"memorise", path("c.panonav"), path("walk.mp4")}, "--kind");
  expect_refusal(with({"catchment", path("walk.mp4")}, panoramas_),
                 "a recording of topics needs poses");
  expect_refusal(
      with({"route", "record", path("c.panonav"), path("walk.mp4"), "--odometry"}, panoramas_),
      "has no odometry");
}

TEST_F(Walk, StandardInputGivesTheMemoryOfItsPictures) {
  run_well(with({"memorise", path("a.panonav"), path("jpegs")}, panoramas_));
  const std::string command =
      quote_for_shell(PANONAV_COMMAND) + " memorise " + quote_for_shell(path("b.panonav")) +
      " - --json --kind panorama --elevation-deg -20 20 < " + quote_for_shell(path("walk.mjpeg"));
  EXPECT_EQ(json::parse(said_by_shell(command, folder.path())).at("appended"), count);
  expect_same_signatures(views(path("a.panonav")), views(path("b.panonav")));
}

TEST_F(Walk, PicturesOnStandardInputAreAnsweredAndTrackedAsTheyCome) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  const std::string command = " < " + quote_for_shell(path("walk.mjpeg")) + " 2> /dev/null";
  const auto answers = objects(said_by_shell(
      quote_for_shell(PANONAV_COMMAND) + " localise " + quote_for_shell(path("a.panonav")) +
          " - --json -o " + quote_for_shell(path("a.csv")) + " --record " +
          quote_for_shell(path("a.mcap")) + command,
      folder.path()));
  ASSERT_EQ(answers.size(), count);
  double before_s = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(answers[i].at("matches").at(0).at("file"), view_name(i));
    EXPECT_GT(answers[i].at("stamp_s"), before_s);
    before_s = answers[i].at("stamp_s");
  }
  std::ostringstream table;
  table << std::ifstream(path("a.csv")).rdbuf();
  EXPECT_EQ(lines(table.str()).size(), count + 1);
  EXPECT_EQ(topics_of(path("a.mcap")).at("/camera/image/compressed").second, count);

  const auto tracked = objects(said_by_shell(
      "(" + quote_for_shell(PANONAV_COMMAND) + " track " + quote_for_shell(path("a.panonav")) +
          " - --json --every 2 --count 20" + command + " || true)",
      folder.path()));
  EXPECT_EQ(tracked.size(), 10U);
}

TEST_F(Walk, ALiveSourceIsReadWhileItIsOpen) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  // The writer waits for the answer to the first picture before it ends its own stream.
  const std::string command =
      "mkfifo " + quote_for_shell(path("pipe")) + " && (" + quote_for_shell(PANONAV_COMMAND) +
      " localise " + quote_for_shell(path("a.panonav")) + " - --json < " +
      quote_for_shell(path("pipe")) + " > " + quote_for_shell(path("out")) +
      " 2> /dev/null & exec 3> " + quote_for_shell(path("pipe")) + "; cat " +
      quote_for_shell(path("jpegs/000001.jpg")) + " " + quote_for_shell(path("jpegs/000002.jpg")) +
      " >&3; for i in $(seq 100); do [ -s " + quote_for_shell(path("out")) +
      " ] && echo answered && break; sleep 0.1; done; exec 3>&-; wait)";
  EXPECT_EQ(said_by_shell(command, folder.path()), "answered\n");
}

TEST_F(Walk, LocaliseAddsANewPlaceOnceAndKnowsItThen) {
  const std::string memory = path("new.panonav");
  const auto first = answers_of({"localise", memory, path("walk"), "--add", "--json"});
  ASSERT_EQ(first.size(), count);
  std::size_t added = 0;
  for (const auto& answer : first) added += answer.at("added").get<bool>() ? 1 : 0;
  EXPECT_GE(added, 32U);  // as many begin a memory
  EXPECT_EQ(views(memory).size(), added);
  const auto second = answers_of({"localise", memory, path("walk"), "--add", "--json"});
  std::size_t known = 0;
  for (const auto& answer : second) {
    EXPECT_FALSE(answer.at("added"));
    known += answer.at("known").get<bool>() ? 1 : 0;
  }
  EXPECT_GE(known, count - 2);
  EXPECT_EQ(views(memory).size(), added);
  // Another world is new.
  write_dataset(folder / "other", landmark_world(77), poses_);
  for (std::size_t i = 0; i < count; ++i) {
    fs::rename(folder / "other" / view_name(i), folder / "other" / ("o" + view_name(i)));
  }
  fs::remove(folder / "other/dataset.toml");
  const auto third = answers_of({"localise", memory, path("other"), "--add", "--json"});
  EXPECT_TRUE(third.front().at("added"));
  EXPECT_GT(views(memory).size(), added + 5);
  // The same observations give the same answers.
  fs::copy_file(memory, path("copy.panonav"));
  EXPECT_EQ(run_panonav({"localise", memory, path("walk"), "--json"}).out,
            run_panonav({"localise", path("copy.panonav"), path("walk"), "--json"}).out);
}

TEST_F(Walk, ARecordOfAStreamHoldsItsJpegsToTheByte) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  said_by_shell(quote_for_shell(PANONAV_COMMAND) + " localise " +
                    quote_for_shell(path("a.panonav")) + " - --record " +
                    quote_for_shell(path("run.mcap")) + " < " +
                    quote_for_shell(path("walk.mjpeg")) + " 2> /dev/null",
                folder.path());
  std::size_t number = 0;
  for_each_message<recordings::ros::CompressedImage>(
      path("run.mcap"), "/camera/image/compressed",
      [&](const recordings::ros::CompressedImage& picture) {
        EXPECT_EQ(picture.format, "jpeg");
        EXPECT_EQ(std::string(picture.data.begin(), picture.data.end()), jpeg(++number));
      });
  EXPECT_EQ(number, count);
}

TEST_F(Walk, ARecordHoldsWhatWasSeenAndAnswered) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  const auto answers = answers_of(
      {"localise", path("a.panonav"), path("walk"), "--json", "--record", path("run.mcap")});
  const auto topics = topics_of(path("run.mcap"));
  for (const char* topic : {"/camera/image/compressed", "/panorama/compressed",
                            "/best_match/compressed", "/tf", "/diagnostics", "/ground_truth"}) {
    EXPECT_EQ(topics.at(topic).second, count) << topic;
  }
  EXPECT_EQ(topics.at("/references").second, 1U);
  EXPECT_EQ(topics.at("/visited").second, 1U);
  std::size_t known = 0;
  for (const auto& answer : answers) known += answer.at("known").get<bool>() ? 1 : 0;
  EXPECT_EQ(topics.at("/pose").second, known);
  // The pictures are those of the walk.
  std::size_t number = 0;
  for_each_message<recordings::ros::CompressedImage>(
      path("run.mcap"), "/camera/image/compressed",
      [&](const recordings::ros::CompressedImage& picture) {
        EXPECT_EQ(recordings::ros::to_image(picture, "picture"),
                  read_image(folder / "walk" / view_name(number)));
        ++number;
      });
  for_each_message<recordings::ros::PointCloud2>(path("run.mcap"), "/references",
                                                 [](const recordings::ros::PointCloud2& cloud) {
                                                   EXPECT_EQ(cloud.width, count);
                                                   EXPECT_EQ(cloud.data.size(), 16 * count);
                                                 });
  // Each pose is that of its answer, and TF says the same, below the root that viewers want.
  std::vector<Pose2> poses;
  for_each_message<recordings::ros::PoseWithCovarianceStamped>(
      path("run.mcap"), "/pose", [&](const recordings::ros::PoseWithCovarianceStamped& pose) {
        EXPECT_EQ(pose.header.frame_id, "map");
        poses.push_back(recordings::ros::to_pose2(pose.pose.pose));
      });
  std::size_t at = 0;
  for (const auto& answer : answers) {
    if (!answer.at("known").get<bool>()) continue;
    EXPECT_EQ(poses.at(at).x_m, answer.at("position").at("x_m"));
    EXPECT_NEAR(poses.at(at).heading_rad, answer.at("heading_rad").get<double>(), 1e-9);
    ++at;
  }
  for_each_message<recordings::ros::TFMessage>(
      path("run.mcap"), "/tf", [](const recordings::ros::TFMessage& tf) {
        ASSERT_GE(tf.transforms.size(), 1U);
        EXPECT_EQ(tf.transforms[0].header.frame_id, "tf#/");
        EXPECT_EQ(tf.transforms[0].child_frame_id, "map");
      });
}

TEST_F(Walk, TheBestMatchOfARecordIsThatOfTheNamedViewAlsoWhereItWasJustAdded) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  run_well({"forget", path("a.panonav"), view_name(count - 1)});  // ids are not used twice
  write_dataset(folder / "other", landmark_world(77), poses_);
  for (std::size_t i = 0; i < count; ++i) {
    fs::rename(folder / "other" / view_name(i), folder / "other" / ("o" + view_name(i)));
  }
  fs::remove(folder / "other/dataset.toml");
  const auto answers = answers_of({"localise", path("a.panonav"), path("other"), "--add", "--json",
                                   "--record", path("run.mcap")});
  std::size_t of_added = 0;
  for (const auto& answer : answers) {
    of_added += answer.at("matches").at(0).at("file").get<std::string>().starts_with("o") ? 1 : 0;
  }
  EXPECT_GE(of_added, 5U);
  EXPECT_EQ(topics_of(path("run.mcap")).at("/best_match/compressed").second, count);
}

TEST_F(Walk, ATrackIsRecordedWithItsParticlesAndItsPath) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  (void)run_panonav({"track", path("a.panonav"), path("walk"), "--record", path("track.mcap")});
  const auto topics = topics_of(path("track.mcap"));
  for (const char* topic : {"/camera/image/compressed", "/best_match/compressed", "/particles",
                            "/particles/poses", "/diagnostics"}) {
    EXPECT_EQ(topics.at(topic).second, count) << topic;
  }
  for_each_message<recordings::ros::PointCloud2>(path("track.mcap"), "/particles",
                                                 [](const recordings::ros::PointCloud2& cloud) {
                                                   EXPECT_GE(cloud.width, 1U);
                                                   EXPECT_LE(cloud.width, 500U);
                                                   EXPECT_EQ(cloud.data.size(), 16 * cloud.width);
                                                 });
  std::size_t poses = 0;
  if (topics.contains("/path")) {
    for_each_message<recordings::ros::Path>(
        path("track.mcap"), "/path", [&](const recordings::ros::Path& line) {
          EXPECT_EQ(line.poses.size(), ++poses);  // it grows by one each time
        });
    EXPECT_EQ(poses, topics.at("/pose").second);
  }
}

TEST_F(Walk, AnswersAreRecordedAndARecordIsInputAgain) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  const std::vector<std::string> ask{"localise", path("a.panonav")};
  const auto by_folder =
      answers_of(with(ask, {path("walk"), "--json", "--record", path("answers.mcap")}));
  expect_record(path("answers.mcap"), count,
                {{"/best_match/compressed", {"sensor_msgs/CompressedImage", count}},
                 {"/diagnostics", {"diagnostic_msgs/DiagnosticArray", count}},
                 {"/ground_truth", {"geometry_msgs/PoseStamped", count}},
                 {"/references", {"sensor_msgs/PointCloud2", 1}},
                 {"/visited", {"nav_msgs/OccupancyGrid", 1}}});
  const auto by_record = answers_of(with(ask, {path("answers.mcap"), "--json"}));
  ASSERT_EQ(by_record.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(by_folder[i].at("matches"), by_record[i].at("matches"));
    EXPECT_EQ(by_folder[i].at("position"), by_record[i].at("position"));
  }
  expect_refusal(with(ask, {path("answers.mcap"), "--record", path("answers.mcap")}),
                 "another file");
}

TEST_F(Walk, ARecordThatCannotBeWrittenDoesNotEndTheRun) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  expect_refusal({"localise", path("a.panonav"), path("walk"), "--record", path("none/run.mcap")},
                 "none/run.mcap");
  const std::vector<std::string> ask{"localise", path("a.panonav"), path("walk"), "--json",
                                     "--record"};
  expect_refusal(with(ask, {"/dev/full"}), "/dev/full");
  const auto full = run_panonav(with(ask, {path("full.mcap")}), {.file_size_limit_bytes = 60'000});
  EXPECT_EQ(full.exit_code, 0);
  EXPECT_EQ(lines(full.out).size(), count);
  EXPECT_NE(full.err.find("full.mcap"), std::string::npos) << full.err;
}

TEST_F(Walk, RunRecordsARouteAndFollowsIt) {
  const std::string memory = path("a.panonav");
  run_well({"memorise", memory, path("walk")});
  const std::vector<std::string> ask{"localise", memory, path("walk"), "--route", "round"};
  expect_refusal(ask, "route");  // there is none
  const auto added = run_panonav(with(ask, {"--add", "--quiet"}));
  EXPECT_EQ(added.exit_code, 0) << added.err;
  const auto route = MemoryFile::open(memory, Access::read_only).route("round");
  ASSERT_TRUE(route);
  EXPECT_EQ(route->size(), count);
  EXPECT_NEAR(route->poses().back().x_m, poses_.back().x_m, 1e-3);
  std::size_t right = 0;
  const auto answers = answers_of(with(ask, {"--json"}));
  for (std::size_t i = 0; i < count; ++i) {
    const json& step = answers[i].at("route");
    right += step.at("on_route").get<bool>() &&
                     std::abs(step.at("pose").at("x_m").get<double>() - poses_[i].x_m) < 0.05
                 ? 1
                 : 0;
  }
  EXPECT_GE(right, count - 4);
  // Without poses motion is read from the pictures, in a frame that cannot go on.
  const std::vector<std::string> film{"localise", memory,  path("walk.mp4"), "--route",
                                      "film",     "--add", "--quiet"};
  run_well(film);
  EXPECT_GE(MemoryFile::open(memory, Access::read_only).route("film").value().size(), 2U);
  expect_refusal(film, "a new name");
}

TEST_F(Walk, PicturesThatCannotBeReadAreCountedAndDoNotFlood) {
  run_well({"memorise", path("a.panonav"), path("walk")});
  fs::create_directories(folder / "bad");
  for (std::size_t i = 0; i < 200; ++i) {
    write_file(folder / "bad" / (std::to_string(i) + ".png"), std::string_view("no image"));
  }
  fs::copy_file(folder / "walk" / view_name(0), folder / "bad" / "z.png");
  const auto result = run_panonav(
      {"localise", path("a.panonav"), path("bad"), "--json", "--record", path("bad.mcap")});
  EXPECT_EQ(result.exit_code, 0);
  const auto said = objects(result.out);
  EXPECT_EQ(said.size(), 201U);
  EXPECT_EQ(std::ranges::count_if(said, [](const json& one) { return one.contains("error"); }),
            200);
  EXPECT_LE(lines(result.err).size(), 10U) << result.err;
  EXPECT_TRUE(contains(result.err, "skipped: "));
  EXPECT_NE(result.err.find("200 could not be read"), std::string::npos) << result.err;
}

TEST_F(Walk, RunRefusesWhatHasNoEffect) {
  expect_refusal({"localise", path("none.panonav"), path("walk"), "--route", "round"}, "--add");
  run_well({"memorise", path("a.panonav"), path("walk")});
  const std::vector<std::string> ask{"localise", path("a.panonav"), path("walk")};
  expect_refusal(with(ask, {"--add-interval-s", "1"}), "without --add");
  expect_refusal(with(ask, {"--camera-width", "96", "--camera-height", "12"}), "not a live source");
  for (const char* verb : {"localise", "track"}) {
    expect_refusal({verb, path("a.panonav"), "/dev/video99", "--report", path("r")}, "live source");
    expect_refusal({verb, path("a.panonav"), path("walk"), "--count", "3"}, "not a live source");
  }
  expect_refusal({"localise", path("a.panonav"), "/dev/video99", "--image-topic", "/a"},
                 "live source");
  expect_refusal({"localise", path("a.panonav"), "/dev/video99"}, "/dev/video99");
  expect_refusal(
      {"localise", path("a.panonav"), "/dev/video99", "b.png", "--record", path("r.mcap")},
      "live source");
  expect_refusal({"map", path("b.panonav"), "/dev/video99", "--kind", "panorama"}, "live source");
}

}  // namespace
}  // namespace panonav::testing
