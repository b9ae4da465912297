#include "runs/chain_run.hpp"

#include <utility>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav::command {

namespace {

ordered_json to_json(const ChainStep& step) {
  return {{"file", step.file},
          {"stamp_s", to_json_or_null(step.stamp_s)},
          {"state", to_string(step.decision.state)},
          {"snapshot", step.snapshot},
          {"turn_rad", step.decision.turn_rad},
          {"advance_m", step.decision.advance_m},
          {"pose", pose_json(step.pose)}};
}

std::string format_step(const ChainStep& step, Session& session) {
  const std::string state = to_string(step.decision.state);
  const bool is_lost = step.decision.state == ChainState::lost;
  return step.file + "  " + (is_lost ? session.red(state) : session.green(state)) + "  snapshot " +
         std::to_string(step.snapshot) + "  x " + session.format_length(step.pose.x_m, 2) + "  y " +
         session.format_length(step.pose.y_m, 2) + "  heading " +
         format_fixed(degrees(step.pose.heading_rad), 1) + " degrees  turn " +
         format_fixed(degrees(step.decision.turn_rad), 1) + " degrees  advance " +
         session.format_length(step.decision.advance_m, 2);
}

/// Adds the chain as the plan and its snapshots as the references of all moments of a run.
void add_chain(recordings::RunMoment& first, const SnapshotChain& chain) {
  for (const ChainNode& node : chain.nodes()) {
    first.plan.push_back({node.position.x_m, node.position.y_m, 0.0});
    if (node.has_snapshot()) first.references.push_back(node.position);
  }
}

recordings::RunMoment make_moment(const ChainStep& step, const Observation& observation,
                                  const ChainGuide& guide, const PanoramaReader& reader,
                                  const RunRecord& record) {
  recordings::RunMoment moment = record.make_moment(observation, step.index);
  moment.truth.reset();  // true poses are not in the frame of the chain
  if (moment.picture) {
    moment.panorama = reader.convert(moment.picture->view(), observation.tilt.value_or(Tilt{}));
  }
  const ChainDecision& decision = step.decision;
  moment.pose = step.pose;
  moment.sure = decision.state != ChainState::searching && decision.state != ChainState::lost;
  moment.state = to_string(decision.state);
  moment.values = {{"image", step.file},
                   {"snapshot", std::to_string(step.snapshot) + " of " +
                                    std::to_string(guide.chain().snapshots())},
                   {"turn_deg", format_fixed(degrees(decision.turn_rad), 1)},
                   {"advance_m", format_fixed(decision.advance_m, 2)}};
  return moment;
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
                      std::size_t images, const ChainSpacing& spacing,
                      const ChainOdometry& odometry, Session& session) {
  Progress bar(session, "recording", drive.drive.entries.size());
  const ChainSummary summary = summarise_chain(record_chain(
      memory, chain.name, drive, spacing, odometry, session.executor(), [&] { bar.advance(); }));
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

std::vector<ChainStep> follow_chain_run(ChainGuide& guide, const Dataset& run, int every_nth,
                                        RunRecord& record, Session& session) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < run.entries.size(); i += static_cast<std::size_t>(every_nth)) {
    if (run.entries[i].odometry) indices.push_back(i);
  }
  constexpr std::size_t min_images = 2;
  if (indices.size() < min_images) {
    throw FileError(run.folder.string(), "has odometry for " +
                                             format_count(indices.size(), "image") +
                                             "; allowed along a chain of snapshots: 2 or more");
  }
  std::optional<PanoramaReader> reader;
  if (record.is_active()) reader.emplace(run.source, PanoramaShape{});
  Progress progress(session, "following", indices.size());
  std::vector<ChainStep> steps;
  bool has_ended = false;
  for (const std::size_t index : indices) {
    const DatasetEntry& entry = run.entries[index];
    const Observation observation = read_observation(entry);
    ChainStep& step = steps.emplace_back(
        ChainStep{.index = index,
                  .file = entry.file,
                  .stamp_s = entry.stamp_s,
                  .decision = guide.step(guide.encode(observation), *entry.odometry)});
    step.snapshot = guide.snapshot_number(step.decision.target);
    step.pose = guide.chain_from_robot();
    progress.clear();
    session.print(session.json() ? session.json_line(to_json(step)) : format_step(step, session));
    if (reader) {
      recordings::RunMoment moment = make_moment(step, observation, guide, *reader, record);
      if (steps.size() == 1) add_chain(moment, guide.chain());
      record.add(std::move(moment));
    }
    progress.advance();
    const ChainState state = step.decision.state;
    has_ended = state == ChainState::arrived || state == ChainState::lost;
    if (has_ended) break;
  }
  progress.clear();
  record.close();
  if (!session.json() && !has_ended) {
    session.print(
        "the images end before the chain: " + std::string(to_string(steps.back().decision.state)) +
        ", snapshot " + std::to_string(steps.back().snapshot) + " of " +
        std::to_string(guide.chain().snapshots()));
  }
  return steps;
}

}  // namespace panonav::command
