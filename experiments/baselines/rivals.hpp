#pragma once

#include <memory>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// One view as the rivals may use it.
struct RivalView {
  Panorama panorama;
  Image colour{1, 1, 1};  ///< the same view in RGB; one grey pixel where there is none
};

/// A way of recognising places that [M04] argues against, as a small and honest baseline on the
/// same views.
class PlaceRecogniser {
 public:
  virtual ~PlaceRecogniser() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Called once with all reference views, of one shape.
  virtual void memorise(const std::vector<RivalView>& references) = 0;
  /// Index of the nearest reference view.
  [[nodiscard]] virtual std::size_t nearest(const RivalView& query) const = 0;
  [[nodiscard]] virtual double bytes_per_view() const = 0;
};

[[nodiscard]] std::unique_ptr<PlaceRecogniser> fourier_signature_recogniser(int components = 15);
[[nodiscard]] std::unique_ptr<PlaceRecogniser> grey_histogram_recogniser(int bins = 64);
/// One histogram of RGB colours over the whole view, bins_per_channel^3 bins. Memorising throws
/// ContractError on a view without colour.
[[nodiscard]] std::unique_ptr<PlaceRecogniser> colour_histogram_recogniser(
    int bins_per_channel = 8);
[[nodiscard]] std::unique_ptr<PlaceRecogniser> eigenimage_recogniser(int dimensions = 15);
[[nodiscard]] std::unique_ptr<PlaceRecogniser> zero_phase_recogniser();
[[nodiscard]] std::unique_ptr<PlaceRecogniser> pixels_over_all_turns_recogniser();

}  // namespace panonav
