#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

/// Draws poses of new particles near the references to which a view was compared.
class PoseSampler {
 public:
  /// `likelihood` and `model` must outlive *this. `compass`: headings come from the visual compass.
  PoseSampler(const ViewLikelihood& likelihood, const ObservationModel& model, bool compass)
      : likelihood_(&likelihood), model_(&model), compass_(compass) {}

  /// A site together with one of the two robot headings that fit best there.
  struct Candidate {
    std::uint32_t site;
    bool second_heading;
  };
  /// True if the compass gives the heading of the robot at the site.
  [[nodiscard]] bool has_heading(std::uint32_t site) const;
  /// Returns the site's position with the heading by the compass, or that of a random particle if
  /// the compass gives none.
  [[nodiscard]] Pose2 make_pose_at(Candidate candidate, const Particles& particles,
                                   Random& random) const;
  /// Samples a pose around the candidate from a Gaussian as wide as the expected pose error.
  [[nodiscard]] Pose2 sample_around(Candidate candidate, const Particles& particles,
                                    Random& random) const;
  /// Draws a position in the site's grid square, with this heading or a random one.
  [[nodiscard]] Pose2 sample_in_square(std::size_t site, std::optional<double> heading_rad,
                                       Random& random) const;
  /// Draws a position in the grid square of a random site. The heading is random; without a compass
  /// it is that of a random particle.
  [[nodiscard]] Pose2 sample_anywhere(const Particles& particles, Random& random) const;

 private:
  const ViewLikelihood* likelihood_;
  const ObservationModel* model_;
  bool compass_;
};

}  // namespace panonav
