#pragma once

#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Steps between a panorama and its signature. Every step commutes with a turn of the
/// robot: preprocessing a turned view gives the preprocessed view turned. Steps run in the order of
/// the members. There is no low-pass step: taking the first components of a signature is one. Mean
/// and gain are on by default: on real routes they cost nothing in constant light, and places are
/// still found when the light changes (figures in docs/decisions.md).
struct PreprocessingOptions {
  /// Rows at the upper and lower edge that are set to 0 and ignored: a mirror's rim, the robot's
  /// body.
  int masked_rows_top = 0;
  int masked_rows_bottom = 0;  ///< the same at the lower edge
  /// Replaces each value by the length of the gradient of grey there (central differences, per row
  /// and column). Less sensitive to light that changes slowly over the view, more to noise and to
  /// the distance moved.
  bool edge_channel = false;
  /// Subtracts the mean over all rows that are not masked.
  bool remove_mean = true;
  /// Scales all values so that their standard deviation over all rows that are not masked is 0.25:
  /// a factor from exposure or brightness cancels. A view of one colour (standard deviation below a
  /// quarter of an 8-bit grey level) has no contrast to scale and stays as it is.
  bool normalise_gain = true;
  friend bool operator==(const PreprocessingOptions&, const PreprocessingOptions&) = default;
};

void visit_options(PreprocessingOptions& options, OptionVisitor& visitor);

/// Returns the factor by which `normalise_gain` scales a view of this standard deviation.
[[nodiscard]] double normalising_gain(double standard_deviation) noexcept;

/// Throws ContractError when the masks leave none of `rows` rows.
void require_unmasked_rows(const PreprocessingOptions& options, int rows);

/// Applies the steps. Throws ContractError when the masks leave no row; OptionError on options out
/// of range.
[[nodiscard]] Panorama preprocess(Panorama panorama, const PreprocessingOptions& options);

}  // namespace panonav
