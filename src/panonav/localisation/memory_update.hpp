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

/// Limits of a memory: the views it may keep, and when one is forgotten.
struct MemoryUpdateOptions {
  int appearances = 3;  ///< views of one place, at most
  int failures = 10;    ///< runs in a row in which a view failed before it is forgotten
  int max_views = 0;    ///< of the memory; 0: `appearances` times its places
};
void visit_options(MemoryUpdateOptions& options, OptionVisitor& visitor);

/// Decides which changes a run through the places of a memory makes there. Where the robot
/// certainly was (`find_witnessed_pose`), the references around are compared with its view; one
/// explains it if their similarity is at least half of that expected at their distance
/// (`ObservationModel`).
/// - A reference that explains the view is reinforced; one that does not while another does has
///   failed, and is forgotten after `failures` runs in a row.
/// - If none does, the view is added, one a run at most. Of more than `appearances` the least
///   useful is replaced.
/// - A place keeps at least one view.
///
/// Cost: 10 microseconds for each reference around. Holds at most 128 images of the run. Same run:
/// same changes.
class MemoryUpdate {
 public:
  /// Knowledge of earlier runs that updates of a memory need. Plain numbers, to be stored with the
  /// memory.
  struct Use {
    /// Usefulness of one view so far.
    struct View {
      int matched = 0;   ///< runs in which it explained the robot's view at its place
      int failed = 0;    ///< runs in a row in which another view of the place did, but not this one
      int last_run = 0;  ///< in which it matched or was learnt; 0: none
      bool learnt = false;  ///< by an update
      friend bool operator==(const View&, const View&) = default;
    };

    int runs = 0;  ///< by which the memory was updated
    /// Of the memory before its first update: appearances of a place make references seem nearer to
    /// each other and less similar than places are. 0 before that.
    double spacing_m = 0.0;
    double far_difference = 0.0;   ///< `ObservationModel::far_difference` of the same memory
    double range_m = 0.0;          ///< `ObservationModel::range_m` of the same memory
    int places = 0;                ///< views of the same memory, and of places that came later
    int size = 0;                  ///< views of the memory after the last update
    std::map<ViewId, View> views;  ///< those that have been used
    friend bool operator==(const Use&, const Use&) = default;
  };

  /// One image of a run, as a `Localiser` answered it by the memory at the beginning of the run.
  struct AnsweredView {
    Pose2 odometry;                  ///< absolute, in its own frame
    PackedSignature signature;       ///< of the image, as the memory compares it
    double known_probability = 0.0;  ///< of the answer
    std::optional<Pose2> pose;  ///< of the answer; nullopt where position or heading is unknown
    std::optional<double> radius_m;  ///< of 95 %, of the position
  };

  /// Changes that a run makes in its memory.
  struct Changes {
    /// An image of the run that becomes a view.
    struct Added {
      std::size_t number = 0;  ///< of the image in the run
      ReferencePose pose;      ///< where it certainly was taken, with its heading
    };
    std::vector<Added> added;       ///< ascending
    std::vector<ViewId> replaced;   ///< dropped for an added one; ascending
    std::vector<ViewId> forgotten;  ///< dropped because others have long been better; ascending
    std::vector<ViewId> matched;    ///< ascending
    std::size_t certain = 0;        ///< images whose place was certain
    Use use;                        ///< to store; without the added views and the new size
  };

  /// `ranking` and its memory must outlive *this and not change. Throws OptionError.
  MemoryUpdate(const ColumnRanking& ranking, const ObservationModel& model, Use use,
               const MemoryUpdateOptions& options = {});

  /// Adds the next image; its number is the count of those before. One that lies less than a
  /// quarter of a spacing from the one before shows nothing new and is left out.
  void add(AnsweredView view);
  /// True if the image may still be added to the memory: it waits for a decision or was chosen.
  [[nodiscard]] bool can_become_view(std::size_t number) const;
  /// True if the last image is within reach of a certain answer before it, so that it may become
  /// certain.
  [[nodiscard]] bool is_near_known_place() const;
  /// Decides the remaining images. Nothing may be added afterwards.
  [[nodiscard]] Changes finish();

 private:
  struct Image {
    std::size_t number = 0;
    double travelled_m = 0.0;
    AnsweredView view;
    [[nodiscard]] std::optional<PoseWitness> witness() const;
  };
  struct Chosen {
    std::size_t number = 0;
    Pose2 pose;
    bool is_explained = false;
  };
  void decide(std::size_t index);
  void decide_ready_images(bool all);
  [[nodiscard]] std::optional<Pose2> find_certain_pose(std::size_t index) const;
  [[nodiscard]] std::vector<ViewId> views_around(Point2 position, double radius_m) const;
  [[nodiscard]] bool is_less_useful(ViewId a, ViewId b) const;

  const ColumnRanking* ranking_;
  Use use_;
  MemoryUpdateOptions options_;
  std::deque<Image> images_;  // those before `undecided_` are witnesses only
  std::size_t undecided_ = 0;
  std::size_t count_ = 0;
  std::size_t certain_ = 0;
  std::set<ViewId> matched_;
  std::set<ViewId> failed_;
  std::vector<Chosen> chosen_;
};

}  // namespace panonav
