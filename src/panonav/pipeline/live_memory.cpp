#include "panonav/pipeline/live_memory.hpp"

#include <algorithm>
#include <chrono>
#include <future>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

struct LiveMemory::Implementation {
  Implementation(std::filesystem::path memory, const LiveMemoryOptions& wanted)
      : path(std::move(memory)), options(wanted) {
    const bool exists = std::filesystem::exists(path);
    if (options.learn) {
      memoriser.emplace(path, options.memoriser);
    } else if (!exists) {
      throw FileError(path.string(), "is not there, and nothing is to be learnt");
    }
    if (exists) recogniser = make_recogniser();
  }

  [[nodiscard]] std::unique_ptr<PlaceRecogniser> make_recogniser() const {
    return std::make_unique<PlaceRecogniser>(
        path, PlaceRecogniserOptions{options.localiser, options.memoriser.source, std::nullopt});
  }

  /// Learns from all views when a quarter of them is new, and takes over what was learnt beside.
  void refresh() {
    constexpr std::size_t min_new = 16;
    const std::size_t views = recogniser ? recogniser->memory().size() : 0;
    const bool due = !recogniser || added.size() >= std::max(min_new, views / 5);
    if (due && !next.valid() && memoriser->file() != nullptr) {
      next = std::async(options.in_step ? std::launch::deferred : std::launch::async,
                        [this] { return make_recogniser(); });
    }
    if (!next.valid()) return;
    if (options.in_step) next.wait();
    if (next.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    recogniser = next.get();
    std::erase_if(added,
                  [&](const auto& view) { return recogniser->memory().find(view.first.name); });
    for (const auto& [info, signature] : added) recogniser->append(info, signature);
  }

  std::filesystem::path path;
  LiveMemoryOptions options;
  std::optional<Memoriser> memoriser;
  std::unique_ptr<PlaceRecogniser> recogniser;
  /// Views that the recogniser has not learnt from.
  std::vector<std::pair<ReferenceInfo, PackedSignature>> added;
  std::optional<double> last_added_s;
  std::size_t learnt = 0;
  std::future<std::unique_ptr<PlaceRecogniser>> next;  // its thread reads the members above
};

LiveMemory::LiveMemory(std::filesystem::path memory, const LiveMemoryOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(memory), options)) {}
LiveMemory::~LiveMemory() = default;
LiveMemory::LiveMemory(LiveMemory&&) noexcept = default;
LiveMemory& LiveMemory::operator=(LiveMemory&&) noexcept = default;

LiveMemory::Answer LiveMemory::answer(const Observation& observation) {
  auto& self = *implementation_;
  if (self.options.learn) self.refresh();
  Answer answer;
  if (self.recogniser) answer.place = self.recogniser->localise(observation);
  const bool due = !self.last_added_s || !observation.stamp_s ||
                   *observation.stamp_s - *self.last_added_s >= self.options.min_interval_s ||
                   *observation.stamp_s < *self.last_added_s;  // the clock was set back
  const bool stored = self.recogniser && self.recogniser->memory().find(observation.name);
  answer.is_new = self.options.learn && due && !stored && !(answer.place && answer.place->known);
  return answer;
}

void LiveMemory::learn(Observation observation) {
  auto& self = *implementation_;
  if (!self.memoriser) throw ContractError("learn", "off", "on, to add views");
  self.last_added_s = observation.stamp_s;
  if (self.recogniser) {
    ReferenceInfo info{observation.name, observation.pose, observation.stamp_s};
    PackedSignature signature = self.recogniser->encoder().packed(observation);
    self.memoriser->add(std::move(observation));
    self.recogniser->append(info, signature);
    self.added.emplace_back(std::move(info), std::move(signature));
  } else {
    self.memoriser->add(std::move(observation));
  }
  ++self.learnt;
}

const PlaceRecogniser* LiveMemory::recogniser() const noexcept {
  return implementation_->recogniser.get();
}

std::size_t LiveMemory::views() const noexcept {
  return implementation_->recogniser ? implementation_->recogniser->memory().size() : 0;
}

std::size_t LiveMemory::learnt() const noexcept {
  return implementation_->learnt;
}

void LiveMemory::finish() {
  auto& self = *implementation_;
  if (self.next.valid()) self.next.wait();
  if (self.learnt > 0) self.memoriser->finish();
}

}  // namespace panonav
