// Recordings of topics as input: the same pictures give the same memory and the same answers,
// whatever they come in.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <tuple>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/mcap_writer.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "panonav_recordings/ros_messages.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double start_s = 1.7e9;
const Pose2 odometry_from_world{3.0, -1.0, 0.7};

double stamp_s(std::size_t index) {
  return start_s + (0.1 + 0.4 * static_cast<double>(index));
}

/// Pictures along the poses with everything that a table can say.
void write_walk(const fs::path& folder, const ToyWorld& world, const std::vector<Pose2>& poses,
                bool tilted) {
  write_dataset(folder, world, poses);
  std::string csv = "file,stamp_s,x_m,y_m,heading_deg,odom_x_m,odom_y_m,odom_heading_deg";
  if (tilted) csv += ",roll_deg,pitch_deg";
  const auto pose_text = [](const Pose2& pose) {
    return "," + to_text(pose.x_m) + "," + to_text(pose.y_m) + "," +
           to_text(degrees(pose.heading_rad));
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    csv += "\n" + view_name(i) + "," + to_text(stamp_s(i)) + pose_text(poses[i]) +
           pose_text(odometry_from_world * poses[i]);
    if (tilted) csv += "," + to_text(0.5 * static_cast<double>(i % 7)) + ",-2.5";
  }
  write_file(folder / "poses.csv", std::string_view(csv + "\n"));
}

/// All messages, packed in another way; of odometry without those from `begin` to before `end`.
void repack(const fs::path& from, const fs::path& to, recordings::McapCompression compression,
            std::size_t begin = 0, std::size_t end = 0) {
  const auto recording = recordings::Recording::open(from);
  recordings::McapWriter writer(to, {.compression = compression, .chunk_bytes = 20'000});
  std::vector<std::uint32_t> topics;
  std::vector<std::uint16_t> channels;
  for (const auto& topic : recording->topics()) {
    topics.push_back(static_cast<std::uint32_t>(topics.size()));
    channels.push_back(
        writer.add_channel(topic.name, "cdr",
                           writer.add_schema(recordings::ros::ros2_type_name(topic.type), "ros2msg",
                                             recordings::ros::ros2_schema(topic.type))));
  }
  std::size_t number = 0;
  recording->for_each(
      topics, {},
      [&](const recordings::MessageLocation& place, std::span<const std::uint8_t> bytes) {
        const bool is_odometry = recording->topics()[place.topic].name == "/odom";
        if (is_odometry && number++ >= begin && number <= end) return;
        writer.write(channels[place.topic], place.time_ns, place.time_ns, bytes);
      });
  writer.close();
}

std::string number(std::uint64_t value, std::size_t bytes) {
  std::string text;
  for (; text.size() < bytes; value >>= 8U) text.push_back(static_cast<char>(value & 255U));
  return text;
}

/// A record of a ROS 1 bag.
std::string bag_record(const std::vector<std::pair<std::string, std::string>>& fields,
                       const std::string& data) {
  std::string head;
  for (const auto& [name, value] : fields) {
    head += number(name.size() + 1 + value.size(), 4) + name + "=" + value;
  }
  return number(head.size(), 4) + head + number(data.size(), 4) + data;
}

template <class Message>
std::string as_ros1(std::span<const std::uint8_t> cdr) {
  const auto message =
      recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr);
  const auto bytes = recordings::ros::write_message(message, recordings::MessageEncoding::ros1);
  return {bytes.begin(), bytes.end()};
}

/// The messages as a ROS 1 bag of one chunk, without an index.
void write_bag(const fs::path& from, const fs::path& to) {
  const auto recording = recordings::Recording::open(from);
  std::string chunk;
  std::vector<std::uint32_t> topics;
  for (const auto& topic : recording->topics()) {
    const std::string connection = number(topics.size(), 4);
    const std::string reported = bag_record(
        {{"topic", topic.name}, {"type", topic.type}, {"md5sum", "*"}, {"message_definition", "-"}},
        "");
    // The fields alone: a header without its own data.
    chunk += bag_record({{"op", "\x07"}, {"conn", connection}, {"topic", topic.name}},
                        reported.substr(4, reported.size() - 8));
    topics.push_back(static_cast<std::uint32_t>(topics.size()));
  }
  recording->for_each(
      topics, {},
      [&](const recordings::MessageLocation& place, std::span<const std::uint8_t> bytes) {
        const std::string& type = recording->topics()[place.topic].type;
        const std::string data = type == recordings::ros::CompressedImage::type
                                     ? as_ros1<recordings::ros::CompressedImage>(bytes)
                                 : type == recordings::ros::Odometry::type
                                     ? as_ros1<recordings::ros::Odometry>(bytes)
                                     : as_ros1<recordings::ros::PoseStamped>(bytes);
        const auto ns = static_cast<std::uint64_t>(place.time_ns);
        chunk +=
            bag_record({{"op", "\x02"},
                        {"conn", number(place.topic, 4)},
                        {"time", number(ns / 1'000'000'000, 4) + number(ns % 1'000'000'000, 4)}},
                       data);
      });
  const std::vector<std::pair<std::string, std::string>> head{{"op", "\x03"},
                                                              {"index_pos", number(0, 8)},
                                                              {"conn_count", number(0, 4)},
                                                              {"chunk_count", number(0, 4)}};
  const std::size_t unpadded = bag_record(head, "").size();
  const std::string bag =
      "#ROSBAG V2.0\n" + bag_record(head, std::string(4096 - unpadded, ' ')) +
      bag_record({{"op", "\x05"}, {"compression", "none"}, {"size", number(chunk.size(), 4)}},
                 chunk);
  write_file(to, std::string_view(bag));
}

/// The messages as a folder of rosbag2.
void write_rosbag2(const fs::path& from, const fs::path& folder) {
  const auto recording = recordings::Recording::open(from);
  fs::create_directories(folder);
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "walk_0.db3").c_str(), &raw), SQLITE_OK);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> database(raw, sqlite3_close);
  const auto execute = [&](const std::string& statement, std::span<const std::uint8_t> blob = {}) {
    sqlite3_stmt* prepared = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(raw, statement.c_str(), -1, &prepared, nullptr), SQLITE_OK);
    if (!blob.empty()) {
      sqlite3_bind_blob(prepared, 1, blob.data(), static_cast<int>(blob.size()), SQLITE_STATIC);
    }
    EXPECT_EQ(sqlite3_step(prepared), SQLITE_DONE);
    sqlite3_finalize(prepared);
  };
  execute(
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
  execute(
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER "
      "NOT NULL, data BLOB NOT NULL)");
  std::vector<std::uint32_t> topics;
  for (const auto& topic : recording->topics()) {
    topics.push_back(static_cast<std::uint32_t>(topics.size()));
    execute("INSERT INTO topics VALUES(" + std::to_string(topics.size()) + ", '" + topic.name +
            "', '" + recordings::ros::ros2_type_name(topic.type) + "', 'cdr', '')");
  }
  recording->for_each(
      topics, {},
      [&](const recordings::MessageLocation& place, std::span<const std::uint8_t> bytes) {
        execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(" +
                    std::to_string(place.topic + 1) + ", " + std::to_string(place.time_ns) + ", ?)",
                bytes);
      });
  write_file(folder / "metadata.yaml",
             std::string_view("rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: "
                              "sqlite3\n  relative_file_paths:\n    - walk_0.db3\n"));
}

class Recordings : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    world_ = landmark_world(7);
    write_walk(walk(), *world_, grid_poses(4), false);
    run_well({"convert", walk(), walk("_zstd.mcap")});
    repack(walk("_zstd.mcap"), walk("_none.mcap"), recordings::McapCompression::none);
    repack(walk("_zstd.mcap"), walk("_lz4.mcap"), recordings::McapCompression::lz4);
    write_bag(walk("_zstd.mcap"), walk("_ros1.bag"));
    write_rosbag2(walk("_zstd.mcap"), walk("_rosbag2"));
    run_well({"memorise", memory(), walk()});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::string walk(const std::string& more = "") { return *folder_ / ("walk" + more); }
  static std::string memory() { return *folder_ / "walk.panonav"; }

  inline static std::optional<TemporaryFolder> folder_;
  inline static std::optional<ToyWorld> world_;
};

const std::vector<std::string> kind{"--kind", "panorama", "--elevation-deg", "-20", "20"};
const std::vector<std::string> forms{"_none.mcap", "_lz4.mcap", "_zstd.mcap",
                                     "_ros1.bag",  "_rosbag2",  "_rosbag2/walk_0.db3"};

TEST_F(Recordings, GiveTheMemoryOfTheirFolder) {
  const auto file = MemoryFile::open(memory(), Access::read_only);
  const VisualMemory expected = file.load();
  ASSERT_EQ(expected.size(), 16U);
  for (const std::string& form : forms) {
    SCOPED_TRACE(form);
    const std::string path = *folder_ / ("own" + fs::path(form).filename().string() + ".panonav");
    run_well(with({"memorise", path, walk(form)}, kind));
    const auto own_file = MemoryFile::open(path, Access::read_only);
    const VisualMemory own = own_file.load();
    EXPECT_EQ(own_file.header().source, file.header().source);
    ASSERT_EQ(own.size(), expected.size());
    for (const ViewId view : expected.views()) {
      EXPECT_EQ(own.packed(view), expected.packed(view));
      const ReferenceInfo& a = own.info(view);
      const ReferenceInfo& b = expected.info(view);
      EXPECT_EQ(a.stamp_s, b.stamp_s);
      EXPECT_EQ(a.pose->x_m, b.pose->x_m);
      EXPECT_EQ(a.pose->y_m, b.pose->y_m);
      EXPECT_NEAR(*a.pose->heading_rad, *b.pose->heading_rad, 1e-12);
    }
    EXPECT_EQ(own.info(expected.views()[0]).name, "1700000000_100000000");
    // Once more there is nothing to do, and the memory knows how the pictures lie.
    EXPECT_EQ(answer_of({"memorise", path, walk(form), "--json"})["known_before"], 16);
  }
}

TEST_F(Recordings, GiveTheAnswersOfTheirFolder) {
  const auto answers = [](const std::string& input, const std::string& verb) {
    auto all = answers_of({verb, memory(), input, "--json"});
    for (json& each : all) {
      each.erase("file");
      each.erase("ground_truth");
    }
    return all;
  };
  for (const std::string verb : {"localise", "track"}) {
    const auto expected = answers(walk(), verb);
    ASSERT_EQ(expected.size(), 16U);
    for (const std::string& form : forms) {
      SCOPED_TRACE(verb + form);
      const auto own = answers(walk(form), verb);
      ASSERT_EQ(own.size(), expected.size());
      for (std::size_t i = 0; i < own.size(); ++i) {
        if (verb == "localise") {
          EXPECT_EQ(own[i], expected[i]);
        } else {  // headings pass through quaternions
          EXPECT_EQ(own[i]["state"], expected[i]["state"]);
          EXPECT_NEAR(own[i]["pose"]["x_m"].get<double>(), expected[i]["pose"]["x_m"].get<double>(),
                      1e-6);
        }
      }
    }
  }
}

TEST_F(Recordings, BecomeTheDataSetThatTheyWere) {
  const std::string tilted = *folder_ / "tilted";
  write_walk(tilted, *world_, grid_poses(4), true);
  const std::string recording = *folder_ / "tilted.mcap";
  const auto there = answer_of({"convert", tilted, recording, "--json"});
  EXPECT_EQ(there["images"], 16);
  const std::string back = *folder_ / "back";
  EXPECT_EQ(answer_of(with({"convert", recording, back, "--json"}, kind)),
            (json{{"input", recording},
                  {"output", back},
                  {"images", 16},
                  {"stamps", true},
                  {"odometry", true},
                  {"positions", true},
                  {"headings", true},
                  {"tilts", true},
                  {"layout_flags", json::array()}}));
  const Dataset a = read_dataset(tilted);
  const Dataset b = read_dataset(back);
  EXPECT_EQ(a.source, b.source);
  ASSERT_EQ(b.entries.size(), 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    const DatasetEntry& was = a.entries[i];
    const DatasetEntry& is = b.entries[i];
    EXPECT_TRUE(is.file.ends_with("00000.png")) << is.file;
    EXPECT_EQ(bytes_of(is.path), bytes_of(was.path));
    EXPECT_EQ(is.stamp_s, was.stamp_s);
    EXPECT_EQ(is.pose->x_m, was.pose->x_m);
    EXPECT_EQ(is.odometry->y_m, was.odometry->y_m);
    EXPECT_NEAR(*is.pose->heading_rad, *was.pose->heading_rad, 1e-12);
    EXPECT_NEAR(is.odometry->heading_rad, was.odometry->heading_rad, 1e-12);
    EXPECT_NEAR(is.tilt->roll_rad, was.tilt->roll_rad, 1e-12);
    EXPECT_NEAR(is.tilt->pitch_rad, was.tilt->pitch_rad, 1e-12);
  }
}

TEST_F(Recordings, TheFlagsOfTheLayoutAreNamed) {
  const fs::path turned = *folder_ / "turned";
  write_walk(turned, *world_, grid_poses(2), false);
  Dataset dataset = read_dataset(turned);
  dataset.source.layout.direction = ColumnDirection::counter_clockwise;
  dataset.source.layout.forward_column = 0.25;
  write_dataset(dataset);
  const std::string recording = *folder_ / "turned.mcap";
  const auto said = answer_of({"convert", turned, recording, "--json"});
  std::vector<std::string> call{"convert", recording, *folder_ / "turned_back"};
  for (const auto& flag : said["layout_flags"]) call.push_back(flag);
  run_well(call);
  EXPECT_EQ(read_dataset(*folder_ / "turned_back").source, dataset.source);
  EXPECT_TRUE(
      contains(run_panonav({"convert", turned, *folder_ / "turned2.mcap"}).out,
               "add: --kind panorama --columns-run counter-clockwise --forward-column 0.25"));
}

TEST_F(Recordings, PicturesAloneGetASecondEach) {
  const fs::path pictures = *folder_ / "pictures";
  fs::create_directories(pictures);
  for (std::size_t i = 0; i < 3; ++i) write_picture(pictures / view_name(i), *world_, {});
  const std::string recording = *folder_ / "pictures.mcap";
  const auto done = answer_of({"convert", pictures, recording, "--json"});
  EXPECT_EQ(done["stamps"], false);
  EXPECT_EQ(done["odometry"], false);
  const auto info = answer_of({"info", recording, "--json"});
  ASSERT_EQ(info["topics"].size(), 1U);
  EXPECT_EQ(info["topics"][0]["rate_hz"], 1.0);
}

TEST_F(Recordings, InfoSaysWhatIsInThem) {
  const auto info = answer_of({"info", walk("_lz4.mcap"), "--json"});
  EXPECT_EQ(keys_of(info), (std::set<std::string>{"recording", "begin_s", "end_s", "topics",
                                                  "warnings", "verbs"}));
  EXPECT_NEAR(info["end_s"].get<double>() - info["begin_s"].get<double>(), 6.0, 1e-6);
  EXPECT_TRUE(info["warnings"].empty());
  ASSERT_EQ(info["topics"].size(), 3U);
  const json& pictures = info["topics"][0];
  EXPECT_EQ(pictures["name"], "/camera/image/compressed");
  EXPECT_EQ(pictures["type"], "sensor_msgs/CompressedImage");
  EXPECT_EQ(pictures["messages"], 16);
  EXPECT_NEAR(pictures["rate_hz"].get<double>(), 2.5, 1e-6);
  EXPECT_EQ(pictures["first_image"], "png");
  EXPECT_EQ(info["topics"][2]["type"], "nav_msgs/Odometry");
  const auto said = run_panonav({"info", walk("_lz4.mcap")});
  EXPECT_EQ(said.exit_code, 0);
  EXPECT_TRUE(contains(said.out, "48 messages of 3 topics in 6.0 s from 1700000000.100 s on"));
  EXPECT_TRUE(contains(said.out, "/odom                     nav_msgs/Odometry"));
}

TEST_F(Recordings, OfSeveralCamerasOneIsNamed) {
  const std::string both = *folder_ / "both.mcap";
  {
    recordings::McapWriter writer(both);
    const auto schema =
        writer.add_schema("sensor_msgs/msg/Image", "ros2msg",
                          recordings::ros::ros2_schema(recordings::ros::Image::type));
    for (const auto& [topic, turn] : {std::pair{"/left", 0.5}, std::pair{"/right", -0.5}}) {
      const auto channel = writer.add_channel(topic, "cdr", schema);
      const Image image = world_->picture({0.5, 0.5, turn}, 96, 12);
      recordings::ros::Image message;
      message.header.stamp_ns = 1'000'000'000;
      message.width = 96;
      message.height = 12;
      message.step = static_cast<std::uint32_t>(96 * image.channels());
      message.encoding = image.channels() == 1 ? "mono8" : "rgb8";
      message.data = image.pixels();
      writer.write(channel, 1'000'000'000, 1'000'000'000, recordings::ros::write_message(message));
    }
  }
  const auto chosen = run_panonav({"localise", memory(), both});
  EXPECT_LE(chosen.exit_code, 1) << chosen.err;
  EXPECT_TRUE(contains(chosen.err, both + ": images of several topics: /left, /right; used: /left; "
                                          "choose another with --image-topic"))
      << chosen.err;
  const auto right = answers_of({"localise", memory(), both, "--image-topic", "/right", "--json"});
  write_picture(*folder_ / "right.png", *world_, {0.5, 0.5, -0.5});
  const auto picture = answers_of({"localise", memory(), *folder_ / "right.png", "--json"});
  EXPECT_EQ(right.at(0)["matches"], picture.at(0)["matches"]);
  expect_refusal({"localise", memory(), both, "--image-topic", "/up"},
                 "has no topic /up of sensor_msgs/Image");
}

// Odometry that begins later, pauses or ends early is still that of the other images.
TEST_F(Recordings, ImagesWithoutOdometryLeaveThatOfTheOthers) {
  const auto positions = [](const std::string& input) {
    std::vector<std::array<double, 2>> found;
    for (const json& each : answers_of({"track", memory(), input, "--start-x-m", "0", "--start-y-m",
                                        "0", "--start-heading-deg", "0", "--json"})) {
      if (!each["pose"].is_null())
        found.push_back({each["pose"]["x_m"].get<double>(), each["pose"]["y_m"].get<double>()});
    }
    return found;
  };
  const auto expected = positions(walk("_zstd.mcap"));
  ASSERT_EQ(expected.size(), 16U);
  for (const auto& [begin, end, where] : {std::tuple{0U, 2U, "1 before its first message"},
                                          {5U, 7U, "2 in pauses of more than"},
                                          {14U, 16U, "1 after its last message"}}) {
    SCOPED_TRACE(where);
    const std::string gap = *folder_ / ("gap" + std::to_string(begin) + ".mcap");
    repack(walk("_zstd.mcap"), gap, recordings::McapCompression::none, begin, end);
    const auto found = positions(gap);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i][0], expected[i][0], 0.25) << i;
      EXPECT_NEAR(found[i][1], expected[i][1], 0.25) << i;
    }
    const auto recorded = run_panonav(
        with({"route", "record", gap + ".panonav", gap, "--odometry", "--every-m", "0", "--json"},
             kind));
    EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
    EXPECT_TRUE(contains(recorded.err, std::string("images have no odometry: ") + where))
        << recorded.err;
    const std::size_t missing = where[0] == '2' ? 2 : 1;
    EXPECT_EQ(json::parse(recorded.out)["left_out"]["without_pose"], missing);
    EXPECT_EQ(json::parse(recorded.out)["lines"], 16 - missing);
    const std::string back = gap + "_folder";
    EXPECT_EQ(answer_of(with({"convert", gap, back, "--json"}, kind))["odometry"], true);
    const Dataset dataset = read_dataset(back);
    EXPECT_EQ(
        std::ranges::count_if(dataset.entries,
                              [](const DatasetEntry& each) { return each.odometry.has_value(); }),
        static_cast<std::ptrdiff_t>(16 - missing));
    const auto of_folder = positions(back);
    ASSERT_EQ(of_folder.size(), found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(of_folder[i][0], found[i][0], 1e-6);
      EXPECT_NEAR(of_folder[i][1], found[i][1], 1e-6);
    }
    const auto mapped = answer_of(with({"map", gap + "_map.panonav", gap, "--json"}, kind));
    EXPECT_EQ(mapped["nodes"], 16);
  }
}

TEST_F(Recordings, TheCommandThatInfoSuggestsWorks) {
  for (const std::string form : {"_lz4.mcap", "_rosbag2", "_ros1.bag"}) {
    SCOPED_TRACE(form);
    const std::string last = lines(run_panonav({"info", walk(form)}).out).back();
    const std::string start = "Next: panonav ";
    ASSERT_TRUE(last.starts_with(start)) << last;
    std::vector<std::string> words;
    std::istringstream text(last.substr(start.size()));
    for (std::string word; text >> word;) words.push_back(word);
    ASSERT_EQ(words.size(), 5U) << last;
    EXPECT_EQ(words[0], "memorise");
    words[1] = *folder_ / ("suggested_" + words[1]);
    run_well(words);
  }
}

TEST_F(Recordings, AnEmptyRecordingIsDescribed) {
  const std::string empty = *folder_ / "nothing.mcap";
  { recordings::McapWriter writer(empty); }
  const auto said = run_panonav({"info", empty});
  EXPECT_EQ(said.exit_code, 0) << said.err;
  EXPECT_TRUE(contains(said.out, "0 messages of 0 topics"));
  EXPECT_TRUE(contains(said.out, "it is empty")) << said.out;
  expect_refusal({"localise", memory(), empty}, "has no images that can be read");
}

TEST_F(Recordings, OptionsThatDoNotFitAreRefused) {
  expect_refusal({"memorise", *folder_ / "new.panonav", walk("_lz4.mcap")},
                 "does not give the type of its images; set the type with --kind");
  expect_refusal({"localise", memory(), walk(), "--imu-topic", "/imu"},
                 walk() + " has no topics; leave out --imu-topic");
  expect_refusal({"track", memory(), walk(), "--odometry-frames", "odom", "base"},
                 "has no topics; leave out --odometry-frames");
  expect_refusal({"track", memory(), walk("_lz4.mcap"), "--odometry-topic", "/odom",
                  "--odometry-frames", "odom", "base"},
                 "--odometry-topic and --odometry-frames cannot be combined");
  expect_refusal({"convert", walk(), *folder_ / "copy"}, "does not end in .mcap");
  expect_refusal(with({"convert", walk("_lz4.mcap"), walk()}, kind),
                 "already exists and is not empty; allowed: a new folder");
  std::ofstream(*folder_ / "empty.mcap") << "\x89MCAP0\r\n";
  expect_refusal({"localise", memory(), *folder_ / "empty.mcap"}, "empty.mcap: ");
}

TEST_F(Recordings, RoutesAndMotionComeFromThem) {
  const std::string routes = *folder_ / "routes.panonav";
  const auto recorded = answer_of(with(
      {"route", "record", routes, walk("_none.mcap"), "--odometry", "--every-m", "0", "--json"},
      kind));
  EXPECT_EQ(recorded["lines"], 16);
  const auto followed = run_panonav({"route", "follow", routes, walk("_none.mcap"), "--json"});
  EXPECT_LE(followed.exit_code, 1) << followed.err;
  EXPECT_EQ(lines(followed.out).size(), 16U);
  const std::string own = *folder_ / "moved.panonav";
  run_well(with({"memorise", own, walk("_none.mcap")}, kind));
  run_well({"arrange", own, "--odometry", walk("_lz4.mcap")});
}

}  // namespace
}  // namespace panonav::testing
