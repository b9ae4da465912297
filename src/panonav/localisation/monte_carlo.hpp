#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/localisation/particles.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav {

/// Options of the filter: its particles, and how they are weighed and renewed.
struct MonteCarloOptions {
  /// Particle injection: how many particles are replaced at each image, so that a kidnapped robot
  /// is found again, and where the new ones are drawn.
  enum class Injection {
    none,       ///< none
    explained,  ///< as many as the view is better explained elsewhere than where the particles are
  };

  int min_particles = 200;      ///< >= 1, also in one narrow mode
  int max_particles = 5000;     ///< when the robot may be anywhere
  double kld_error = 0.05;      ///< allowed between the particles' distribution and the true one
  double resample_below = 0.5;  ///< effective sample size, as a share of the particles
  bool compass = true;          ///< the visual compass weighs headings too
  Injection injection = Injection::explained;  ///< where new particles are drawn
  int reranked_views = 1000;  ///< compared column by column when no near view explains the image
  int seed = 1;               ///< of all random choices, >= 0
};
void visit_options(MonteCarloOptions& options, OptionVisitor& visitor);

/// Estimate of the robot's place, and the particles behind it.
enum class LocalisationState {
  localised,  ///< one mode, no wider than the references' spacing resolves, explains the views
  ambiguous,  ///< the views are of this memory, but several places or a large area explain them
  lost,       ///< the views are not explained by this memory, or odometry has led out of its area
};
/// "localised", "ambiguous", "lost".
[[nodiscard]] std::string_view name_of(LocalisationState state);

/// The belief of the filter after an image.
struct MonteCarloEstimate {
  LocalisationState state = LocalisationState::lost;  ///< localised, ambiguous or lost
  /// Heaviest first; all that hold at least 1 % of the weight. Covariance and spread of the
  /// position are those of its error: the particles' and, as these take the errors of successive
  /// views and the scale error of travel for independent, the part that they miss
  /// (docs/decisions.md).
  std::vector<PoseMode> modes;
  std::optional<Pose2> pose;         ///< mean of the heaviest mode; nullopt when lost
  double spread_m = 0.0;             ///< root mean square distance of all particles from their mean
  int particles = 0;                 ///< as many as KLD sampling needs
  double effective_particles = 0.0;  ///< effective sample size before resampling
  bool resampled = false;            ///< light particles were replaced by heavy ones
  int injected = 0;                  ///< particles that were replaced by new ones
  /// Minimum difference (`ColumnMatch`) of the view to the references near the particles; nullopt
  /// when none was compared.
  std::optional<double> difference_here;
  std::optional<double> difference_anywhere;  ///< the same to all references
  /// Log-likelihood of the view where the particles were, relative to that of an unexplained view.
  double log_here = 0.0;
  double log_there = 0.0;  ///< the same anywhere in the memory (only with `Injection::explained`)
  double inside = 0.0;  ///< belief that the robot is in the memorised area, 0 .. 1; lost below 0.5
  /// Probability that the robot is at the heaviest mode: `inside` times the mode's weight. Of
  /// estimates with 0.9 and more inside the memorised area, more than nine of ten are right
  /// (docs/decisions.md).
  double probability = 0.0;
  std::uint64_t views_compared = 0;  ///< column by column
};

/// Monte-Carlo localisation over the posed views of a memory [M03 section 4].
///
/// A robot with an unknown start is localised within a few images, keeps its position where images
/// are missing or uninformative, and recovers after it was kidnapped. In places that look alike the
/// filter keeps several modes. Runs in the calling thread. Same memory, options and calls: same
/// bits.
class MonteCarloLocaliser {
 public:
  /// The result of a rule of particle injection for one image.
  struct InjectedParticles {
    std::size_t count = 0;       ///< replaced by new ones
    std::vector<ViewId> around;  ///< references around which these are drawn; empty: anywhere
  };
  /// A rule of particle injection: from the image's signature and the number of particles.
  using InjectionRule =
      std::function<InjectedParticles(const PackedSignature& view, std::size_t particles)>;

  /// Starts anywhere in the memorised area, with any heading. The memory must outlive *this and
  /// must not change. Throws OptionError; ContractError as `learn_observation_model`.
  explicit MonteCarloLocaliser(const VisualMemory& memory, const MonteCarloOptions& options = {},
                               const OdometryNoise& odometry = {});
  /// Takes a model learnt before.
  MonteCarloLocaliser(std::shared_ptr<const ColumnRanking> ranking, const ObservationModel& model,
                      const MonteCarloOptions& options = {}, const OdometryNoise& odometry = {});
  ~MonteCarloLocaliser();
  /// The source of a move may only be destroyed or assigned to.
  MonteCarloLocaliser(MonteCarloLocaliser&&) noexcept;
  MonteCarloLocaliser& operator=(MonteCarloLocaliser&&) noexcept;

  /// Injects particles by this rule before each image is weighed, besides `options.injection`
  /// [M03 section 4.1]; empty: by none.
  void set_injection_rule(InjectionRule rule);

  /// Starts again anywhere in the memorised area. `heading_rad`: where it is known.
  void start_globally(std::optional<double> heading_rad = std::nullopt);
  /// Starts again around a known pose; standard deviations of each coordinate, >= 0.
  void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad);

  /// Moves the particles by `robot_old_from_robot_new` of the odometry and its noise; any number of
  /// steps may come between two images.
  void move(const Pose2& step);

  /// Weighs the particles by an image. Throws ContractError on a signature of another shape than
  /// the memory's.
  MonteCarloEstimate observe(const PackedSignature& view);
  /// The present belief, without an image.
  [[nodiscard]] MonteCarloEstimate estimate() const;

  /// The hypotheses after the last step.
  [[nodiscard]] const Particles& particles() const noexcept;
  /// Similarity of this memory's views by their distance.
  [[nodiscard]] const ObservationModel& model() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
