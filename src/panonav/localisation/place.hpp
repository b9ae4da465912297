#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panonav/geometry/voronoi.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Evidence from one query that its place is in the memory.
struct PlaceEvidence {
  /// Evidence from the query's local features.
  struct Features {
    int verified = 0;  ///< largest number of features that the query shares with a match
    /// Number expected by chance: median number of features that the mirrored query shares with
    /// sampled views of the memory.
    int chance = 0;
    /// Largest number of features that the best match shares with another match, typical of
    /// neighbouring views in this memory. Different places of similar structure share fewer.
    int neighbour = 0;
    int seen = 0;  ///< number of features of the query
  };

  /// `ColumnMatch::difference` of the best match over the half of the columns that agree best.
  /// Occlusions and moved objects change the other half.
  double difference = 1.0;
  double difference_of_all_columns = 1.0;  ///< smallest difference of a match over all columns
  /// Difference of the tenth best match. It is hardly larger than `difference` if the place is
  /// unknown, as many views then fit equally badly.
  double tenth_best_difference = 1.0;
  /// Difference reached by chance: mean minus 1.28 standard deviations (the 10 % quantile of a
  /// Gaussian) of the mirrored query's differences to sampled views. The mirrored query has the
  /// same brightness, edges and textures but shows no place of the memory.
  double chance = 1.0;
  int views = 0;       ///< number of views among which the best was chosen
  int components = 0;  ///< number of Fourier components of the memory
  std::optional<Features> features = std::nullopt;  ///< nullopt if no features were compared
};

/// Area in which the robot may be after a number of Fourier components has been compared.
/// Candidates, area and radius never grow from one level to the next.
struct LocalisationLevel {
  int components = 0;             ///< number of components compared up to this level
  std::vector<Match> candidates;  ///< ascending (partial dissimilarity, view)
  std::optional<double> area_m2;  ///< area of the candidates' cells; nullopt if one has no pose
  std::optional<Circle> region;   ///< circle that covers the candidates' cells
  std::uint64_t bytes_read = 0;   ///< bytes of signatures read up to this level
};

/// A reference view that the query resembles.
struct PlaceMatch {
  std::string name;                 ///< of the view
  ViewId view;                      ///< its id in the memory
  std::uint32_t dissimilarity = 0;  ///< L1 distance of the packed magnitudes, from the search
  double column_difference = 0.0;   ///< `ColumnMatch::difference` at the best rotation; NaN: narrow
  /// Number of local features that agree with one rotation and one direction of motion; nullopt if
  /// none were compared.
  std::optional<int> verified_features;
  /// Heading of the query relative to this view by the visual compass; nullopt if the query or the
  /// view has no structure.
  std::optional<double> heading_rad;
};

/// A position between reference views, finer than their spacing [M04 footnote 1].
struct PositionEstimate {
  /// Weight of a reference view in an interpolated position.
  struct Share {
    ViewId view;          ///< a posed view of the memory
    double weight = 0.0;  ///< may be negative; all sum to 1
  };

  double x_m = 0.0;  ///< in the frame of the floor
  double y_m = 0.0;  ///< in the frame of the floor
  /// Bound of the position along a line of views, narrower than the radius.
  struct AlongRoute {
    double direction_rad = 0.0;  ///< of the line at the estimate, in [-pi/2, pi/2]
    double within_m = 0.0;       ///< contains the error along the line in 95 % of the cases
  };
  /// Radius around the estimate within which the true position lies in 95 % of the cases, also
  /// beside a line of views (`interpolate_position`); nullopt if errors could not be learnt.
  std::optional<double> radius_m;
  /// Stated beside the radius where the views form a line, such as a drive.
  std::optional<AlongRoute> along_route;
  std::vector<Share> shares;                                    ///< nearest first
  [[nodiscard]] Point2 position() const { return {x_m, y_m}; }  ///< The position as a point.
  /// Standard deviation of a coordinate of which nothing is known, in metres: larger than any
  /// memorised place.
  static constexpr double unknown_deviation_m = 1e3;
  /// Returns the covariance of x and y in m^2 (xx, xy, yy) of a Gaussian with these bounds; on a
  /// line, the radius bounds the error across it. Its deviation is `unknown_deviation_m` where no
  /// bound is stated.
  [[nodiscard]] std::array<double, 3> covariance() const noexcept;
};

/// A further place of the memory at which the query may have been taken.
struct AlternativePlace {
  PlaceMatch match;                          ///< its best match
  double probability = 0.0;                  ///< that the query was taken there
  std::optional<PositionEstimate> position;  ///< as `Place::position`
  std::optional<double> heading_rad;         ///< as `Place::heading_rad`
  /// Returns the floor of the place, in whose frame the position is; empty if it has no name.
  [[nodiscard]] std::string_view floor() const noexcept { return floor_of(match.name); }
};

/// Result of localising one view.
struct Place {
  PlaceEvidence evidence;          ///< from which `known_probability` was computed
  double known_probability = 0.0;  ///< probability that the place is in the memory
  /// Probability that the query was taken at the chosen place: `known_probability`, less what all
  /// other places get, also those that are too improbable to be named.
  double probability = 0.0;
  /// Up to three other places that have a share of at least `min_named_share`, most probable first,
  /// such as the opposite side of a symmetric hall. Empty if the place is unknown or its views have
  /// no positions. Their bounds of positions hold if the query was taken at that place.
  std::vector<AlternativePlace> alternatives;
  bool known = false;  ///< `known_probability` is at least 0.5; matches are listed anyway
  /// Matches: the chosen place and its neighbours first, then all others, each group ascending by
  /// `RankedMatch::score`. The one of the first four that is nearest to `position` is moved to the
  /// front. If local features sort the matches, those with more verified features come first
  /// instead.
  std::vector<PlaceMatch> matches;
  /// Position interpolated between references; nullopt if the place is unknown or the nearest view
  /// has no pose. If only local features recognise the place, its bound is at least the radius of
  /// the interpolation's neighbourhood (`PositionModel`). Its radius contains the true position
  /// even if the query was taken at another place of the same floor (`radius_over_places`).
  std::optional<PositionEstimate> position;
  /// Heading of the robot in the frame of the positions, in [-pi, pi); nullopt if the place is
  /// unknown or none of the four nearest views has a heading.
  std::optional<double> heading_rad;
  int components = 0;                ///< compared
  std::uint64_t bytes_read = 0;      ///< bytes read by the search
  std::uint64_t bytes_in_full = 0;   ///< bytes that a scan of all views would read
  std::uint64_t views_compared = 0;  ///< number of views compared column by column
  /// Returns the floor of the place, in whose frame the position is; empty if the place is unknown
  /// or its floor has no name.
  [[nodiscard]] std::string_view floor() const noexcept {
    return known ? floor_of(matches.front().name) : std::string_view{};
  }
  /// Areas from coarse to fine; empty without the option `PlaceRecogniserOptions::areas`.
  std::vector<LocalisationLevel> areas;
};

}  // namespace panonav
