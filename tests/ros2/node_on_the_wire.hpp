#pragma once

#include <gtest/gtest.h>

#include <mutex>
#include <thread>

#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav_ros2/localisation_node.hpp"
#include "support/fast_peer.hpp"
#include "support/remembered_worlds.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::ros2 {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// A robot in two rooms whose memory was made beforehand, and somebody else's programs around it.
class LocalisationNodeOnTheWire : public ::testing::Test {
 protected:
  static constexpr ElevationBand band{-0.45, 0.6};

  static void SetUpTestSuite() {
    folder_.emplace();
    Memoriser memoriser(memory(), {.source = source()});
    int number = 0;
    for (double y = 0.4; y < 4.0; y += 0.4) {
      for (double x = 0.4; x < 8.0; x += 0.4) {
        if (!testing::robot_fits(world_, {x, y})) continue;
        Observation seen(picture({x, y, 0.0}));
        seen.name = "view_" + std::to_string(number++);
        seen.pose = ReferencePose{x, y, 0.0};
        memoriser.add(std::move(seen));
      }
    }
    memoriser.finish();
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path memory() { return *folder_ / "rooms.panonav"; }
  static PictureSource source() {
    PictureSource source{.kind = PictureKind::panorama};
    source.layout.elevations = band;
    return source;
  }
  static Image picture(const Pose2& pose) {
    return to_picture(world_.panorama(pose, 24, 128, band));
  }

  /// The last one that came; waits where none is there.
  static Pose2 newest_pose(FastPeer::Endpoint& poses) {
    FastPeer::Bytes last;
    while (FastPeer::waiting(poses) > 0) last = FastPeer::next(poses, 1s);
    if (last.empty()) last = FastPeer::next(poses, 10s);
    return recordings::ros::to_pose2(read<recordings::ros::PoseStamped>(last).pose);
  }

  ~LocalisationNodeOnTheWire() override { stop(); }

  void start(LocalisationNodeOptions options = {}, const ParticipantOptions& participant = {}) {
    start({.memory = memory(), .participant = participant, .node = options});
  }
  void start(const LocalisationNodeSetup& setup) {
    node_.emplace(setup, [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      notes_.push_back(line);
    });
    thread_ = std::thread([this] { node_->run(); });
    // Both know of each other's participants: what either makes from now on is known at once.
    if (graph_ == nullptr) {
      graph_ = &peer_.listen("ros_discovery_info",
                             "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", true, true);
    }
    EXPECT_FALSE(FastPeer::next(*graph_, 10s).empty());
  }
  void stop() {
    if (!thread_.joinable()) return;
    node_->stop();
    thread_.join();
  }
  [[nodiscard]] std::size_t notes_with(const std::string& words) {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::ranges::count_if(
        notes_, [&](const auto& line) { return line.find(words) != std::string::npos; }));
  }
  bool comes_true(const std::function<bool()>& condition) {
    for (int i = 0; i < 500; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(20ms);
    }
    return false;
  }

  /// The answer on ~/command/result. Until the node has answered once it may not know of our writer
  /// yet: what nobody hears is said again.
  std::string ask(const std::string& words) {
    if (command_ == nullptr) {
      command_ = &peer_.talk<recordings::ros::String>("panonav/command");
      answer_ = &peer_.listen<recordings::ros::String>("panonav/command/result");
      EXPECT_TRUE(peer_.all_matched(10s));
      for (int i = 0; i < 50 && FastPeer::waiting(*answer_) == 0; ++i) {
        FastPeer::write(*command_, recordings::ros::String{"hello"});
        std::this_thread::sleep_for(100ms);
      }
    }
    while (!FastPeer::next(*answer_, 100ms).empty()) {
    }
    FastPeer::write(*command_, recordings::ros::String{words});
    const auto cdr = FastPeer::next(*answer_, 20s);
    return cdr.empty() ? "nothing" : read<recordings::ros::String>(cdr).data;
  }

  template <class Message>
  static Message read(const FastPeer::Bytes& cdr) {
    return recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr);
  }
  static std::int64_t now_ns() {
    return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  }
  /// The robot sees odometry from an origin of its own.
  static Pose2 odometry(const Pose2& pose) { return inverse(Pose2{1.0, 0.5, 0.4}) * pose; }
  static recordings::ros::Odometry odometry_message(std::int64_t ns, const Pose2& pose) {
    recordings::ros::Odometry message;
    message.header = {ns, "odom"};
    message.child_frame_id = "base_link";
    message.pose.pose = recordings::ros::to_pose(odometry(pose));
    return message;
  }
  static FastPeer::Bytes image_message(std::int64_t ns, const Image& picture) {
    return recordings::ros::write_message(
        recordings::ros::Image{{ns, "camera"},
                               static_cast<std::uint32_t>(picture.height()),
                               static_cast<std::uint32_t>(picture.width()),
                               "mono8",
                               0,
                               static_cast<std::uint32_t>(picture.width()),
                               picture.pixels()});
  }
  /// Through the first room, 5 cm and 25 ms a step, or somewhat longer until the node has seen it,
  /// with odometry before and after each picture.
  Pose2 drive(FastPeer::Endpoint& odom, const std::function<void(std::int64_t, const Pose2&)>& see,
              int steps = 40) {
    Pose2 pose{0.6, 0.8, 0.0};
    for (int i = 0; i < steps; ++i) {
      const std::int64_t ns = now_ns();
      EXPECT_TRUE(FastPeer::write(odom, odometry_message(ns, pose)));
      const auto looked_at = [&] { return node_->counts().pictures + node_->counts().dropped; };
      const std::size_t before = looked_at();
      see(ns, pose);
      for (int wait = 0; wait < 5 && (wait == 0 || looked_at() == before); ++wait) {
        std::this_thread::sleep_for(25ms);
      }
      if (i + 1 < steps) pose = pose * Pose2{0.05, 0.0, i > 20 ? 0.05 : 0.0};
    }
    return pose;
  }

  inline static std::optional<testing::TemporaryFolder> folder_;
  inline static const testing::ToyWorld world_ = testing::two_rooms(3, false);
  std::mutex mutex_;
  std::vector<std::string> notes_;
  FastPeer peer_;
  std::optional<LocalisationNode> node_;
  std::thread thread_;
  FastPeer::Endpoint *graph_ = nullptr, *command_ = nullptr, *answer_ = nullptr;
};

}  // namespace panonav::ros2
