#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/observation_model.hpp"

namespace panonav {

/// How many views a memory may keep, and when one is forgotten.
struct MemoryUpdateOptions {
  int appearances = 3;  ///< views of one place that stand beside each other, at most
  int failures = 10;    ///< runs in a row in which a view failed before it is forgotten
  int max_views = 0;    ///< of the memory; 0: `appearances` times its places
};
void visit_options(MemoryUpdateOptions& options, OptionVisitor& visitor);

/// What updates of a memory know of the runs before. Plain numbers, so that they can be kept beside
/// the memory.
struct MemoryUse {
  /// How useful a view has been.
  struct View {
    int matched = 0;      ///< runs in which it explained what a robot saw at its place
    int failed = 0;       ///< runs in a row in which it did not and another view of the place did
    int last_run = 0;     ///< in which it matched or was learnt; 0: none
    bool learnt = false;  ///< by an update
    friend bool operator==(const View&, const View&) = default;
  };

  int runs = 0;  ///< that the memory was updated by
  /// Of the memory before its first update: appearances of a place make references seem nearer to
  /// each other and less alike than places are. 0 before that.
  double spacing_m = 0.0;
  double far_difference = 0.0;  ///< of the same memory, as `ObservationModel` has it
  double range_m = 0.0;         ///< of the same memory, as `ObservationModel` has it
  /// Views of the memory before its first update, and of places that came later.
  int places = 0;
  int size = 0;                  ///< views of the memory after the last update
  std::map<ViewId, View> views;  ///< those that have been used
  friend bool operator==(const MemoryUse&, const MemoryUse&) = default;
};

/// Where a robot certainly was when it took a picture: by the answers to *other* pictures of the
/// run, carried there by odometry. At least three sure answers (known with 0.9 and more) within
/// `reach_m` of travel, by pictures that lie two spacings apart, must agree on a pose, and four
/// fifths of all sure answers there; the picture's own answer only makes the pose more precise. So
/// a camera that was turned, a place that resembles another and a kidnapped robot say nothing.
/// `others` without the picture itself; `travelled_m`: from the picture to each of them.
struct PoseWitness {
  Pose2 odometry;            ///< at the picture that was answered, in the odometry's frame
  Pose2 pose;                ///< of the answer, in the frame of the memory's positions
  double radius_m = 0.0;     ///< of the answer: holds its position in 95 % of the cases
  double travelled_m = 0.0;  ///< between it and the picture, >= 0
};
/// The pose on which the witnesses agree; empty where they are too few, too near to each other or
/// of different minds. `odometry`: at the picture; `own`: its own answer, where that was sure.
/// `spacing_m`: of the references. Cost: the square of the number of witnesses.
[[nodiscard]] std::optional<Pose2> witnessed_pose(const Pose2& odometry,
                                                  std::span<const PoseWitness> witnesses,
                                                  const std::optional<PoseWitness>& own,
                                                  double spacing_m);

/// Decides what a robot's run through its memory's places changes there, so that the memory stays
/// true while the places change. Where the robot certainly was (`witnessed_pose`), the references
/// around are compared with what it saw:
/// - one that explains the view is reinforced;
/// - one that does not while another does has failed;
/// - where none does, the view is added as another appearance of the place, one a run at most;
///   where one does but the answer to this picture was unsure or wrong, only if there is room. Of
///   more than `appearances` within half a spacing the least useful one is replaced: one that never
///   matched since it was learnt, else the one that failed in most runs in a row, else the one that
///   matched longest ago.
/// A view that failed in `failures` runs in a row is forgotten. A place keeps at least one view,
/// and the memory never has more than `max_views`.
///
/// Explained is a view at distance d from a reference if their similarity (`ObservationModel`) is
/// at least half of what was expected there before the first update. Cost: a comparison with each
/// reference around, 10 microseconds each. Holds at most 128 pictures of the run. Same run: same
/// changes.
class MemoryUpdate {
 public:
  /// One picture of a run, as a `Localiser` answered it by the memory that the run began with.
  struct AnsweredView {
    Pose2 odometry;                  ///< absolute, in its own frame
    PackedSignature signature;       ///< of the picture, as the memory compares it
    double known_probability = 0.0;  ///< of the answer
    std::optional<Pose2> pose;  ///< of the answer; empty where position or heading is not known
    std::optional<double> radius_m;  ///< of 95 %, of the position
  };

  /// What a run changes in its memory.
  struct Changes {
    /// A picture of the run that becomes a view.
    struct Added {
      std::size_t number = 0;  ///< of the picture in the run
      ReferencePose pose;      ///< where it certainly was taken, with its heading
    };
    std::vector<Added> added;       ///< ascending
    std::vector<ViewId> replaced;   ///< dropped for an added one; ascending
    std::vector<ViewId> forgotten;  ///< dropped because others have long been better; ascending
    std::vector<ViewId> matched;    ///< ascending
    std::size_t certain = 0;        ///< pictures whose place was certain
    MemoryUse use;  ///< to keep; knows nothing yet of what is added, nor the new size
  };

  /// `ranking` and its memory must outlive *this and not change. Throws OptionError.
  MemoryUpdate(const ColumnRanking& ranking, const ObservationModel& model, MemoryUse use = {},
               const MemoryUpdateOptions& options = {});

  /// The next picture; its number is the count of those before. One that lies less than a quarter
  /// of a spacing from the one before tells nothing new and is left out.
  void add(AnsweredView view);
  /// Whether the picture may still be added to the memory: it waits for a decision or was chosen.
  [[nodiscard]] bool can_become_view(std::size_t number) const;
  /// The last picture lies within the reach of a sure answer before it, so that it may become
  /// certain.
  [[nodiscard]] bool is_near_known_place() const;
  /// Decides what still waits. Nothing may be added afterwards.
  [[nodiscard]] Changes finish();

 private:
  struct Picture {
    std::size_t number = 0;
    double travelled_m = 0.0;
    AnsweredView view;
    [[nodiscard]] std::optional<PoseWitness> witness() const;
  };
  struct Chosen {
    std::size_t number = 0;
    Pose2 pose;
    bool explained = false;
  };
  void decide(std::size_t index);
  void decide_ready(bool all);
  [[nodiscard]] std::vector<ViewId> around(Point2 position, double radius_m) const;
  [[nodiscard]] bool is_less_useful(ViewId a, ViewId b) const;

  const ColumnRanking* ranking_;
  MemoryUse use_;
  MemoryUpdateOptions options_;
  std::deque<Picture> pictures_;  ///< those before `undecided_` are witnesses only
  std::size_t undecided_ = 0;
  std::size_t count_ = 0;
  std::size_t certain_ = 0;
  std::set<ViewId> matched_;
  std::set<ViewId> failed_;
  std::vector<Chosen> chosen_;
};

}  // namespace panonav
