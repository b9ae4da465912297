#include "fuzz/targets.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/option_file.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/ros_messages.hpp"
#include "support/temporary_folder.hpp"
#ifdef PANONAV_FUZZ_WORLDS
#include "panonav_simulation/load_gazebo.hpp"
#endif

namespace panonav::testing {

namespace {

namespace fs = std::filesystem;
using Bytes = std::span<const std::uint8_t>;

template <class Allowed = FileError, class Read>
void expect_value_or_line(const Read& read) {
  try {
    read();
  } catch (const Allowed& error) {
    const std::string_view message = error.what();
    if (message.empty() || message.find('\n') != std::string_view::npos) {
      throw std::logic_error("not one line: " + std::string(message));
    }
  }
}

// Written again and again; a plain write, as nothing must survive.
fs::path file_of(std::string_view name, Bytes bytes) {
  static const TemporaryFolder folder;
  return folder.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Bytes bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

constexpr ImageLimits small{.side_px = 4096, .area_px = 1 << 22, .scanned_px = 1 << 27};

void read_picture(Bytes bytes) {
  expect_value_or_line([&] { (void)decode_image(bytes, "picture", small); });
}

void read_config(Bytes bytes) {
  expect_value_or_line([&] {
    OptionFile file(file_of("config.toml", bytes));
    PreprocessingOptions options;
    file.apply("preprocessing", options);
    file.require_sections(std::array<std::string_view, 1>{"preprocessing"});
  });
}

void read_camera_bytes(Bytes bytes) {
  expect_value_or_line([&] {
    const CameraFile file = read_camera(file_of("camera.toml", bytes));
    validate(file.camera);
    write_camera(file_of("written.toml", {}), file);
    if (read_camera(file_of("camera.toml", bytes)).camera != file.camera) {
      throw std::logic_error("a camera changes on its way");
    }
  });
}

constexpr std::string_view dataset_text =
    "[images]\nkind = \"panorama\"\n[poses]\nfile = \"poses.csv\"\n";
constexpr std::string_view poses_text = "file,x_m,y_m\na.png,1,2\n";

void read_dataset_of(Bytes dataset, Bytes poses) {
  expect_value_or_line([&] {
    (void)file_of("a.png", {});
    (void)file_of("poses.csv", poses);
    (void)read_dataset(file_of("dataset.toml", dataset).parent_path());
  });
}
void read_dataset_bytes(Bytes bytes) {
  read_dataset_of(bytes, bytes_of(poses_text));
}
void read_poses(Bytes bytes) {
  read_dataset_of(bytes_of(dataset_text), bytes);
}

void read_csv(Bytes bytes) {
  expect_value_or_line([&] { (void)read_trajectory(file_of("t.csv", bytes)); });
}
void read_tum(Bytes bytes) {
  expect_value_or_line([&] { (void)read_trajectory(file_of("t.tum", bytes)); });
}

void read_recording(Bytes bytes) {
  expect_value_or_line([&] {
    constexpr recordings::RecordingLimits small{.chunk_bytes = 1 << 20, .messages = 100'000};
    const std::shared_ptr<const recordings::Recording> recording =
        recordings::Recording::open(file_of("recording", bytes), small);
    std::vector<std::uint32_t> topics;
    for (std::uint32_t i = 0; i < recording->topics().size(); ++i) topics.push_back(i);
    std::size_t read = 0;
    recording->for_each(topics, {}, [&](const recordings::MessageLocation&, Bytes message) {
      read += message.size();
    });
    const auto locations = recording->locations(topics);
    if (!std::ranges::is_sorted(locations, {}, &recordings::MessageLocation::time_ns)) {
      throw std::logic_error("locations are not in order of time");
    }
    for (const recordings::MessageLocation& location : locations) {
      expect_value_or_line([&] { read += recording->read(location).size(); });
    }
    if (read > 0 && topics.empty()) throw std::logic_error("messages without a topic");
    for (const std::string& line : recording->warnings()) {
      expect_value_or_line([&] { throw FileError("recording", line); });
    }
    expect_value_or_line([&] {
      const auto recorded = panonav::recordings::read_recording(recording, "recording", {});
      for (const std::string& line : recorded.warnings) {
        expect_value_or_line([&] { throw FileError("recording", line); });
      }
      (void)read_picture(recorded.entries.front());
    });
  });
}

void read_all_of(const fs::path& path) {
  expect_value_or_line([&] { (void)MemoryFile::open(path, Access::read_only).verify(); });
  expect_value_or_line([&] {
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    (void)file.info();
    (void)file.load();
    for (const ViewId view : file.views()) (void)file.thumbnail(view);
    for (const auto& name : file.map_names()) (void)file.map(name);
    for (const auto& name : file.route_names()) {
      if (file.route_method(name) == RouteMethod::chain) {
        (void)file.chain(name);
      } else {
        (void)file.route(name);
      }
    }
  });
}

fs::path new_memory(Bytes bytes) {
  const fs::path path = file_of("m.panonav", bytes);
  for (const char* log : {"-wal", "-shm", "-journal"}) fs::remove(path.string() + log);
  return path;
}

void read_memory(Bytes bytes) {
  read_all_of(new_memory(bytes));
}

// A memory of everything that one can hold.
std::vector<std::uint8_t> good_memory() {
  const fs::path path = new_memory({});
  fs::remove(path);
  MemoryHeader header;
  header.shape = {2, 3};
  header.panorama_columns = 8;
  {
    MemoryFile file = MemoryFile::create(path, header);
    std::vector<ViewId> views;
    for (const char* name : {"a", "b", "c"}) {
      NewView view;
      view.info = {name, ReferencePose{1.0, 2.0, 0.5}, 3.0};
      view.thumbnail = {1, 2, 3};
      view.signature = pack(FourierSignature({2, 3}, {0.5F, 0.1F, 0.2F, 0.4F, 0.3F, 0.2F},
                                             std::vector<float>(6), std::nullopt),
                            1.0F);
      views.push_back(file.append(view));
    }
    file.set_parameter("p", "{}");
    TopologicalMap map;
    map.nodes = {{views[0], {}, 0}, {views[1], {1.0, 0.0, 0.0}, 0}};
    file.save_map("m", map);
  }
  return read_file(path, 1U << 24U);
}

// Opens the tables of a memory that this program wrote.
std::unique_ptr<sqlite3, int (*)(sqlite3*)> open_database(const fs::path& path) {
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open(path.c_str(), &raw);
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> database(raw, sqlite3_close);
  if (opened != SQLITE_OK) throw std::logic_error(path.string() + " cannot be opened");
  return database;
}

// The bytes are SQL that somebody ran on a good memory.
void read_memory_sql(Bytes bytes) {
  static const std::vector<std::uint8_t> good = good_memory();
  const fs::path path = new_memory(good);
  const auto database = open_database(path);
  sqlite3* raw = database.get();
  // Nothing outside of the file, and no script without an end.
  sqlite3_limit(raw, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, 1 << 20);
  int steps = 0;
  sqlite3_progress_handler(
      raw, 1000, [](void* count) { return ++*static_cast<int*>(count) > 100 ? 1 : 0; }, &steps);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  (void)sqlite3_exec(raw, text.c_str(), nullptr, nullptr, nullptr);
  sqlite3_exec(raw, "COMMIT", nullptr, nullptr, nullptr);
  read_all_of(path);
}

// A good memory after a change that can be undone.
std::vector<std::uint8_t> changed_memory() {
  const fs::path path = new_memory(good_memory());
  {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    const std::vector<ViewId> views = file.views();
    file.change(
        [&] {
          file.remove(std::vector<ViewId>{views[2]});
          file.rename(views[0], "door");
          file.set_parameter("p", "x");
        },
        "all");
  }
  return read_file(path, 1U << 24U);
}

// The bytes are the changes that a file keeps for undo, with a checksum that holds.
void undo_changes(Bytes bytes) {
  static const std::vector<std::uint8_t> changed = changed_memory();
  const fs::path path = new_memory(changed);
  {
    const auto database = open_database(path);
    sqlite3* raw = database.get();
    RecordBytes record;
    record.add(std::string_view("all"));
    record.add(5.0);
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(raw,
                       "UPDATE history SET what = 'all', stamp_s = 5.0, changes = ?, checksum = ?",
                       -1, &statement, nullptr);
    sqlite3_bind_blob(statement, 1, bytes.data(), static_cast<int>(bytes.size()), SQLITE_STATIC);
    sqlite3_bind_int64(statement, 2,
                       static_cast<std::int64_t>(checksum(bytes, checksum(record.bytes()))));
    const int done = sqlite3_step(statement);
    sqlite3_finalize(statement);
    if (done != SQLITE_DONE) throw std::logic_error("the changes cannot be replaced");
  }
  expect_value_or_line([&] { (void)MemoryFile::open(path, Access::read_only).verify(); });
  expect_value_or_line([&] { (void)MemoryFile::open(path, Access::read_write).undo(); });
  // It was undone as a whole or not at all.
  (void)MemoryFile::open(path, Access::read_only).load();
}

/// The message is what its bytes say: written, it reads as itself.
template <class Message>
Message read_ros_message(Bytes bytes, recordings::MessageEncoding encoding) {
  const auto message = recordings::ros::read_message<Message>(bytes, encoding);
  const auto written = recordings::ros::write_message(message, encoding);
  const auto again = recordings::ros::read_message<Message>(written, encoding);
  if (recordings::ros::write_message(again, encoding) != written) {
    throw std::logic_error("a message changes on its way");
  }
  return message;
}

// The first byte chooses the type and, from 16 on, CDR.
void read_ros_bytes(Bytes bytes) {
  if (bytes.empty()) return;
  const Bytes rest = bytes.subspan(1);
  const recordings::MessageEncoding encoding =
      bytes[0] < 16 ? recordings::MessageEncoding::ros1 : recordings::MessageEncoding::cdr;
  expect_value_or_line<Error>([&] {
    switch (bytes[0] % 16) {
      case 0:
        (void)recordings::ros::to_image(read_ros_message<recordings::ros::Image>(rest, encoding),
                                        small);
        break;
      case 1:
        (void)recordings::ros::to_image(
            read_ros_message<recordings::ros::CompressedImage>(rest, encoding), "picture", small);
        break;
      case 2:
        (void)read_ros_message<recordings::ros::Imu>(rest, encoding);
        break;
      case 3:
        (void)read_ros_message<recordings::ros::PointCloud2>(rest, encoding);
        break;
      case 4:
        (void)read_ros_message<recordings::ros::Odometry>(rest, encoding);
        break;
      case 5:
        (void)read_ros_message<recordings::ros::Path>(rest, encoding);
        break;
      case 6:
        (void)read_ros_message<recordings::ros::OccupancyGrid>(rest, encoding);
        break;
      case 7:
        (void)read_ros_message<recordings::ros::TFMessage>(rest, encoding);
        break;
      case 8:
        (void)read_ros_message<recordings::ros::PointStamped>(rest, encoding);
        break;
      case 9:
        (void)read_ros_message<recordings::ros::PoseStamped>(rest, encoding);
        break;
      case 10:
        (void)read_ros_message<recordings::ros::PoseWithCovarianceStamped>(rest, encoding);
        break;
      case 11:
        (void)read_ros_message<recordings::ros::PoseArray>(rest, encoding);
        break;
      case 12:
        (void)read_ros_message<recordings::ros::DiagnosticArray>(rest, encoding);
        break;
      case 13:
        (void)read_ros_message<recordings::ros::LaserScan>(rest, encoding);
        break;
      default:
        break;
    }
  });
}

#ifdef PANONAV_FUZZ_WORLDS
void read_gazebo_world(Bytes bytes) {
  expect_value_or_line([&] { (void)simulation::load_gazebo(file_of("world.sdf", bytes)); });
}
#endif

constexpr std::array targets{
    FuzzTarget{"png", read_picture},
    FuzzTarget{"jpeg", read_picture},
    FuzzTarget{"config", read_config},
    FuzzTarget{"camera", read_camera_bytes},
    FuzzTarget{"dataset", read_dataset_bytes},
    FuzzTarget{"poses", read_poses},
    FuzzTarget{"csv", read_csv},
    FuzzTarget{"tum", read_tum},
    FuzzTarget{"mcap", read_recording},
    FuzzTarget{"bag", read_recording},
    FuzzTarget{"db3", read_recording},
    FuzzTarget{"memory", read_memory},
    FuzzTarget{"memory_sql", read_memory_sql},
    FuzzTarget{"undo", undo_changes},
    FuzzTarget{"ros_messages", read_ros_bytes},
#ifdef PANONAV_FUZZ_WORLDS
    FuzzTarget{"world", read_gazebo_world},
#endif
};

}  // namespace

std::span<const FuzzTarget> fuzz_targets() {
  return targets;
}

}  // namespace panonav::testing
