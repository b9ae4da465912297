#include "ros2/teacher.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::ros2 {

namespace {

LiveMemoryOptions learning(const TeacherOptions& options) {
  LiveMemoryOptions live;
  live.learn = true;
  live.memoriser = {.source = options.pictures,
                    .signature = options.signature,
                    .preprocessing = options.preprocessing};
  return live;
}

std::filesystem::path new_file(std::filesystem::path path) {
  if (std::filesystem::exists(path)) {
    throw FileError(path.string(), "is there already; allowed with --learn: a new file");
  }
  return path;
}

}  // namespace

Teacher::Teacher(std::filesystem::path memory, const TeacherOptions& options)
    : path_(new_file(std::move(memory))),
      options_(options),
      memory_(path_, learning(options)),
      encoder_(options.pictures, {}) {}

void Teacher::record(const Observation& seen, const Pose2& pose) {
  if (!options_.route) return;
  if (RouteRecorder::is_due(last_line_, pose, RouteRecorderOptions{}.every_m)) {
    waiting_.push_back({pose, encoder_.line(seen)});
    last_line_ = pose;
    ++lines_;
  }
  if (memory_.recogniser() != nullptr) store_lines();
}

void Teacher::store_lines() {
  if (waiting_.empty()) return;
  if (!recorder_) {
    recorder_.emplace(
        MemoryFile::open(path_, Access::read_write), options_.pictures,
        RouteRecorderOptions{.name = *options_.route, .line = {}, .horizon_rows = {}});
  }
  for (auto& line : std::exchange(waiting_, {})) recorder_->add(std::move(line));
}

LiveMemory::Answer Teacher::add(Observation seen) {
  // A robot that stands or turns slowly shows a new memory the same again and again.
  constexpr double min_way_m = 0.1;
  constexpr double min_turn_rad = 0.3;
  // Who is found by views of known places has to be near one: the spacing that grids are made with.
  constexpr double max_spacing_m = 0.5;
  const auto& known = seen.pose.value();
  const Pose2 pose{known.x_m, known.y_m, known.heading_rad.value()};
  LiveMemory::Answer answer = memory_.answer(seen);
  record(seen, pose);
  const auto nearer = [&](double way_m) {
    return std::ranges::any_of(views_, [&](const Pose2& view) {
      return distance(view.position(), pose.position()) < way_m;
    });
  };
  const bool moved =
      views_.empty() || distance(views_.back().position(), pose.position()) >= min_way_m ||
      std::abs(angle_difference(pose.heading_rad, views_.back().heading_rad)) >= min_turn_rad;
  answer.is_new = (answer.is_new && moved) || !nearer(max_spacing_m);
  if (answer.is_new) {
    memory_.learn(std::move(seen));
    views_.push_back(pose);
  }
  return answer;
}

void Teacher::finish() {
  if (memory_.learnt() == 0) throw ContractError("views that were learnt", 0.0, "1 or more");
  memory_.finish();
  store_lines();
  if (recorder_) (void)recorder_->finish();
}

}  // namespace panonav::ros2
