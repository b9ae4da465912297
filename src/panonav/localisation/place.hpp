#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panonav/geometry/voronoi.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Evidence from one query that its place is in the memory.
struct PlaceEvidence {
  /// Evidence from the query's local features.
  struct Features {
    int verified = 0;  ///< largest number that a match shares with the query (`match_features`)
    /// Number that match by chance: the median number that the mirrored query shares with sampled
    /// views of the memory.
    int chance = 0;
    /// Largest number that the best match shares with another match: typical of neighbouring views
    /// in this memory. Places that are only built in the same way share fewer.
    int neighbour = 0;
    int seen = 0;  ///< features of the query
  };

  /// `ColumnMatch::difference` of the best match over the better half of the columns; things that
  /// stand in view or have moved change the other half.
  double difference = 1.0;
  double of_all_columns = 1.0;  ///< smallest difference of a match over all columns
  /// Difference of the tenth best match: many views of an unknown place fit equally badly.
  double tenth = 1.0;
  /// Difference that chance reaches: mean less 1.28 standard deviations of the mirrored query to
  /// sampled views; one of ten would be below if they are Gaussian. It measures what the query's
  /// brightness, edges and textures reach in this memory without being from it.
  double chance = 1.0;
  int views = 0;       ///< number of views among which the best was chosen
  int components = 0;  ///< of the memory
  std::optional<Features> features = std::nullopt;  ///< nullopt where none were compared
};

/// Area where the robot may be after a number of components has been compared. Candidates, area and
/// radius never grow from one level to the next.
struct LocalisationLevel {
  int components = 0;             ///< compared so far
  std::vector<Match> candidates;  ///< ascending (partial dissimilarity, view)
  std::optional<double> area_m2;  ///< of the candidates' cells; nullopt when one has no pose
  std::optional<Circle> region;   ///< circle that covers the candidates' cells
  std::uint64_t bytes_read = 0;   ///< of signatures, over all levels so far
};

/// A reference view that the query resembles.
struct PlaceMatch {
  std::string name;                 ///< of the view
  ViewId view;                      ///< its id in the memory
  std::uint32_t dissimilarity = 0;  ///< integer L1 over packed magnitudes, by the search
  double column_difference = 0.0;   ///< difference of the columns after rotation (`ColumnMatch`)
  /// Number of local features that agree with one rotation and one direction of motion; nullopt if
  /// none were compared.
  std::optional<int> verified_features;
  /// Heading of the query relative to this view by the visual compass; nullopt if one of them has
  /// no structure.
  std::optional<double> heading_rad;
};

/// A position between reference views, finer than their spacing [M04 footnote 1].
struct PositionEstimate {
  /// Weight of a reference view in an interpolated position.
  struct Share {
    ViewId view;          ///< a posed view of the memory
    double weight = 0.0;  ///< may be negative; all sum to 1
  };

  double x_m = 0.0;  ///< in the frame of the memory's positions
  double y_m = 0.0;  ///< in the frame of the memory's positions
  /// Radius that holds the true position in 95 % of the cases; nullopt if it could not be learnt.
  std::optional<double> radius_m;
  std::vector<Share> shares;                                    ///< nearest first
  [[nodiscard]] Point2 position() const { return {x_m, y_m}; }  ///< The position as a point.
};

/// Result of localising one view.
struct Place {
  PlaceEvidence evidence;          ///< from which `known_probability` was computed
  double known_probability = 0.0;  ///< probability that the place is in the memory
  bool known = false;  ///< `known_probability` is at least 0.5; matches are listed anyway
  /// Matches: the chosen place and its neighbours first, then all others, each ascending by score
  /// (`RankedMatch`); the nearest of the first four to `position` leads. If local features rank,
  /// matches with more verified features come first instead.
  std::vector<PlaceMatch> matches;
  /// Position interpolated between references; nullopt if the place is unknown or the nearest view
  /// has no pose. If only local features recognise the place, the radius is at least that of the
  /// interpolation's neighbourhood (`PositionModel`).
  std::optional<PositionEstimate> position;
  /// Heading of the robot in the frame of the positions, in [-pi, pi); nullopt if the place is
  /// unknown or none of the four nearest views has a heading.
  std::optional<double> heading_rad;
  int components = 0;                ///< compared
  std::uint64_t bytes_read = 0;      ///< by the search
  std::uint64_t bytes_in_full = 0;   ///< that a scan over all views would read
  std::uint64_t views_compared = 0;  ///< column by column
  /// Areas from coarse to fine; empty without the option `PlaceRecogniserOptions::areas`.
  std::vector<LocalisationLevel> areas;
};

}  // namespace panonav
