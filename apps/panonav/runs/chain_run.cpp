#include "runs/chain_run.hpp"

#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav::command {

namespace {

struct FollowedStep {
  std::string file;
  std::optional<double> stamp_s;
  ChainDecision decision;
  std::size_t snapshot = 0;  // from 1
  Pose2 pose;
};

ordered_json to_json(const FollowedStep& step) {
  return {{"file", step.file},
          {"stamp_s", to_json_or_null(step.stamp_s)},
          {"state", to_string(step.decision.state)},
          {"snapshot", step.snapshot},
          {"turn_rad", step.decision.turn_rad},
          {"advance_m", step.decision.advance_m},
          {"pose", pose_json(step.pose)}};
}

std::string format_step(const FollowedStep& step, Session& session) {
  const std::string state = to_string(step.decision.state);
  const bool is_lost = step.decision.state == ChainState::lost;
  return step.file + "  " + (is_lost ? session.red(state) : session.green(state)) + "  snapshot " +
         std::to_string(step.snapshot) + "  x " + session.format_length(step.pose.x_m, 2) + "  y " +
         session.format_length(step.pose.y_m, 2) + "  heading " +
         format_fixed(degrees(step.pose.heading_rad), 1) + " degrees  turn " +
         format_fixed(degrees(step.decision.turn_rad), 1) + " degrees  advance " +
         session.format_length(step.decision.advance_m, 2);
}

}  // namespace

void add_chain_fields(ordered_json& json, const ChainSummary& chain) {
  json["snapshots"] = chain.snapshots;
  json["way_points"] = chain.way_points;
  json["length_m"] = chain.length_m;
  json["bytes"] = chain.bytes;
  json["bytes_per_m"] = chain.bytes_per_m;
  json["spacing_m"] = chain.spacing_m;
  json["expected_offset_m"] = chain.expected_offset_m;
}

std::string format_chain(const ChainSummary& chain, const Session& session) {
  return format_count(chain.snapshots, "snapshot") + " over " +
         session.format_length(chain.length_m, 1) + ", " + format_fixed(chain.bytes_per_m, 1) +
         " bytes per metre, " + session.format_length(chain.spacing_m, 1) +
         " between snapshots, expected offset " + session.format_length(chain.expected_offset_m, 2);
}

void record_chain_run(const NamedChain& chain, MemoryFile& memory, const DrivePoses& drive,
                      std::size_t images, const ChainSpacing& spacing, Session& session) {
  Progress bar(session, "recording", drive.drive.entries.size());
  const ChainSummary summary = summarise_chain(
      record_chain(memory, chain.name, drive, spacing, session.executor(), [&] { bar.advance(); }));
  bar.clear();
  const std::size_t without_pose = images - drive.drive.entries.size();
  if (session.json()) {
    ordered_json json{{"memory", chain.memory}, {"route", chain.name}, {"method", "chain"}};
    add_chain_fields(json, summary);
    json["file_bytes"] = memory.info().file_bytes;
    json["without_pose"] = without_pose;
    session.print(session.json_line(json));
    return;
  }
  session.print("route '" + chain.name + "' in " + chain.memory + ": " +
                format_chain(summary, session));
  if (without_pose > 0) {
    session.print(format_count(without_pose, "image") + " without pose left out");
  }
}

ExitCode follow_chain_run(ChainGuide& guide, const Dataset& run, int every_nth, Session& session) {
  std::vector<const DatasetEntry*> entries;
  for (std::size_t i = 0; i < run.entries.size(); i += static_cast<std::size_t>(every_nth)) {
    if (run.entries[i].odometry) entries.push_back(&run.entries[i]);
  }
  constexpr std::size_t min_images = 2;
  if (entries.size() < min_images) {
    throw FileError(run.folder.string(), "has odometry for " +
                                             format_count(entries.size(), "image") +
                                             "; allowed along a chain of snapshots: 2 or more");
  }
  Progress progress(session, "following", entries.size());
  FollowedStep last;
  bool has_ended = false;
  for (const DatasetEntry* entry : entries) {
    if (has_ended) break;
    last.decision = guide.step(guide.encode(read_observation(*entry)), *entry->odometry);
    last.file = entry->file;
    last.stamp_s = entry->stamp_s;
    last.snapshot = guide.snapshot_number(last.decision.target);
    last.pose = guide.chain_from_robot();
    progress.clear();
    session.print(session.json() ? session.json_line(to_json(last)) : format_step(last, session));
    progress.advance();
    const ChainState state = last.decision.state;
    has_ended = state == ChainState::arrived || state == ChainState::lost;
  }
  progress.clear();
  if (!session.json() && !has_ended) {
    session.print(
        "the images end before the chain: " + std::string(to_string(last.decision.state)) +
        ", snapshot " + std::to_string(last.snapshot) + " of " +
        std::to_string(guide.chain().snapshots()));
  }
  return last.decision.state == ChainState::lost ? ExitCode::no_answer : ExitCode::done;
}

}  // namespace panonav::command
