#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav::lab {

/// One view in the forms that the rival methods need.
struct RivalView {
  Panorama panorama;
  /// The view as a colour image, for methods that use colour or a finer resolution; a single grey
  /// pixel if there is none.
  Image picture{1, 1, 1};
};

/// A place recognition method that [M04] argues against, implemented as a small, fair baseline on
/// the same views.
class RivalRecogniser {
 public:
  virtual ~RivalRecogniser() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Replaces the memory by these reference views, which must have one shape.
  virtual void memorise(const std::vector<RivalView>& references) = 0;
  /// Returns the index of the most similar reference view, without the one at `left_out`.
  [[nodiscard]] virtual std::size_t nearest(const RivalView& query,
                                            std::optional<std::size_t> left_out = {}) const = 0;
  [[nodiscard]] virtual double bytes_per_view() const = 0;
};

[[nodiscard]] std::unique_ptr<RivalRecogniser> make_fourier_signature_recogniser(
    int components = 15);
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_grey_histogram_recogniser(int bins = 64);
/// Compares one histogram of RGB colours of the whole view, with bins_per_channel^3 bins.
/// `memorise` throws ContractError on a view without colour.
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_colour_histogram_recogniser(
    int bins_per_channel = 8);
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_eigenimage_recogniser(int dimensions = 15);
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_zero_phase_recogniser();
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_pixels_over_all_rotations_recogniser();
/// Compares small views by the sum of absolute differences, minimised over all rotations; their
/// pixels are normalised by mean and deviation of the patch around them, as SeqSLAM does [Milford
/// and Wyeth 2012].
[[nodiscard]] std::unique_ptr<RivalRecogniser> make_patch_normalised_recogniser();

}  // namespace panonav::lab
