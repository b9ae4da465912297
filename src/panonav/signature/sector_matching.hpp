#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/signature/gradient_features.hpp"

namespace panonav {

/// A feature of a query and the feature of a reference of which each is the other's nearest.
struct SectorPair {
  std::uint16_t query = 0;      ///< index of the query's feature
  std::uint16_t reference = 0;  ///< index of the reference's feature
  float weight = 0.0F;          ///< evidence for this reference, above 0
};

/// Result of comparing a query with a reference.
struct SectorMatch {
  double score = 0.0;  ///< weights of the pairs that one motion explains, less for parallax
  int verified = 0;    ///< number of these pairs
  /// Azimuth of the query's forward direction in the frame of the reference, in [-pi, pi).
  double heading_rad = 0.0;
};

/// Nearest features of one query in the references that it was compared with: the first stage of
/// matching. References are numbered in the order of `add`.
class NearestFeatures {
 public:
  /// Features that are compared.
  enum class Part {
    leading,  ///< the leading ones, to preselect references
    all       ///< up to `kernels::max_histograms` of each
  };
  /// `query` must outlive *this.
  explicit NearestFeatures(const GradientFeatures& query, Part part = Part::all);

  /// Compares the query with a reference. Cost with AVX2: about 0.04 ms for 57 and 294 features,
  /// 0.6 ms for 412 and 800.
  void add(const GradientFeatures& reference);
  /// Compares the query with features that show none of the memory's places, to learn how near
  /// features are by chance where there are few references.
  void add_background(const GradientFeatures& elsewhere);
  /// Returns the number of references.
  [[nodiscard]] std::size_t size() const noexcept { return mutual_.size(); }

  /// Returns the pairs of each reference, with weights [McCann, Lowe 2012, local naive Bayes
  /// nearest neighbour]: by how much the pair's distance is below that of the query's feature to
  /// its `background`-th nearest reference (the farthest, if there are fewer), in units of 2.5
  /// levels, at most 1. A feature that many places have, such as a ceiling lamp, is no evidence.
  [[nodiscard]] std::vector<std::vector<SectorPair>> weigh_pairs() const;

  /// Number of nearest references that may show the same feature: views around one place.
  static constexpr std::size_t background = 6;

 private:
  struct Mutual {
    std::uint16_t query, reference;
    float distance;
  };
  void compare(const GradientFeatures& reference, std::vector<Mutual>& mutual);

  [[nodiscard]] std::size_t count_compared(const GradientFeatures& features) const;

  const GradientFeatures* query_;
  Part part_;
  std::size_t count_;                        // of the query's features that are used
  std::vector<std::vector<Mutual>> mutual_;  // of each reference
  std::vector<float> nearest_;  // `background` smallest distances of each feature, ascending
};

/// Returns an upper bound of the score of `verify_sector`, from the pairs that one rotation brings
/// within a right angle of each other.
[[nodiscard]] double bound_score(const GradientFeatures& query, const GradientFeatures& reference,
                                 std::span<const SectorPair> pairs);

/// Finds the rotation and the direction of motion on level ground that explain the pairs of largest
/// weight, as `match_features` does; each weight is multiplied by the cube of the cosine of the
/// pair's parallax, since near references show little of it. `coarse_only`: leaves the heading at a
/// step of 2 pi / 128 instead of refining it. Cost: 0.1 ms for 25 pairs.
[[nodiscard]] SectorMatch verify_sector(const GradientFeatures& query,
                                        const GradientFeatures& reference,
                                        std::span<const SectorPair> pairs,
                                        bool coarse_only = false);

}  // namespace panonav
