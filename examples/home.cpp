// Goes back to a remembered view: home MEMORY GOAL DATASET
#include <iostream>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/homing_guide.hpp"

/// A robot of one's own; this one replays a recording and says what it would do.
struct Robot {
  panonav::Dataset recording;
  std::size_t next = 0;
  bool is_on() const { return next < recording.entries.size(); }
  panonav::Image capture() { return panonav::read_image(recording.entries[next++].path); }
  void drive(double direction_rad, double way_r) {
    std::cout << "turn by " << direction_rad << " rad, drive " << way_r << " R\n";
  }
};

int main(int argc, char** argv) try {
  if (argc != 4) throw panonav::Error("usage: home MEMORY GOAL DATASET");
  const panonav::HomingGuide guide(argv[1], argv[2]);
  Robot robot{panonav::read_dataset(argv[3])};
  while (robot.is_on()) {
    const auto way = guide.home(robot.capture());
    if (way.direction_rad) robot.drive(*way.direction_rad, way.distance_r());
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
