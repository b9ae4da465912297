#pragma once

#include <string>

#include "cli/arguments.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

/// What a user says of how home vectors are to be computed.
struct HomingArguments {
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
  bool horizon = false;          ///< one row: the mean of the rows around the horizon [S06]
  std::optional<int> published;  ///< K of S06's own rule
  FourierHomingOptions homing;
};

/// Adds --horizon, --published and the options of signature, preprocessing and homing.
void declare_homing(Arguments& arguments, HomingArguments& wanted);

/// The options of the rule that the user wants. Throws UsageError when --published stands beside
/// options of our own rule, ContractError when frequencies are wanted that `components` do not
/// hold.
[[nodiscard]] FourierHomingOptions homing_options(const Arguments& arguments,
                                                  const HomingArguments& wanted, int components);

/// All rows of a signature or, with `horizon`, the mean of those around the horizon.
[[nodiscard]] HomingView view_to_home_with(const FourierSignature& signature, bool horizon);

/// From pictures of one recording to views to home with. Reading from several threads is safe.
class HomingReader {
 public:
  /// Ready-made panoramas keep their size unless `wanted` says otherwise.
  HomingReader(const Dataset& recording, const HomingArguments& wanted);

  /// Throws FileError on a picture that cannot be read, is too small for the components wanted or
  /// that the masks cover.
  [[nodiscard]] Panorama read(const DatasetEntry& entry) const;
  [[nodiscard]] HomingView view(const Panorama& panorama) const;

 private:
  PanoramaReader reader_;
  PreprocessingOptions preprocessing_;
  int components_;
  bool horizon_;
};

/// Throws FileError unless the picture's view has as many rows as `goal` has.
void check_same_rows(const HomingView& view, const DatasetEntry& entry, const HomingView& goal,
                     const std::string& goal_name);

}  // namespace panonav::command
