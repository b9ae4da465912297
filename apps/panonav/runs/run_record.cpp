#include "runs/run_record.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <utility>

#include "panonav/core/address.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "runs/listening_address.hpp"

namespace panonav::command {

namespace {

/// Returns a function that reads thumbnails of a memory by view name; empty while the memory does
/// not exist. Call it from one thread only.
std::function<std::vector<std::uint8_t>(const std::string&)> make_thumbnail_reader(
    std::string memory) {
  return [memory = std::move(memory), file = std::shared_ptr<MemoryFile>()](
             const std::string& name) mutable -> std::vector<std::uint8_t> {
    try {
      if (!file) {
        file = std::make_shared<MemoryFile>(MemoryFile::open(memory, Access::read_only));
      }
      const auto view = file->find(name);
      const auto picture = view ? file->thumbnail(*view) : std::nullopt;
      return picture.value_or(std::vector<std::uint8_t>{});
    } catch (const FileError&) {
      return {};  // the page shows no thumbnail then
    }
  };
}

}  // namespace

void declare_record(Arguments& arguments, RunRecordArguments& record) {
  arguments.option(
      "--record FILE", record.file,
      "Record images and results in an MCAP file, which Rerun, Foxglove and Lichtblick can show");
  arguments.declare_outputs({"--record"});
}

void declare_view(Arguments& arguments, RunRecordArguments& record) {
  arguments.option("--view PORT", record.view,
                   "Show the run in a browser on this computer, at this port (0: any free port); "
                   "with ADDRESS:PORT, other computers in this network can also open the page");
}

RunRecord::RunRecord(const RunRecordArguments& arguments, std::span<const std::string> inputs,
                     bool live, Session& session, const ViewerOptions& viewer_options)
    : session_(session), live_(live) {
  if (arguments.file) {
    if (session.length_unit() != LengthUnit::metres) {
      throw UsageError(
          "--record writes positions in metres, and those of the memory are in view steps; leave "
          "it "
          "out, or first run panonav scale");
    }
    recorder_.emplace(*arguments.file, recordings::RunRecorderOptions{.wait = !live});
  }
  if (arguments.view) {
    const ListeningAddress listening = parse_listening_address("--view", *arguments.view);
    viewer::ViewServerOptions options;
    options.address = listening.address;
    options.port = listening.port;
    options.title =
        "panonav: " + (inputs.empty() ? std::string() : mask_credentials(inputs.front()));
    options.replay = !live;
    options.takes = viewer_options.takes;
    if (!viewer_options.memory.empty())
      options.thumbnail = make_thumbnail_reader(viewer_options.memory);
    viewer_.emplace(options);
    if (!listening.is_local()) {
      session_.note(
          "warning: the page is sent to the network of " + listening.address +
          " without encryption: others in this network can read the page and its address");
    }
    session_.prompt("Open " + viewer_->url() + " in a browser" +
                    (live ? "" : "; the run waits for it"));
  }
}

bool RunRecord::needs_images() const {
  return recorder_ || page_ != nullptr || (viewer_ && (!live_ || viewer_->viewers() > 0));
}

recordings::RunMoment RunRecord::make_moment(const Observation& observation,
                                             std::size_t number) const {
  if (needs_images()) return recordings::make_moment(observation, number);
  return {.stamp_s = observation.stamp_s.value_or(static_cast<double>(number)),
          .odometry = observation.odometry,
          .tilt = observation.tilt,
          .truth = observation.pose};
}

void RunRecord::add(recordings::RunMoment moment) {
  if (page_ != nullptr) page_->add(moment);
  if (!recorder_ || failed_) {
    if (viewer_) viewer_->add(std::move(moment));
    return;
  }
  if (viewer_) viewer_->add(moment);
  try {
    recorder_->add(std::move(moment));
  } catch (const Error& error) {
    failed_ = true;
    session_.note("the recording ends here: " + to_readable_line(error.what()));
  }
}

void RunRecord::close() {
  viewer_.reset();
  if (!recorder_ || failed_) return;
  try {
    recorder_->close();
  } catch (const Error& error) {
    failed_ = true;
    session_.note("the recording is cut short: " + to_readable_line(error.what()));
  }
}

std::vector<std::uint8_t> load_best_match(const Place& place, const MemoryFile& file) {
  if (place.matches.empty()) return {};
  const auto view = file.find(place.matches.front().name);
  const auto picture = view ? file.thumbnail(*view) : std::nullopt;
  return picture.value_or(std::vector<std::uint8_t>{});
}

}  // namespace panonav::command
