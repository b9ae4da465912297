#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/observation.hpp"

namespace panonav {

/// Colours in which a picture is read. Signatures, local features and thumbnails need only grey.
enum class PictureColours {
  stored,  ///< those of the file
  grey     ///< grey levels; of a JPEG in less time (`read_grey_picture`)
};

/// Reads the picture of an entry, and returns it with the entry's data. Several threads may call it
/// concurrently. Throws FileError on a picture that is missing or damaged.
[[nodiscard]] Observation read_observation(const DatasetEntry& entry,
                                           PictureColours colours = PictureColours::stored);

/// Returns the poses of all entries in the frame of the data set. If the data set has no headings,
/// computes them from the path, as the tangent fitted to the positions within 0.3 m of path on each
/// side. Empty if an entry has no position.
[[nodiscard]] std::vector<Pose2> dataset_poses(const Dataset& dataset);
/// True if an entry has odometry.
[[nodiscard]] bool has_odometry(const Dataset& dataset);
/// True if the image of an entry is needed to read a motion that odometry does not give: it, the
/// entry before or the entry after it has no odometry.
[[nodiscard]] bool is_motion_by_images(std::span<const DatasetEntry> entries, std::size_t index);

/// Takes entries whose pictures cannot be used out of a data set, and lists them in `unusable`:
/// those that cannot be decoded, and those of another size than the layout demands; of panoramas,
/// those of another size than most. A picture of its own and pictures of a store, such as a video,
/// stay. Throws FileError if no entry is left. Cost: `check_image` for each file, on all threads.
/// With `heads_only` files whose pixels are damaged stay, too, for callers that skip them when they
/// read them; the cost is that of reading the files.
void leave_out_unusable_pictures(Dataset& dataset, Executor& executor, bool heads_only = false);

/// Calls `make(i)` for 0 .. count - 1 on all threads, and `use(i, result)` in ascending order on
/// the calling thread; for an `Error` of `make` `skip(i, exception_ptr)`.
template <class Make, class Use, class Skip>
void process_in_order(std::size_t count, Executor& executor, const Make& make, const Use& use,
                      const Skip& skip) {
  constexpr std::size_t batch = 32;
  for (std::size_t begin = 0; begin < count; begin += batch) {
    const std::size_t some = std::min(batch, count - begin);
    std::vector<std::optional<decltype(make(begin))>> made(some);
    std::vector<std::exception_ptr> failures(some);
    executor.for_each_chunk(some, 1, [&](std::size_t i, std::size_t, std::size_t) {
      try {
        made[i].emplace(make(begin + i));
      } catch (const Error&) {
        failures[i] = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < some; ++i) {
      if (failures[i]) {
        skip(begin + i, failures[i]);
      } else {
        use(begin + i, std::move(*made[i]));
      }
    }
  }
}
/// The same; rethrows an `Error` of `make` after all earlier results were used.
template <class Make, class Use>
void process_in_order(std::size_t count, Executor& executor, const Make& make, const Use& use) {
  process_in_order(count, executor, make, use, [](std::size_t, const std::exception_ptr& failure) {
    std::rethrow_exception(failure);
  });
}
/// Called with the index of an image that cannot be used and with its error, which it may rethrow.
using SkipImage = std::function<void(std::size_t, const std::exception_ptr&)>;

/// Source of a robot's observations in the order in which they were taken: a data set, folder,
/// video or camera.
class ObservationSource {
 public:
  virtual ~ObservationSource() = default;
  /// Returns the kind and layout of all images.
  [[nodiscard]] virtual const PictureSource& pictures() const noexcept = 0;
  /// Returns the next observation; nullopt at the end. Throws FileError on a picture that cannot be
  /// read; the next call continues after it.
  [[nodiscard]] virtual std::optional<Observation> next() = 0;
};

/// Observations of a data set, a folder or a single picture. Decodes up to `decoded_ahead` pictures
/// in advance, fewer if they are large, on all threads of the executor, which must outlive *this.
class DatasetObservations final : public ObservationSource {
 public:
  static constexpr std::size_t decoded_ahead = 16;  ///< pictures held at most
  /// Bytes of the pictures held at most, unless each thread needs one that is larger.
  static constexpr std::size_t max_decoded_bytes = std::size_t{8} << 20U;

  /// Takes all entries of a data set, in its order.
  DatasetObservations(Dataset dataset, Executor& executor,
                      PictureColours colours = PictureColours::stored);

  [[nodiscard]] const PictureSource& pictures() const noexcept override { return dataset_.source; }
  [[nodiscard]] std::optional<Observation> next() override;
  /// Returns the number of entries.
  [[nodiscard]] std::size_t size() const noexcept { return dataset_.entries.size(); }
  /// Returns true if the next picture is decoded, so that `next()` returns without a wait.
  [[nodiscard]] bool has_decoded() const noexcept {
    return next_ < first_decoded_ + decoded_.size();
  }

 private:
  struct Decoded {
    std::optional<Observation> observation;
    std::exception_ptr failure;
  };
  Dataset dataset_;
  Executor* executor_;
  PictureColours colours_;
  std::size_t next_ = 0;
  std::size_t first_decoded_ = 0;
  std::size_t largest_bytes_ = max_decoded_bytes;  // of a picture so far; a guess before the first
  bool is_size_known_ = false;
  std::vector<Decoded> decoded_;
};

}  // namespace panonav
