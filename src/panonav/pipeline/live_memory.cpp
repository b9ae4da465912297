#include "panonav/pipeline/live_memory.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <future>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/thread_priority.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav {

namespace {

/// True if the file has views. A writer that was killed may have left a file without any.
bool has_stored_views(Memoriser& memoriser) {
  return memoriser.file() != nullptr && !memoriser.file()->views().empty();
}

/// Stores views on a separate thread.
class ViewStorer {
 public:
  /// `has_views`: the memory holds views already.
  ViewStorer(Memoriser& memoriser, bool has_views)
      : memoriser_(memoriser), has_views_(has_views), thread_([this] { store_until_finished(); }) {}
  ~ViewStorer() { join(); }
  ViewStorer(const ViewStorer&) = delete;
  ViewStorer& operator=(const ViewStorer&) = delete;

  void add(Observation observation) {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    waiting_.push_back(std::move(observation));
    changed_.notify_one();
  }
  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return waiting_.size();
  }
  /// True if views are stored by now.
  [[nodiscard]] bool has_views() const {
    const std::lock_guard lock(mutex_);
    return has_views_;
  }
  /// Stores all waiting views and ends the thread. Rethrows its exception.
  void finish() {
    join();
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

 private:
  void join() {
    {
      const std::lock_guard lock(mutex_);
      is_finishing_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }
  void store_until_finished() {
    lower_thread_priority();
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return is_finishing_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      Observation next = std::move(waiting_.front());
      bool has_views = has_views_;
      lock.unlock();
      std::exception_ptr failure;
      try {
        memoriser_.add(std::move(next));
        has_views = has_views || has_stored_views(memoriser_);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      has_views_ = has_views;
      waiting_.pop_front();
      if (failure && !failure_) failure_ = failure;
    }
  }

  Memoriser& memoriser_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Observation> waiting_;  // the first one is being stored
  std::exception_ptr failure_;
  bool has_views_;
  bool is_finishing_ = false;
  std::thread thread_;
};

/// Returns the observation with its levelled panorama in place of the image.
Observation copy_with_panorama(const Observation& observation, Panorama panorama) {
  Observation same(std::move(panorama));
  same.name = observation.name;
  same.file = observation.file;
  same.stamp_s = observation.stamp_s;
  same.odometry = observation.odometry;
  same.pose = observation.pose;
  return same;
}

}  // namespace

struct LiveMemory::Implementation {
  Implementation(std::filesystem::path memory, const LiveMemoryOptions& memory_options)
      : path(std::move(memory)), options(memory_options) {
    const bool exists = memory_exists(path);
    if (options.add) {
      if (options.areas) throw ContractError("areas", "given", "none of a memory that is added to");
      memoriser.emplace(path, options.memoriser);
    } else if (!exists) {
      throw FileError(mask_passwords(path.string()),
                      "does not exist, and no views are to be added");
    }
    if (options.update && exists && (!options.add || can_be_updated())) {
      updater.emplace(path, options.update_options);
    }
    if (exists && (!options.add || has_stored_views(*memoriser))) recogniser = make_recogniser();
    if (memoriser && !options.in_step) {
      storer.emplace(*memoriser, recogniser != nullptr);  // now only `storer` uses the file
    }
  }

  /// True if enough views have headings for updates; other memories are not updated.
  [[nodiscard]] bool can_be_updated() {
    return memoriser->file()->info().views_with_heading >=
           static_cast<std::uint64_t>(ObservationModel::min_views);
  }

  [[nodiscard]] std::unique_ptr<PlaceRecogniser> make_recogniser() const {
    PlaceRecogniserOptions recogniser_options{
        .localiser = options.localiser, .source = options.memoriser.source, .areas = options.areas};
    if (options.add || options.update || options.hold) {
      recogniser_options.max_held_views = std::numeric_limits<std::size_t>::max();
    }
    return std::make_unique<PlaceRecogniser>(path, recogniser_options);
  }

  /// Starts learning from all views on another thread when at least 16 and a fifth of them are new.
  /// Until the new models are ready, the earlier ones are used.
  void refresh_recogniser_if_needed() {
    constexpr std::size_t min_new = 16;
    const std::size_t views = recogniser ? recogniser->size() : 0;
    const bool due = !recogniser || added.size() >= std::max(min_new, views / 5);
    if (due && !next.valid() && (recogniser || has_views())) {
      next = std::async(options.in_step ? std::launch::deferred : std::launch::async, [this] {
        if (!options.in_step) lower_thread_priority();
        return make_recogniser();
      });
    }
    if (!next.valid()) return;
    if (options.in_step) next.wait();
    if (next.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    recogniser = next.get();
    std::erase_if(added,
                  [&](const auto& view) { return recogniser->memory().find(view.first.name); });
    for (const auto& [info, signature] : added) recogniser->append(info, signature);
  }

  [[nodiscard]] bool has_views() {
    return storer ? storer->has_views() : has_stored_views(*memoriser);
  }

  std::filesystem::path path;
  LiveMemoryOptions options;
  std::optional<Memoriser> memoriser;  // used by the thread of `storer`, if there is one
  std::optional<ViewStorer> storer;
  std::optional<MemoryUpdater> updater;  // of the views that existed at the start
  std::unique_ptr<PlaceRecogniser> recogniser;
  std::optional<Panorama> panorama;  // of the observation named `answered`
  std::string answered;
  /// Views that the recogniser has not learnt from.
  std::vector<std::pair<ReferenceInfo, PackedSignature>> added;
  std::optional<double> last_added_s;
  std::size_t added_since_start = 0;
  std::future<std::unique_ptr<PlaceRecogniser>> next;  // its thread reads members above
};

LiveMemory::LiveMemory(std::filesystem::path memory, const LiveMemoryOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(memory), options)) {}
LiveMemory::~LiveMemory() = default;
LiveMemory::LiveMemory(LiveMemory&&) noexcept = default;
LiveMemory& LiveMemory::operator=(LiveMemory&&) noexcept = default;

LiveMemory::Answer LiveMemory::answer(const Observation& observation) {
  auto& self = *implementation_;
  if (self.options.add) self.refresh_recogniser_if_needed();
  Answer answer;
  self.panorama.reset();
  if (self.recogniser) {
    // Unwraps only once; both answering and adding use the panorama.
    const auto before = std::chrono::steady_clock::now();
    self.panorama = self.recogniser->encoder().panorama(observation);
    answer.unwrapping = std::chrono::steady_clock::now() - before;
    self.answered = observation.name;
    answer.place = self.recogniser->localise(copy_with_panorama(observation, *self.panorama));
  }
  bool is_placed_later = false;
  if (self.updater && answer.place && observation.odometry) {
    self.updater->observe(observation, *self.panorama, *answer.place);
    is_placed_later = self.updater->is_near_known_place();
  }
  const bool due = !self.last_added_s || !observation.stamp_s ||
                   *observation.stamp_s - *self.last_added_s >= self.options.min_interval_s ||
                   *observation.stamp_s < *self.last_added_s;  // the clock was set back
  const bool stored =
      self.options.add && self.recogniser && self.recogniser->memory().find(observation.name);
  const bool full = self.storer && self.storer->waiting() >= max_waiting;
  answer.is_new = self.options.add && due && !stored && !full && !is_placed_later &&
                  !(answer.place && answer.place->known);
  return answer;
}

void LiveMemory::add(Observation observation) {
  auto& self = *implementation_;
  if (!self.memoriser) throw ContractError("add", "off", "on, to add views");
  self.last_added_s = observation.stamp_s;
  const auto store = [&](Observation view) {
    if (self.storer) {
      self.storer->add(std::move(view));
    } else {
      self.memoriser->add(std::move(view));
    }
  };
  if (self.recogniser) {
    const ViewEncoder& encoder = self.recogniser->encoder();
    if (!self.panorama || self.answered != observation.name) {
      self.panorama = encoder.panorama(observation);
    }
    ReferenceInfo info{observation.name, observation.pose, observation.stamp_s};
    PackedSignature signature = encoder.packed(*self.panorama);
    store(copy_with_panorama(observation, *std::exchange(self.panorama, std::nullopt)));
    self.recogniser->append(info, signature);
    self.added.emplace_back(std::move(info), std::move(signature));
  } else {
    store(std::move(observation));
  }
  ++self.added_since_start;
}

const std::optional<Panorama>& LiveMemory::panorama() const noexcept {
  return implementation_->panorama;
}

const PlaceRecogniser* LiveMemory::recogniser() const noexcept {
  return implementation_->recogniser.get();
}

std::size_t LiveMemory::views() const noexcept {
  return implementation_->recogniser ? implementation_->recogniser->size() : 0;
}

std::size_t LiveMemory::added() const noexcept {
  return implementation_->added_since_start;
}

std::optional<MemoryUpdater::Changes> LiveMemory::finish(const std::string& what) {
  auto& self = *implementation_;
  if (self.next.valid()) self.next.wait();
  if (self.storer) self.storer->finish();
  std::optional<MemoryUpdater::Changes> changes;
  if (self.updater) changes = self.updater->finish(what);
  self.updater.reset();
  if (self.added_since_start > 0) self.memoriser->finish();
  return changes;
}

}  // namespace panonav
