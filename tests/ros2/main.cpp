#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "panonav_ros2/participant.hpp"
#include "support/fast_peer.hpp"

/// Returns what the address sanitizer leaves out in this program: Fast DDS 2.9 deletes the
/// statistics of its readers by a type of another size.
extern "C" const char* __asan_default_options() {  // NOLINT(readability-identifier-naming)
  return "new_delete_type_mismatch=0";
}

namespace {

/// Another process of a test's: it says words until somebody heard some.
int say_words() {
  using namespace panonav::ros2;
  const Note quiet = [](const std::string&) {};
  Participant participant({}, quiet);
  const Publisher<panonav::recordings::ros::String> words(participant, "words");
  for (int i = 0; i < 500; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (words.subscribers() == 0) continue;
    for (int k = 0; k < 20; ++k) {
      words.publish({"here"});
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return 0;
  }
  return 1;
}

}  // namespace

int main(int count, char** words) {
  if (count == 2 && std::string(words[1]) == "--say-words") return say_words();
  ::testing::InitGoogleTest(&count, words);
  if (!panonav::ros2::enter_own_network()) {
    ::testing::GTEST_FLAG(filter) = "MotionHistory.*:FrameTree.*:Names.*:RosArguments.*";
    std::puts("no network of one's own is allowed here: tests over the wire are left out");
  }
  return RUN_ALL_TESTS();
}
