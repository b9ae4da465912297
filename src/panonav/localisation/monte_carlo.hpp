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
#include "panonav/localisation/place.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav {

/// Options of the particle filter.
struct MonteCarloOptions {
  /// Particle injection: replaces some particles by new ones at each image, so that a kidnapped
  /// robot is localised again.
  enum class Injection {
    none,       ///< none
    explained,  ///< number by Bayes' rule from the view's likelihood elsewhere
  };

  int min_particles = 200;      ///< >= 1; number of particles for one narrow mode
  int max_particles = 5000;     ///< number of particles when the robot may be anywhere
  double kld_error = 0.05;      ///< largest error (Kullback-Leibler) of the particles' distribution
  double resample_below = 0.5;  ///< smallest effective sample size, as a share of the particles
  bool compass = true;          ///< the visual compass also weights the particles' headings
  Injection injection = Injection::explained;  ///< how new particles are sampled
  int reranked_views = 1000;  ///< compared column by column if no near view explains the image
  int seed = 1;               ///< of all random choices, >= 0
};
void visit_options(MonteCarloOptions& options, OptionVisitor& visitor);

/// Certainty of the estimated position.
enum class LocalisationState {
  localised,  ///< one mode, no wider than the references' resolution, explains the views
  /// As `localised`, but the heading is not known: the views of the memory have none, or a place
  /// looks the same in two directions.
  position_known,
  ambiguous,  ///< the views fit the memory, but at several places or in a large area
  lost,       ///< the views do not fit the memory, or odometry has left its area
};
/// Returns "localised", "position_known", "ambiguous" or "lost".
[[nodiscard]] std::string_view to_string(LocalisationState state);

/// Estimate of the filter after an image.
struct MonteCarloEstimate {
  LocalisationState state = LocalisationState::lost;  ///< certainty
  /// Modes with at least 1 % of the weight, heaviest first. They are separated by position and
  /// heading; by position alone if the heading is not known. Covariance and spread are those of the
  /// position error. They are larger than the particles', because the filter ignores that errors of
  /// successive views and of travel are correlated (docs/decisions.md).
  std::vector<PoseMode> modes;
  /// Mean of the heaviest mode; nullopt when lost or if the heading is not known.
  std::optional<Pose2> pose;
  std::optional<Point2> position;    ///< mean of the heaviest mode; nullopt when lost
  double spread_m = 0.0;             ///< root mean square distance of all particles from their mean
  int particles = 0;                 ///< number of particles, chosen by KLD sampling
  double effective_particles = 0.0;  ///< effective sample size before resampling
  bool resampled = false;            ///< particles were resampled after this image
  int injected = 0;                  ///< number of particles replaced by new ones
  /// Smallest difference (`ColumnMatch`) between the view and the references near the particles;
  /// nullopt if none was compared.
  std::optional<double> difference_here;
  std::optional<double> difference_anywhere;  ///< smallest difference to any reference
  /// Logarithm of the view's mean likelihood over the particles, relative to an unexplained view.
  double log_ratio_here = 0.0;
  double log_ratio_anywhere = 0.0;  ///< the same over all places (only `Injection::explained`)
  double p_inside = 0.0;            ///< probability of being in the memorised area; lost if < 0.5
  /// Probability that the robot is at the heaviest mode: `p_inside` times the mode's weight, less
  /// if the last image fits another place better. Of estimates with at least 0.9 inside the
  /// memorised area, more than 90 % are right (docs/decisions.md).
  double probability = 0.0;
  std::uint64_t views_compared = 0;  ///< column by column
  /// Returns the floor of the heaviest mode; empty without modes, or if the floor has no name.
  [[nodiscard]] std::string_view floor() const noexcept {
    return modes.empty() ? std::string_view{} : modes.front().floor;
  }
};

/// Localises a robot by a particle filter over the posed views of a memory [M03 section 4].
///
/// Localises a robot with an unknown start within a few images, tracks it by odometry while images
/// are missing or uninformative, and relocalises it after a kidnapping. Keeps several modes if
/// places look similar. Runs in the calling thread. Deterministic.
class MonteCarloLocaliser {
 public:
  /// Result of an injection rule for one image.
  struct InjectedParticles {
    std::size_t count = 0;       ///< number of particles replaced by new ones
    std::vector<ViewId> around;  ///< references around which new ones are sampled; empty: anywhere
  };
  /// Decides which particles to inject, from the image's signature and the number of particles.
  using InjectionRule =
      std::function<InjectedParticles(const PackedSignature& view, std::size_t particles)>;

  /// Starts anywhere in the memorised area, with any heading. The memory must outlive *this and
  /// must not change. Throws OptionError; ContractError like `learn_observation_model`.
  explicit MonteCarloLocaliser(const VisualMemory& memory, const MonteCarloOptions& options = {},
                               const OdometryNoise& odometry = {});
  /// Uses a model learnt before.
  MonteCarloLocaliser(std::shared_ptr<const ColumnRanking> ranking, const ObservationModel& model,
                      const MonteCarloOptions& options = {}, const OdometryNoise& odometry = {});
  /// Uses views that are not held in RAM; holds only their positions, 200 bytes each. `open_index`
  /// opens an index of the views for each image (`IndexedMemory::index`); its exceptions are passed
  /// on by all functions that read views. `shape`: of the views' signatures.
  MonteCarloLocaliser(std::function<std::unique_ptr<ViewIndex>()> open_index, SignatureShape shape,
                      const ObservationModel& model, const MonteCarloOptions& options = {},
                      const OdometryNoise& odometry = {});
  ~MonteCarloLocaliser();
  /// The source of a move may only be destroyed or assigned to.
  MonteCarloLocaliser(MonteCarloLocaliser&&) noexcept;
  MonteCarloLocaliser& operator=(MonteCarloLocaliser&&) noexcept;

  /// Sets a rule that injects particles before each image is weighed, in addition to
  /// `options.injection` [M03 section 4.1]. An empty rule injects none.
  void set_injection_rule(InjectionRule rule);

  /// Restarts anywhere in the memorised area. `heading_rad`: heading of all particles; random if
  /// nullopt.
  void start_globally(std::optional<double> heading_rad = std::nullopt);
  /// Restarts around a known pose. `deviation_m`: standard deviation of x and of y, >= 0.
  void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad);

  /// Sets the noise of all later steps. Throws OptionError.
  void set_odometry_noise(const OdometryNoise& noise);
  /// Moves the particles by a step of the odometry (robot_old_from_robot_new) with its noise. Any
  /// number of steps may come between two images.
  void move(const Pose2& step);

  /// Adds noise of zero mean to all particles, for a motion of which nothing is known.
  /// `deviation_m`: standard deviation of x and of y; both >= 0 and finite.
  void spread(double deviation_m, double heading_deviation_rad);

  /// Reloads the positions of the memory's views after views were added or removed. Keeps the
  /// particles. Throws ContractError, without any change, if no view has a position.
  void update_views();
  /// Returns the view that is nearest to the position. Cost: linear in the views.
  [[nodiscard]] ViewId find_nearest_view(Point2 position) const;

  /// Weighs the particles by an image and returns the new estimate. Throws ContractError on a
  /// signature of another shape than the memory's; FileError, with the estimate unchanged, if views
  /// cannot be read.
  MonteCarloEstimate observe(const PackedSignature& view);
  /// Weighs the particles by the answer of a localiser to an image (`SectorLocaliser`): its places
  /// with their probabilities, positions and headings. Answers from nearly one position count less
  /// than others, like views. Differences of the estimate are those of views, so they stay empty.
  MonteCarloEstimate observe(const Place& place);
  /// Returns the present estimate, without a new image.
  [[nodiscard]] MonteCarloEstimate estimate() const;

  /// Returns the particles after the last step.
  [[nodiscard]] const Particles& particles() const noexcept;
  /// Returns the observation model of the memory.
  [[nodiscard]] const ObservationModel& model() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
