#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/localisation/place.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/signature/gradient_features.hpp"
#include "panonav/signature/sector_matching.hpp"

namespace panonav {

/// Features of a picture that shows a part of the azimuth, relative to the middle of this part.
struct SectorQuery {
  GradientFeatures features;    ///< azimuths relative to `azimuth_rad`
  double azimuth_rad = 0.0;     ///< of the middle of the sector in the robot frame
  double width_rad = 0.0;       ///< azimuth that the picture shows
  bool has_known_tilt = false;  ///< false: the tilt is estimated from the memory
};

/// Returns the probability that a narrow picture of this width, whose best match among `views`
/// views has this score, was taken at a place of the memory, by logistic regression; 0 without a
/// score. Scores of pictures of other buildings hardly depend on the building (docs/decisions.md).
/// The prior probability is one third.
[[nodiscard]] double sector_place_probability(double score, double width_rad,
                                              std::size_t views) noexcept;

/// Distributions that a memory's own views have when a part of them is cut out and compared with
/// the other views; learnt for three widths of the part.
struct SectorModel {
  /// Number of widths.
  static constexpr std::size_t width_count = 3;
  /// Widths for which the model is learnt: 50, 70 and 90 degrees.
  static constexpr std::array<double, width_count> widths_rad{
      0.8726646259971648, 1.2217304763960306, 1.5707963267948966};
  /// Smallest number of views needed for learning.
  static constexpr int min_views = 8;

  bool learnt = false;  ///< false: too few views; the defaults are those of `ciirc_b670`
  /// Exponent of a place's largest score in its share of the probability, > 0.
  double share_exponent = 3.0;
  /// Radius that contains the error of the position in 95 % of the cases, in metres; one for each
  /// width; nullopt if it could not be learnt.
  std::array<std::optional<double>, width_count> radius_m;
  friend bool operator==(const SectorModel&, const SectorModel&) = default;
};

/// Returns the gradient features of a view of the memory; nullopt if it has none.
using GradientSource = std::function<std::optional<GradientFeatures>(ViewId)>;

/// Recognises places of a panoramic memory from pictures that show only a part of the azimuth, such
/// as those of a phone. Nothing that is not seen is filled in: a picture is compared by its own
/// features alone.
class SectorLocaliser {
 public:
  /// Loads the features of all views. `model`: one learnt from this memory before; nullopt: it is
  /// learnt now. `memory` must outlive *this. Throws ContractError if no view has gradient
  /// features. Cost: learning takes about 2 s; 110 kB of RAM for each view.
  SectorLocaliser(const VisualMemory& memory, const GradientSource& features,
                  const std::optional<SectorModel>& model = std::nullopt);

  /// Given or learnt at construction.
  [[nodiscard]] const SectorModel& model() const noexcept { return model_; }

  /// Localises one query; lists up to `top` matches:
  /// 1. Its leading features are compared with those of all views (`rank`). The first 24 are
  ///    preselected, which kept the view that is best by all features in 286 of 297 cases of 31 to
  ///    466 views.
  /// 2. All features are compared with those of the preselected views.
  /// 3. If the tilt is unknown, the tilt under which the first views agree best is estimated.
  /// 4. The model states if the place is known, and shares the probability among places.
  ///
  /// `Place::matches` are by score; position and heading are means of the best views of the place.
  /// Cost: 20 ms and 0.05 ms for each view.
  [[nodiscard]] Place localise(const SectorQuery& query, int top,
                               std::span<const ViewId> excluded = {}) const;

 private:
  struct Reference {
    ViewId view;
    GradientFeatures features;
  };
  struct Candidate {
    std::size_t reference = 0;  ///< index of `references_`
    SectorMatch match;
  };
  /// Views of one place, best first, and their share of the probability.
  struct Group {
    std::vector<Candidate> candidates;
    double share = 0.0;
  };

  struct Ranked {
    std::size_t reference = 0;      ///< index of `references_`
    std::vector<SectorPair> pairs;  ///< of the query with the reference
    double score = 0.0;
  };
  /// Returns the first `top` of the compared views by a part of the features, which are weighted
  /// (`NearestFeatures`). Views are verified in the order of a bound of their scores until no other
  /// view can be among the first ones: the result is that of verifying all.
  [[nodiscard]] std::vector<Ranked> rank(const GradientFeatures& query, NearestFeatures::Part part,
                                         std::size_t top,
                                         std::span<const std::size_t> compared) const;
  [[nodiscard]] std::vector<Candidate> find_candidates(const GradientFeatures& query, int top,
                                                       std::span<const std::size_t> compared,
                                                       bool has_known_tilt) const;
  [[nodiscard]] std::vector<Group> group_by_place(std::span<const Candidate> candidates) const;
  [[nodiscard]] std::optional<PositionEstimate> average_position(const Group& group) const;
  [[nodiscard]] std::optional<double> average_heading(const Group& group) const;
  [[nodiscard]] bool are_near(std::size_t a, std::size_t b, double spacings) const;
  [[nodiscard]] std::optional<double> radius_at(double width_rad) const;
  [[nodiscard]] PlaceMatch describe(const Candidate& candidate, double azimuth_rad) const;
  /// Cuts a part of this width out of a view; returns the places of the others that it resembles.
  [[nodiscard]] std::vector<Group> find_places_of_cut(std::size_t reference, std::size_t width,
                                                      std::uint64_t seed) const;
  void learn();

  const VisualMemory* memory_;
  std::vector<Reference> references_;  // by view
  double spacing_m_ = 0.0;             // median distance to the nearest view; 0: no positions
  SectorModel model_;
};

}  // namespace panonav
