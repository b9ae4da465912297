#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/observation_model.hpp"

namespace panonav {

struct PoseWitness;

/// Limits of a memory: how many views it keeps, and when one is forgotten.
struct MemoryUpdateOptions {
  int appearances = 3;  ///< largest number of views of one place
  int failures = 10;    ///< successive runs in which a view must fail before it is forgotten
  int max_views = 0;    ///< largest size of the memory; 0: `appearances` times its places
};
void visit_options(MemoryUpdateOptions& options, OptionVisitor& visitor);

/// Decides which views a run adds to a memory and which it removes. At each certain pose
/// (`find_witnessed_pose`), compares the robot's view with the references around the pose. A
/// reference explains the view if their similarity is at least half of that expected at their
/// distance (`ObservationModel`).
/// - A reference that explains the view is reinforced. One that does not, while another does, has
///   failed; it is forgotten after `failures` successive runs.
/// - A view that no reference explains is added, at most once a run for each place; if the place
///   has `appearances` views, it replaces the least useful one.
/// - A place keeps at least one view.
///
/// Cost: 10 microseconds for each reference. Holds at most 128 images.
class MemoryUpdate {
 public:
  /// Statistics of earlier runs, to be stored with the memory and passed to its next update.
  struct UseStatistics {
    /// Statistics of one view.
    struct View {
      int matched = 0;      ///< runs in which the view explained the robot's view at its place
      int failed = 0;       ///< successive runs in which only another view of the place did so
      int last_run = 0;     ///< last run in which the view matched or was added; 0: none
      bool learnt = false;  ///< added by an update
      friend bool operator==(const View&, const View&) = default;
    };

    int runs = 0;  ///< number of runs that have updated the memory
    /// Spacing of the memory before its first update; 0 before the first update. Later, places have
    /// several views, so spacing and similarity of the references would be measured too small.
    double spacing_m = 0.0;
    double far_difference = 0.0;   ///< `ObservationModel::far_difference` of that memory
    double range_m = 0.0;          ///< `ObservationModel::range_m` of that memory
    int places = 0;                ///< number of places of that memory and of those added later
    int size = 0;                  ///< number of views of the memory after the last update
    std::map<ViewId, View> views;  ///< views that have matched or failed
    friend bool operator==(const UseStatistics&, const UseStatistics&) = default;
  };

  /// One image of a run, localised in the memory as it was at the beginning of the run.
  struct LocalisedView {
    Pose2 odometry;                  ///< absolute, in its own frame
    PackedSignature signature;       ///< of the image, in the memory's shape
    double probability = 0.0;        ///< of the localised place (`Place::probability`)
    std::optional<Pose2> pose;       ///< estimated; nullopt if position or heading is unknown
    std::optional<double> radius_m;  ///< contains the true position in 95 % of the cases
  };

  /// Changes of the memory by one run.
  struct Changes {
    /// An image of the run that becomes a view.
    struct Added {
      std::size_t number = 0;  ///< of the image in the run
      ReferencePose pose;      ///< certain pose at which it was taken
    };
    std::vector<Added> added;       ///< ascending
    std::vector<ViewId> replaced;   ///< removed for an added one; ascending
    std::vector<ViewId> forgotten;  ///< removed after too many failures; ascending
    std::vector<ViewId> matched;    ///< ascending
    std::size_t sure = 0;           ///< number of images that were localised surely
    std::size_t certain = 0;        ///< number of images whose pose was certain
    UseStatistics use;              ///< to be stored; without the added views and their number
  };

  /// `ranking` and its memory must outlive *this and not change. Throws OptionError.
  MemoryUpdate(const ColumnRanking& ranking, const ObservationModel& model, UseStatistics use,
               const MemoryUpdateOptions& options = {});

  /// Adds the next image; images are numbered from 0 in the order of these calls. Ignores an image
  /// taken less than a quarter of a spacing from the previous one, since it shows nothing new.
  void add(LocalisedView view);
  /// True if the image may still become a view of the memory: it was chosen or is not decided yet.
  [[nodiscard]] bool can_become_view(std::size_t number) const;
  /// True if the robot was localised with certainty shortly before the last image, so that this
  /// image's pose may become certain.
  [[nodiscard]] bool is_near_known_place() const;
  /// Decides the remaining images and returns all changes. Call it last.
  [[nodiscard]] Changes finish();

 private:
  struct Image {
    std::size_t number = 0;
    double travelled_m = 0.0;
    LocalisedView view;
    [[nodiscard]] std::optional<PoseWitness> witness() const;
  };
  struct Chosen {
    std::size_t number = 0;
    Pose2 pose;
    bool is_explained = false;
  };
  void decide_image(std::size_t index);
  void decide_ready_images(bool all);
  [[nodiscard]] std::optional<Pose2> find_certain_pose(std::size_t index) const;
  [[nodiscard]] std::vector<ViewId> find_views_around(Point2 position, double radius_m) const;
  [[nodiscard]] bool is_less_useful(ViewId a, ViewId b) const;

  const ColumnRanking* ranking_;
  UseStatistics use_;
  MemoryUpdateOptions options_;
  std::deque<Image> images_;  // images before `undecided_` only serve as witnesses
  std::size_t undecided_ = 0;
  std::size_t image_count_ = 0;
  std::size_t sure_count_ = 0;
  std::size_t certain_count_ = 0;
  std::set<ViewId> matched_;
  std::set<ViewId> failed_;
  std::vector<Chosen> chosen_;
};

}  // namespace panonav
