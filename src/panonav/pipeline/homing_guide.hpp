#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for making homing views of observations without a memory.
struct HomingViewOptions {
  SignatureOptions signature;          ///< size of the cylinders, and components
  PreprocessingOptions preprocessing;  ///< steps before the transform
  /// True: use one row, the mean of the rows within 5 degrees of the horizon [S06], or of all rows
  /// if elevations are unknown. False: use all rows.
  bool horizon = false;
};

/// Makes homing views of observations. Several threads may use one object concurrently.
class HomingEncoder {
 public:
  /// Encodes without a memory; ready-made panoramas keep their size unless the options say
  /// otherwise.
  HomingEncoder(const PictureSource& source, const HomingViewOptions& options);
  /// Encodes like the memory with this header, using the first `components` of its views; 0: all.
  /// Throws ContractError unless `components` is 0, or from 3 to the memory's number; else like
  /// `ViewEncoder`.
  HomingEncoder(const MemoryHeader& header, const PictureSource& source, int components = 0,
                bool horizon = false);

  /// Returns the preprocessed panorama of an observation. Throws ContractError (FileError if the
  /// observation has a file) if the image is too small for the components or completely masked;
  /// else like `ViewEncoder::panorama`.
  [[nodiscard]] Panorama panorama(const Observation& observation) const;
  /// Returns the homing view of a panorama returned by `panorama`.
  [[nodiscard]] HomingView view(const Panorama& panorama) const;
  /// Returns the homing view of an existing signature: all rows, or only the horizon if the encoder
  /// was constructed with `horizon`.
  [[nodiscard]] HomingView view(const FourierSignature& signature) const;

 private:
  struct StandaloneReader {
    PanoramaReader reader;
    PreprocessingOptions preprocessing;
  };
  [[nodiscard]] Panorama make_standalone_panorama(const StandaloneReader& own,
                                                  const Observation& observation) const;

  std::variant<StandaloneReader, ViewEncoder> pictures_;
  int components_;
  bool horizon_;
};

/// Result of comparing an observation with a homing goal.
struct HomingResult {
  /// Displacement, turn and probability. nullopt for noise and other places: observation and goal
  /// are no more similar than views of two buildings, and there is no answer.
  std::optional<PairEvidence> evidence;
  /// Direction of the goal in the robot's current frame, counter-clockwise from straight ahead.
  /// nullopt without evidence, and at the goal itself: if the vector is not longer than its error
  /// (`HomeVector::has_direction`), or its direction is uncertain by 45 degrees or more.
  std::optional<double> direction_rad;

  /// True if there is evidence.
  [[nodiscard]] bool known() const noexcept { return evidence.has_value(); }
  /// Probability that the error of the direction is at most 45 degrees; 0 without evidence.
  [[nodiscard]] double probability() const noexcept {
    return evidence ? evidence->probability : 0.0;
  }
  /// Distance of the goal in units of R, the typical distance of objects around; 0 without
  /// evidence.
  [[nodiscard]] double distance_r() const noexcept {
    return evidence ? evidence->vector.length() : 0.0;
  }
  /// Rotation of the robot since it was at the goal; 0 without evidence.
  [[nodiscard]] double turn_rad() const noexcept {
    return evidence ? wrap_angle(-evidence->vector.heading_rad) : 0.0;
  }
};

/// Computes the direction back to a goal from one observation. The goal is a view of a memory or an
/// observation taken at the goal. Headings need not be known. Several threads may use one object
/// concurrently. Cost: that of the encoding and of `compute_pair_evidence`, some
/// milliseconds.
class HomingGuide {
 public:
  /// `goal`: name or id of a view of the memory file. Pictures come from the memory's own camera.
  /// Throws FileError, also when there is no such view. Reads no other view.
  HomingGuide(const std::filesystem::path& memory, const std::string& goal,
              const FourierHomingOptions& options = {});
  /// `source`: layout of the pictures; nullopt: that of the memory. `components`, `horizon`: as in
  /// `HomingEncoder`.
  HomingGuide(const MemoryFile& memory, const std::string& goal,
              const std::optional<PictureSource>& source, const FourierHomingOptions& options,
              int components = 0, bool horizon = false);
  /// Uses a goal without a memory: the pictures of goal and observations have the layout `source`.
  HomingGuide(const Observation& goal, const PictureSource& source,
              const HomingViewOptions& views = {}, const FourierHomingOptions& options = {});
  /// Uses a goal view made by another encoder, for example from a picture with another layout.
  HomingGuide(HomingEncoder encoder, std::string goal_name, HomingView goal,
              const FourierHomingOptions& options = {});

  /// Computes the direction to the goal. Throws like `HomingEncoder::panorama`, and ContractError
  /// (FileError if the observation has a file) if the view has another number of rows than the
  /// goal.
  [[nodiscard]] HomingResult home(const Observation& observation) const;

  /// Returns the encoder that makes views of observations.
  [[nodiscard]] const HomingEncoder& encoder() const noexcept { return encoder_; }
  /// Returns the goal's name for messages: the name of its view or observation.
  [[nodiscard]] const std::string& goal_name() const noexcept { return goal_name_; }
  /// Returns the goal's view, with which observations are compared.
  [[nodiscard]] const HomingView& goal() const noexcept { return goal_; }

 private:
  HomingGuide(HomingEncoder encoder, const Observation& goal, const FourierHomingOptions& options);
  HomingGuide(HomingEncoder encoder, const VisualMemory& goal, const FourierHomingOptions& options);

  HomingEncoder encoder_;
  std::string goal_name_;
  HomingView goal_;
  FourierHomingOptions options_;
};

}  // namespace panonav
