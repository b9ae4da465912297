// Sends a robot to a remembered view: navigate MEMORY GOAL DATASET
#include <iostream>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/robot_navigator.hpp"

/// A robot of one's own; this one replays a recording and says what it is told.
struct Robot : panonav::RobotBase {
  explicit Robot(const char* folder) : recording(panonav::read_dataset(folder)) {}
  panonav::Image capture() { return panonav::read_image(recording.entries.at(next++).path); }
  void command(const panonav::Velocity& v) override {
    std::cout << v.forward_m_s << " m/s, " << v.turn_rad_s << " rad/s\n";
  }
  panonav::Dataset recording;
  std::size_t next = 0;
};

int main(int argc, char** argv) try {
  if (argc != 4) throw panonav::Error("usage: navigate MEMORY GOAL DATASET");
  panonav::RobotNavigator navigator(argv[1], argv[2]);
  for (Robot robot(argv[3]); robot.next < robot.recording.entries.size();) {
    const auto step = navigator.step(robot.capture());
    robot.command(step.velocity);
    if (step.decision.state != panonav::NavigationDecision::State::moving) break;
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
