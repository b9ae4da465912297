#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

/// Draws poses for new particles at the references that a view was compared with.
class PoseSampler {
 public:
  /// All must outlive *this. `compass`: the visual compass gives headings.
  PoseSampler(const ViewLikelihood& likelihood, const ObservationModel& model, bool compass)
      : likelihood_(&likelihood), model_(&model), compass_(compass) {}

  /// A site in one of the two headings that fit there.
  struct Candidate {
    std::uint32_t site;
    bool second_heading;
  };
  /// True if the compass gives the heading of the robot at the site.
  [[nodiscard]] bool has_heading(std::uint32_t site) const;
  /// Returns the position of the site with the heading of the compass, else with that of a random
  /// particle.
  [[nodiscard]] Pose2 make_pose_at(Candidate candidate, const Particles& particles,
                                   Random& random) const;
  /// Samples a pose around the candidate, as far away as the true pose may be.
  [[nodiscard]] Pose2 sample_around(Candidate candidate, const Particles& particles,
                                    Random& random) const;
  /// Draws a position in the site's square of the grid, with this heading or any.
  [[nodiscard]] Pose2 sample_in_square(std::size_t site, std::optional<double> heading_rad,
                                       Random& random) const;
  /// Draws a position in the square of any site; without a compass with the heading of a random
  /// particle.
  [[nodiscard]] Pose2 sample_anywhere(const Particles& particles, Random& random) const;

 private:
  const ViewLikelihood* likelihood_;
  const ObservationModel* model_;
  bool compass_;
};

}  // namespace panonav
