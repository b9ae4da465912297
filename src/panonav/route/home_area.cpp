#include "panonav/route/home_area.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"
#include "panonav/route/packed_snapshot.hpp"
#include "panonav/route/snapshot_pair.hpp"

namespace panonav {

namespace {

// Distance between views that are kept.
constexpr double kept_walk_spacing_m = 0.1;
// Views that are compared; more of them are thinned out evenly.
constexpr std::size_t max_compared_views = 400;
// Home vectors are judged relative to their length, but not to less than this, and only farther
// away from home have they a direction.
constexpr double min_judged_m = 0.5;
// A snapshot must improve the home vectors of the views by this part of the loss of a view without
// one; less is noise.
constexpr double min_gain = 0.5;
// The walk is at home again where the home vector is short, the view similar and where odometry
// allows it, after a way on which it has left home.
constexpr double max_return_m = 0.5;
constexpr double min_return_correlation = 0.8;
constexpr double max_odometry_error = 0.25;  // of the way
constexpr double min_way_m = 2.0;
// Legs of this length can be packed, a centimetre of rounding included.
constexpr double max_leg_m = SnapshotChain::max_leg_m - 0.02;

// Returns the relative error of a home vector, at most 1.
double home_vector_loss(Point2 estimated, Point2 place) {
  const double error_m = std::hypot(estimated.x_m + place.x_m, estimated.y_m + place.y_m);
  return std::min(1.0, error_m / std::max(min_judged_m, distance(place, {})));
}

// Returns the robot's displacement to the snapshot along the axes of the snapshot's frame.
Point2 displacement_m(const HomeVector& vector, double typical_distance_m) {
  return Pose2{0.0, 0.0, -vector.heading_rad} *
         Point2{typical_distance_m * vector.xi, typical_distance_m * vector.eta};
}

// Returns the value below which this part of the values is; `otherwise` if there are none.
double quantile_or(std::vector<double> values, double part, double otherwise) {
  if (values.empty()) return otherwise;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Returns the largest distance up to which nine of ten home vectors are right.
double find_reach_m(const std::vector<SnapshotPair>& pairs) {
  constexpr double right_share = 0.9;
  std::vector<std::pair<double, bool>> by_distance;
  for (const SnapshotPair& pair : pairs) {
    if (pair.distance_m >= min_judged_m) by_distance.emplace_back(pair.distance_m, pair.is_right);
  }
  std::sort(by_distance.begin(), by_distance.end());
  double reach_m = min_judged_m;
  double right = 0.0;
  double all = 0.0;
  for (const auto& [distance_m, is_right] : by_distance) {
    all += 1.0;
    right += is_right ? 1.0 : 0.0;
    if (right >= right_share * all) reach_m = distance_m;
  }
  return reach_m;
}

// Learns the model of an area. A view that is as similar as half of those 0.3 m away is beside a
// snapshot, unless one of a hundred farther ones is as similar. Of views far from a snapshot, one
// of a hundred may seem confident.
ChainModel learn_area_model(const std::vector<SnapshotPair>& pairs) {
  constexpr double wrong_share = 0.01;
  const std::array<double, 1> reach_m{find_reach_m(pairs)};
  ChainModel model = learn_chain_model(pairs, reach_m);
  constexpr double beside_m = 0.4;
  std::vector<double> beside;
  std::vector<double> differences;
  std::vector<double> confidences;
  for (const SnapshotPair& pair : pairs) {
    if (pair.distance_m > min_judged_m) {
      differences.push_back(pair.difference);
    } else if (pair.distance_m >= min_compared_m && pair.distance_m <= beside_m) {
      beside.push_back(pair.difference);
    }
    if (pair.distance_m > max_compared_m) confidences.push_back(pair.confidence);
  }
  const auto learnt = static_cast<double>(model.arrived_difference);
  model.arrived_difference =
      static_cast<float>(std::min(quantile_or(std::move(beside), 0.5, learnt),
                                  quantile_or(std::move(differences), wrong_share, learnt)));
  model.homing_confidence = static_cast<float>(quantile_or(
      std::move(confidences), 1.0 - wrong_share, static_cast<double>(model.homing_confidence)));
  return model;
}

// A view of the walk at heading 0 and its place.
struct LevelView {
  HomingView view;
  Pose2 pose;
};

// Chooses the snapshots of an area.
class SnapshotChoice {
 public:
  // Compares all views with all candidates.
  SnapshotChoice(const std::vector<LevelView>& candidates, const std::vector<LevelView>& held_out,
                 const SnapshotShape& shape, Executor& executor)
      : candidates_(candidates), held_out_(held_out), best_(held_out.size()) {
    std::vector<HomingView> snapshots;
    for (const LevelView& candidate : candidates) {
      const SnapshotShape packed = snapshots.empty() ? make_fine(shape) : shape;
      snapshots.push_back(unpack_snapshot(pack_snapshot(candidate.view, packed), packed,
                                          candidate.view.elevations()));
    }
    std::vector<SnapshotPair> pairs(held_out.size() * candidates.size());
    vectors_.resize(pairs.size());
    executor.for_each_chunk(
        held_out.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
          for (std::size_t i = begin * candidates.size(); i < end * candidates.size(); ++i) {
            const LevelView& view = held_out[i / candidates.size()];
            const std::size_t c = i % candidates.size();
            pairs[i] = compare(snapshots[c], candidates[c].pose.position(), view, vectors_[i]);
          }
        });
    model_ = learn_area_model(pairs);
    judge_vectors(pairs);
  }

  // Adds a snapshot: of all snapshots, a robot uses the one of the greatest confidence.
  void take(std::size_t candidate) {
    for (std::size_t v = 0; v < held_out_.size(); ++v) {
      const Vector& vector = vectors_[v * candidates_.size() + candidate];
      if (vector.confidence > best_[v].confidence) best_[v] = vector;
    }
  }

  // Returns the candidate that improves the home vectors most; nullopt if none does.
  [[nodiscard]] std::optional<std::size_t> find_next() const {
    std::optional<std::size_t> next;
    double max_gain = min_gain;
    for (std::size_t c = 1; c < candidates_.size(); ++c) {
      double gain = 0.0;
      for (std::size_t v = 0; v < held_out_.size(); ++v) {
        const Vector& vector = vectors_[v * candidates_.size() + c];
        if (vector.confidence > best_[v].confidence) gain += best_[v].loss - vector.loss;
      }
      if (gain > max_gain) max_gain = gain, next = c;
    }
    return next;
  }

  [[nodiscard]] const ChainModel& model() const { return model_; }
  // Returns the home vectors of the snapshots taken so far.
  [[nodiscard]] std::vector<HeldOutView> home_vectors() const {
    std::vector<HeldOutView> views;
    for (std::size_t v = 0; v < held_out_.size(); ++v) {
      HeldOutView& view = views.emplace_back(HeldOutView{held_out_[v].pose, std::nullopt});
      if (best_[v].confidence > -1.0) view.home_vector = best_[v].home;
    }
    return views;
  }

 private:
  // A home vector by a snapshot, its error and how sure it is.
  struct Vector {
    double confidence = -1.0;
    double loss = 1.0;
    Point2 home;  // in units of R to the snapshot at first, then in metres to home
  };

  static SnapshotPair compare(const HomingView& snapshot, Point2 place, const LevelView& view,
                              Vector& vector) {
    const SnapshotSight sight = look_at_snapshot(view_coefficients(snapshot),
                                                 view_coefficients(view.view), compared_headings);
    vector.home = displacement_m(sight.vector, 1.0);
    const Point2 from = view.pose.position();
    const bool is_right =
        sight.vector.length() > 0.0 &&
        is_right_direction(std::atan2(vector.home.y_m, vector.home.x_m), from, place);
    return {distance(from, place), sight.vector.length(), sight.difference, sight.confidence,
            is_right};
  }

  // Vectors that a robot would not use count as none.
  void judge_vectors(const std::vector<SnapshotPair>& pairs) {
    const auto r_m = static_cast<double>(model_.typical_distance_m);
    for (std::size_t i = 0; i < vectors_.size(); ++i) {
      const Point2 snapshot = candidates_[i % candidates_.size()].pose.position();
      Vector& vector = vectors_[i];
      vector.home = {r_m * vector.home.x_m - snapshot.x_m, r_m * vector.home.y_m - snapshot.y_m};
      vector.confidence = usable_confidence(pairs[i].confidence, pairs[i].difference, model_);
      if (vector.confidence <= -1.0) continue;
      vector.loss =
          home_vector_loss(vector.home, held_out_[i / candidates_.size()].pose.position());
    }
  }

  const std::vector<LevelView>& candidates_;
  const std::vector<LevelView>& held_out_;
  std::vector<Vector> vectors_;  // of all candidates, view by view
  std::vector<Vector> best_;     // of the snapshots taken, for each view
  ChainModel model_;
};

struct ChosenArea {
  HomeArea area;
  bool is_full = false;  // a further snapshot would have improved the home vectors
};

// Chooses the snapshots of an area, the first candidate among them, and packs them.
ChosenArea choose_area(const std::vector<LevelView>& candidates,
                       const std::vector<LevelView>& held_out, const SnapshotShape& shape,
                       std::size_t max_bytes, Executor& executor) {
  SnapshotChoice choice(candidates, held_out, shape, executor);
  ChosenArea chosen{.area = {.chain = SnapshotChain(shape, candidates.front().view.elevations()),
                             .held_out = {}}};
  SnapshotChain& chain = chosen.area.chain;
  std::size_t bytes =
      ChainHeader::bytes - ChainLeg::bytes + make_fine(shape).bytes() - shape.bytes();
  const std::size_t snapshot_bytes = ChainLeg::bytes + shape.bytes();
  for (std::optional<std::size_t> next = 0; next; next = choice.find_next()) {
    const Point2 place = candidates[*next].pose.position();
    const bool is_far =
        !chain.nodes().empty() && distance(place, chain.nodes().back().position) > max_leg_m;
    const std::size_t added = snapshot_bytes + (is_far ? ChainLeg::bytes : 0);
    if (bytes + added > max_bytes) {
      chosen.is_full = true;
      break;
    }
    bytes += added;
    if (is_far) chain.append({}, std::nullopt);  // legs by way of home
    chain.append(place, candidates[*next].view);
    choice.take(*next);
  }
  chain.set_model(choice.model());
  chosen.area.held_out = choice.home_vectors();
  return chosen;
}

}  // namespace

void visit_options(HomeAreaOptions& options, OptionVisitor& visitor) {
  using T = HomeAreaOptions;
  constexpr OptionTable table{
      option<&T::max_bytes>("largest size of the area around home, in bytes", 200, 1'000'000),
  };
  table.visit(options, visitor);
}

double HomeArea::homeward_component() const {
  double sum = 0.0;
  std::size_t count = 0;
  for (const HeldOutView& view : held_out) {
    const double home_m = distance(view.pose.position(), {});
    if (home_m <= min_judged_m) continue;
    ++count;
    if (!view.home_vector) continue;
    const double length_m = distance(*view.home_vector, {});
    if (length_m == 0.0) continue;
    sum -= (view.home_vector->x_m * view.pose.x_m + view.home_vector->y_m * view.pose.y_m) /
           (length_m * home_m);
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

HomeAreaLearner::HomeAreaLearner(const SnapshotShape& shape, const HomeAreaOptions& options)
    : shape_(shape), options_(options) {
  validate(shape_);
  validate(options_);
  const std::size_t fewest = ChainHeader::bytes + make_fine(shape_).bytes();
  require(static_cast<std::size_t>(options_.max_bytes) >= fewest, "max_bytes", options_.max_bytes,
          ">= " + to_text(static_cast<double>(fewest)) + " for one snapshot");
}

void HomeAreaLearner::add(const HomingView& view, const Pose2& moved) {
  require(is_finite(moved), "motion between views", moved.x_m, "finite");
  if (!views_.empty()) {
    require(view.elevations() == views_.front().view.elevations(), "elevations of a view", 0.0,
            "those of the first view");
    pose_ = pose_ * moved;
    path_m_ += std::hypot(moved.x_m, moved.y_m);
    if (path_m_ < views_.back().path_m + kept_walk_spacing_m) return;
  }
  views_.push_back({reduce_view(view, shape_.rows, shape_.components), pose_, path_m_});
}

// R from the first metres of the walk, over which odometry is right.
double HomeAreaLearner::estimate_typical_distance_m() const {
  std::vector<double> scales_m;
  for (const WalkedView& walked : views_) {
    if (walked.path_m > max_compared_m) break;
    const double away_m = distance(walked.pose.position(), {});
    if (away_m < min_compared_m) continue;
    const HomeVector vector = home_vector(views_.front().view, walked.view);
    const Point2 home = displacement_m(vector, 1.0);
    if (vector.length() > 0.0 &&
        is_right_direction(std::atan2(home.y_m, home.x_m), walked.pose.position(), {})) {
      scales_m.push_back(away_m / vector.length());
    }
  }
  if (scales_m.empty()) return static_cast<double>(ChainModel{}.typical_distance_m);
  const auto middle = scales_m.begin() + static_cast<std::ptrdiff_t>(scales_m.size() / 2);
  std::nth_element(scales_m.begin(), middle, scales_m.end());
  return *middle;
}

std::vector<HomeAreaLearner::Return> HomeAreaLearner::find_returns(
    double typical_distance_m) const {
  std::vector<Return> returns{{}};
  double min_difference = 2.0;
  bool is_open = false;  // the last return may still become a better one
  for (std::size_t i = 1; i < views_.size(); ++i) {
    const WalkedView& walked = views_[i];
    const double since_m = walked.path_m - views_[returns.back().index].path_m;
    is_open = is_open && since_m < min_way_m;
    if (!is_open && since_m < min_way_m) continue;
    const SnapshotSight sight = look_at_snapshot(view_coefficients(views_.front().view),
                                                 view_coefficients(walked.view), {});
    if (sight.vector.correlation < min_return_correlation ||
        (is_open && sight.difference > min_difference)) {
      continue;
    }
    const Point2 home = displacement_m(sight.vector, typical_distance_m);
    const Return found{i, {-home.x_m, -home.y_m, wrap_angle(-sight.vector.heading_rad)}};
    const Return& before = is_open ? returns[returns.size() - 2] : returns.back();
    const double way_m = walked.path_m - views_[before.index].path_m;
    const Pose2 by_odometry = before.pose * (inverse(views_[before.index].pose) * walked.pose);
    if (distance(home, {}) > max_return_m ||
        distance(by_odometry.position(), found.pose.position()) >
            max_return_m + max_odometry_error * way_m) {
      continue;
    }
    if (is_open) {
      returns.back() = found;
    } else {
      returns.push_back(found);
    }
    is_open = true;
    min_difference = sight.difference;
  }
  return returns;
}

// Shares out the error of odometry between returns evenly along the path; after the last one the
// errors for each metre continue.
std::vector<Pose2> HomeAreaLearner::correct_poses(const std::vector<Return>& returns) const {
  std::vector<Pose2> poses(views_.size());
  double turn_rad_per_m = 0.0;
  Point2 drift_m_per_m;
  for (std::size_t r = 0; r < returns.size(); ++r) {
    const std::size_t first = returns[r].index;
    const bool is_last = r + 1 == returns.size();
    const std::size_t end = is_last ? views_.size() - 1 : returns[r + 1].index;
    const double path_m = views_[end].path_m - views_[first].path_m;
    const auto chain = [&](std::size_t i) {
      const Pose2 moved = inverse(views_[i - 1].pose) * views_[i].pose;
      const double step_m = views_[i].path_m - views_[i - 1].path_m;
      poses[i] = poses[i - 1] * moved;
      poses[i].heading_rad = wrap_angle(poses[i].heading_rad + turn_rad_per_m * step_m);
    };
    poses[first] = returns[r].pose;
    if (!is_last) {
      turn_rad_per_m = 0.0;
      for (std::size_t i = first + 1; i <= end; ++i) chain(i);
      turn_rad_per_m =
          wrap_angle(returns[r + 1].pose.heading_rad - poses[end].heading_rad) / path_m;
    }
    for (std::size_t i = first + 1; i <= end; ++i) chain(i);
    if (!is_last) {
      drift_m_per_m = {(returns[r + 1].pose.x_m - poses[end].x_m) / path_m,
                       (returns[r + 1].pose.y_m - poses[end].y_m) / path_m};
    }
    for (std::size_t i = first + 1; i <= end; ++i) {
      const double since_m = views_[i].path_m - views_[first].path_m;
      poses[i].x_m += since_m * drift_m_per_m.x_m;
      poses[i].y_m += since_m * drift_m_per_m.y_m;
    }
  }
  return poses;
}

HomeArea HomeAreaLearner::finish(Executor& executor) const {
  require(!views_.empty(), "views of the walk", 0.0, ">= 1");
  const std::vector<Return> returns = find_returns(estimate_typical_distance_m());
  const std::vector<Pose2> poses = correct_poses(returns);
  // Every other view is a candidate, home first.
  const std::size_t stride = (views_.size() - 1) / max_compared_views + 1;
  std::vector<LevelView> candidates;
  std::vector<LevelView> held_out;
  for (std::size_t i = 0; i < views_.size(); i += stride) {
    if (distance(poses[i].position(), {}) > max_leg_m) continue;
    ((i / stride) % 2 == 0 ? candidates : held_out)
        .push_back({rotate(views_[i].view, -poses[i].heading_rad), poses[i]});
  }
  const auto max_bytes = static_cast<std::size_t>(options_.max_bytes);
  ChosenArea chosen = choose_area(candidates, held_out, make_fine(shape_), max_bytes, executor);
  if (chosen.is_full && shape_ != make_fine(shape_)) {
    ChosenArea coarse = choose_area(candidates, held_out, shape_, max_bytes, executor);
    if (coarse.area.homeward_component() > chosen.area.homeward_component()) {
      chosen = std::move(coarse);
    }
  }
  chosen.area.returns = returns.size() - 1;
  return std::move(chosen.area);
}

}  // namespace panonav
