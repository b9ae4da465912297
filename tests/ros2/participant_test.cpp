#include "panonav_ros2/participant.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/fast_peer.hpp"

namespace panonav::ros2 {
namespace {

using namespace std::chrono_literals;

TEST(Names, AreExpandedAndRemappedAsInRos2) {
  ParticipantOptions options;
  EXPECT_EQ(full_name("odom", options), "/odom");
  options.name_space = "/left/robot";
  EXPECT_EQ(full_name("odom", options), "/left/robot/odom");
  EXPECT_EQ(full_name("/tf", options), "/tf");
  EXPECT_EQ(full_name("~/pose", options), "/left/robot/panonav/pose");
  options.remappings = {{"image", "camera/image_raw"}, {"/tf", "/robot_tf"}, {"~/pose", "pose"}};
  EXPECT_EQ(full_name("image", options), "/left/robot/camera/image_raw");
  EXPECT_EQ(full_name("/tf", options), "/robot_tf");
  EXPECT_EQ(full_name("~/pose", options), "/left/robot/pose");
  for (const char* bad : {"", "a b", "/1st", "a//b", "a/", "../x", "a\nb", "~pose!"}) {
    EXPECT_THROW((void)full_name(bad, options), ContractError) << bad;
  }
}

TEST(Names, OfDomainsAreNumbers) {
  setenv("ROS_DOMAIN_ID", "kitchen", 1);
  EXPECT_THROW(Participant({}, {}), ContractError);
  setenv("ROS_DOMAIN_ID", "233", 1);
  EXPECT_THROW(Participant({}, {}), ContractError);
  unsetenv("ROS_DOMAIN_ID");
}

/// Hands on messages on a thread of its own.
class Served {
 public:
  explicit Served(Participant& participant)
      : thread_([this, &participant] {
          while (!over_) participant.wait(20ms);
        }) {}
  ~Served() {
    over_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

TEST(Participant, NothingIsLostBothWaysWithAnotherVendorsDds) {
  FastPeer peer;
  Participant participant({}, [](const std::string& line) { ADD_FAILURE() << line; });
  constexpr int messages = 200;
  auto& heard = peer.listen<recordings::ros::String>("words");
  auto& said = peer.talk<recordings::ros::CompressedImage>("pictures");
  const Publisher<recordings::ros::String> words(participant, "words", {.depth = messages});
  std::vector<std::size_t> sizes;
  std::vector<std::int64_t> stamps;
  std::atomic<int> came = 0;
  participant.subscribe("pictures", recordings::ros::CompressedImage::type, {.depth = messages},
                        [&](std::span<const std::uint8_t> cdr) {
                          const auto message =
                              recordings::ros::read_message<recordings::ros::CompressedImage>(
                                  cdr, recordings::MessageEncoding::cdr);
                          sizes.push_back(message.data.size());
                          stamps.push_back(message.header.stamp_ns);
                          ++came;
                        });
  const Served served(participant);
  ASSERT_TRUE(peer.all_matched(10s));
  while (words.subscribers() == 0) std::this_thread::sleep_for(10ms);
  for (int i = 0; i < messages; ++i) {
    words.publish({std::string(static_cast<std::size_t>(i), 'x')});
    const std::vector<std::uint8_t> data(static_cast<std::size_t>(700 * i), 7);
    ASSERT_TRUE(
        FastPeer::write(said, recordings::ros::CompressedImage{{i, "camera"}, "jpeg", data}));
    std::this_thread::sleep_for(2ms);
  }
  for (int i = 0; i < messages; ++i) {
    const auto cdr = FastPeer::next(heard, 5s);
    ASSERT_FALSE(cdr.empty()) << i;
    EXPECT_EQ(recordings::ros::read_message<recordings::ros::String>(
                  cdr, recordings::MessageEncoding::cdr)
                  .data.size(),
              i);
  }
  for (int waited = 0; came < messages && waited < 500; ++waited) std::this_thread::sleep_for(10ms);
  ASSERT_EQ(came, messages);
  for (int i = 0; i < messages; ++i) {
    EXPECT_EQ(stamps[static_cast<std::size_t>(i)], i);
    EXPECT_EQ(sizes[static_cast<std::size_t>(i)], 700U * i);
  }
}

TEST(Participant, HearsPublishersThatOfferBestEffortOnly) {
  FastPeer peer;
  Participant participant({}, [](const std::string& line) { ADD_FAILURE() << line; });
  std::atomic<int> came = 0;
  participant.subscribe("words", recordings::ros::String::type, {},
                        [&](std::span<const std::uint8_t>) { ++came; });
  const Served served(participant);
  auto& said = peer.talk<recordings::ros::String>("words", false);
  ASSERT_TRUE(peer.all_matched(10s));
  for (int i = 0; i < 100 && came == 0; ++i) {
    EXPECT_TRUE(FastPeer::write(said, recordings::ros::String{"here"}));
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_GT(came, 0);
}

TEST(Participant, WhatWasSaidLastReachesThoseWhoComeLater) {
  Participant participant({}, [](const std::string& line) { ADD_FAILURE() << line; });
  const Publisher<recordings::ros::String> words(participant, "words",
                                                 {.depth = 1, .transient_local = true});
  words.publish({"old"});
  words.publish({"new"});
  FastPeer peer;
  auto& heard = peer.listen<recordings::ros::String>("words", true, true);
  const auto cdr = FastPeer::next(heard, 10s);
  ASSERT_FALSE(cdr.empty());
  EXPECT_EQ(
      recordings::ros::read_message<recordings::ros::String>(cdr, recordings::MessageEncoding::cdr)
          .data,
      "new");
}

TEST(Participant, ProcessesOfOneMachineHearEachOtherWithLocalhostOnly) {
  ParticipantOptions options;
  options.localhost_only = true;
  options.domain = 7;  // a process configures a domain once
  Participant participant(options, [](const std::string& line) { ADD_FAILURE() << line; });
  std::atomic<int> came = 0;
  participant.subscribe("words", recordings::ros::String::type, {},
                        [&](std::span<const std::uint8_t>) { ++came; });
  const Served served(participant);
  const pid_t child = fork();
  if (child == 0) {
    setenv("ROS_LOCALHOST_ONLY", "1", 1);
    setenv("ROS_DOMAIN_ID", "7", 1);
    execl("/proc/self/exe", "test_ros2", "--say-words", nullptr);
    _exit(1);
  }
  for (int i = 0; i < 500 && came == 0; ++i) std::this_thread::sleep_for(20ms);
  EXPECT_GT(came, 0);
  int status = 1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST(Participant, TheGraphNamesTheNodeAndItsEndpoints) {
  for (const std::size_t gid_bytes : {24U, 16U}) {
    Participant participant(
        {.node = "eyes", .name_space = "/robot", .gid_bytes = static_cast<int>(gid_bytes)}, {});
    (void)participant.advertise("a", recordings::ros::String::type, {});
    (void)participant.advertise("b", recordings::ros::String::type, {});
    participant.subscribe("c", recordings::ros::String::type, {}, {});
    FastPeer peer;
    auto& graph = peer.listen("ros_discovery_info",
                              "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", true, true);
    const auto cdr = FastPeer::next(graph, 10s);
    ASSERT_FALSE(cdr.empty());
    std::size_t at = 4;
    const auto number = [&] {
      at = (at + 3) / 4 * 4;
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) value |= std::uint32_t{cdr.at(at + i)} << (8 * i);
      at += 4;
      return value;
    };
    const auto text = [&] {
      const std::size_t size = number();
      const std::string found(cdr.begin() + static_cast<std::ptrdiff_t>(at),
                              cdr.begin() + static_cast<std::ptrdiff_t>(at + size - 1));
      at += size;
      return found;
    };
    at += gid_bytes;
    EXPECT_EQ(number(), 1U);  // nodes
    EXPECT_EQ(text(), "/robot");
    EXPECT_EQ(text(), "eyes");
    EXPECT_EQ(number(), 1U);  // readers
    at += gid_bytes;
    EXPECT_EQ(number(), 2U);  // writers
    at += 2 * gid_bytes;
    EXPECT_EQ(at, cdr.size());
  }
}

}  // namespace
}  // namespace panonav::ros2
