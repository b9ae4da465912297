#pragma once

#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Steps between a panorama and its signature. Every step commutes with a rotation of the robot:
/// rotating a view before or after preprocessing gives the same result. Steps run in the order of
/// the members. No low-pass step is needed, because the signature keeps only the lowest
/// frequencies. Mean and gain are on by default: on real routes they lose no matches in constant
/// light, and places are still recognised when the light changes (figures in docs/decisions.md).
struct PreprocessingOptions {
  /// Rows at the upper and lower edge that are set to 0 and ignored: a mirror's rim, the robot's
  /// body.
  int masked_rows_top = 0;
  int masked_rows_bottom = 0;  ///< the same at the lower edge
  /// Replaces each value by the length of the gradient of grey there (central differences, per row
  /// and column). This makes views less sensitive to light that varies slowly over the view, but
  /// more sensitive to noise and to the distance moved.
  bool edge_channel = false;
  /// Subtracts the mean over all rows that are not masked.
  bool remove_mean = true;
  /// Scales all values so that their standard deviation over the unmasked rows is 0.25, which
  /// cancels a factor of exposure or illumination. A uniform view (standard deviation below a
  /// quarter of an 8-bit grey level) is not scaled.
  bool normalise_gain = true;
  friend bool operator==(const PreprocessingOptions&, const PreprocessingOptions&) = default;
};

void visit_options(PreprocessingOptions& options, OptionVisitor& visitor);

/// Returns the factor by which `normalise_gain` scales a view of this standard deviation.
[[nodiscard]] double normalising_gain(double standard_deviation) noexcept;

/// Throws ContractError when the masks leave none of `rows` rows.
void require_unmasked_rows(const PreprocessingOptions& options, int rows);

/// Applies the steps. Throws ContractError when the masks leave no row; OptionError on options
/// out of range.
[[nodiscard]] Panorama preprocess(Panorama panorama, const PreprocessingOptions& options);

}  // namespace panonav
