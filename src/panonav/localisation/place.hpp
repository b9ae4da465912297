#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panonav/geometry/voronoi.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// What one query tells of whether its place is in the memory.
struct PlaceEvidence {
  /// What the local features of one query tell of whether its place is in the memory.
  struct Features {
    int verified = 0;  ///< most that a match shares with the query (`match_features`)
    /// Median of what the mirrored query shares with views drawn from the memory: so many agree
    /// with one turn and one direction of motion by chance.
    int chance = 0;
    /// Most that the match with most verified features shares with another one: what views side by
    /// side in this memory share. A place that is only built alike shares less.
    int neighbour = 0;
    int seen = 0;  ///< features of the query
  };

  /// Of the best match, as `ColumnMatch::difference`, over the better half of the compared columns
  /// alone: what stands in view or has moved changes the other half.
  double difference = 1.0;
  /// The smallest over all columns.
  double of_all_columns = 1.0;
  /// As `difference`, of the tenth best match: many views of an unknown place fit equally badly.
  double tenth = 1.0;
  /// As `difference`, of the mirrored query and views drawn from the memory: mean less 1.28
  /// standard deviations, so that one of ten differs by less if they are Gaussian. What the query's
  /// own brightness, edges and textures reach in this memory by chance.
  double chance = 1.0;
  int views = 0;       ///< of which the best was chosen
  int components = 0;  ///< of the memory
  /// Empty where no features were compared.
  std::optional<Features> features = std::nullopt;
};

/// What is known of the place after a number of components has been compared. Every level's
/// candidates, area and radius are at most those of the level before.
struct LocalisationLevel {
  int components = 0;             ///< compared so far
  std::vector<Match> candidates;  ///< ascending (partial dissimilarity, view)
  std::optional<double> area_m2;  ///< of the candidates' cells; empty when a candidate has no pose
  std::optional<Circle> region;   ///< circle that covers the candidates' cells
  std::uint64_t bytes_read = 0;   ///< of signatures, by all levels so far
};

/// A reference view that the query resembles.
struct PlaceMatch {
  std::string name;                 ///< of the view
  ViewId view;                      ///< its id in the memory
  std::uint32_t dissimilarity = 0;  ///< integer L1 over packed magnitudes, as the search gives it
  double column_difference = 0.0;   ///< column by column, after turning (`ColumnMatch`)
  /// Local features that agree with one turn and one direction of motion; empty where none were
  /// compared.
  std::optional<int> verified_features;
  /// Heading of the query relative to this view, by the visual compass; empty when one of them has
  /// no structure.
  std::optional<double> heading_rad;
};

/// A position between reference views, finer than their spacing [M04 footnote 1].
struct PositionEstimate {
  /// A reference view's part in an interpolated position.
  struct Share {
    ViewId view;          ///< a posed view of the memory
    double weight = 0.0;  ///< may be negative; all sum to 1
  };

  double x_m = 0.0;  ///< in the frame of the memory's positions
  double y_m = 0.0;  ///< in the frame of the memory's positions
  /// The true position lies within it in 95 % of the cases; empty when nothing could be learnt.
  std::optional<double> radius_m;
  std::vector<Share> shares;                                    ///< nearest first
  [[nodiscard]] Point2 position() const { return {x_m, y_m}; }  ///< As a point.
};

/// Where the robot is, as far as it can be told from one view.
struct Place {
  PlaceEvidence evidence;  ///< what `known_probability` was computed of
  /// That the place is one of the memory's (`place_probability`).
  double known_probability = 0.0;
  /// The probability is at least 0.5. The matches are listed all the same.
  bool known = false;
  /// Those of the chosen place and its neighbours first, then all others, each ascending in their
  /// score (`RankedMatch`); of the first four the one nearest to `position` is put first. Where
  /// local features decide, those with most verified features come first instead.
  std::vector<PlaceMatch> matches;
  /// Interpolated between references; empty when the place is unknown or the nearest view has no
  /// pose. Where local features alone know the place, the radius is at least the neighbourhood of
  /// the interpolation (`PositionModel`).
  std::optional<PositionEstimate> position;
  /// Heading of the robot in the frame of the positions, in [-pi, pi); empty when the place is
  /// unknown or none of the four nearest views has a heading.
  std::optional<double> heading_rad;
  int components = 0;                ///< compared
  std::uint64_t bytes_read = 0;      ///< by the search
  std::uint64_t bytes_in_full = 0;   ///< what a scan over all views would read
  std::uint64_t views_compared = 0;  ///< column by column
  /// The area where the robot may be, from coarse to fine; only where it was asked for
  /// (`PlaceRecogniserOptions::areas`).
  std::vector<LocalisationLevel> areas;
};

}  // namespace panonav
