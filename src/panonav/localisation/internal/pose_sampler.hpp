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
  /// All must outlive it. `compass`: the visual compass tells headings.
  PoseSampler(const ViewLikelihood& likelihood, const ObservationModel& model, bool compass)
      : likelihood_(&likelihood), model_(&model), compass_(compass) {}

  /// A site, and which of the two headings that fit there.
  struct Candidate {
    std::uint32_t site;
    bool other;
  };
  /// Whether the compass tells the heading of the robot at the site.
  [[nodiscard]] bool has_heading(std::uint32_t site) const;
  /// Returns the pose of the site in the heading that the compass tells, else in that of one of the
  /// particles.
  [[nodiscard]] Pose2 find_pose(Candidate candidate, const Particles& particles,
                                Random& random) const;
  /// Draws a pose as far around it as the truth may be.
  [[nodiscard]] Pose2 draw_around(Candidate candidate, const Particles& particles,
                                  Random& random) const;
  /// Draws a place in the site's square of the grid, in the given heading or any.
  [[nodiscard]] Pose2 draw_in_square(std::size_t site, std::optional<double> heading_rad,
                                     Random& random) const;
  /// Draws a place in the square of any site; without a compass in the heading of one of the
  /// particles.
  [[nodiscard]] Pose2 draw_anywhere(const Particles& particles, Random& random) const;

 private:
  const ViewLikelihood* likelihood_;
  const ObservationModel* model_;
  bool compass_;
};

}  // namespace panonav
