#include "panonav/route/chain_recorder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"

namespace panonav {

namespace {

// Distance between views that are kept until the next snapshot.
constexpr double kept_view_spacing_m = 0.1;
// Smallest distance between snapshots along the path.
constexpr double min_snapshot_spacing_m = 0.5;
// Largest distance of the path from the legs between way points.
constexpr double corner_tolerance_m = 0.15;
// Further views are tested over this part of the way to the farthest one that can be reached.
constexpr double tested_beyond = 0.3;

double point_to_chord_m(Point2 p, Point2 from, Point2 to) {
  const double length_m = distance(from, to);
  if (length_m == 0.0) return distance(p, from);
  const double x = (to.x_m - from.x_m) / length_m;
  const double y = (to.y_m - from.y_m) / length_m;
  const double along = std::clamp((p.x_m - from.x_m) * x + (p.y_m - from.y_m) * y, 0.0, length_m);
  return distance(p, {from.x_m + along * x, from.y_m + along * y});
}

// Appends the indices of the way points between two positions, both excluded [Douglas, Peucker
// 1973].
void find_way_points(const std::vector<Point2>& path, std::size_t begin, std::size_t end,
                     std::vector<std::size_t>& found) {
  double max_m = 0.0;
  std::size_t farthest = begin;
  for (std::size_t i = begin + 1; i < end; ++i) {
    const double from_chord_m = point_to_chord_m(path[i], path[begin], path[end]);
    if (from_chord_m > max_m) max_m = from_chord_m, farthest = i;
  }
  if (max_m <= corner_tolerance_m) return;
  find_way_points(path, begin, farthest, found);
  found.push_back(farthest);
  find_way_points(path, farthest, end, found);
}

}  // namespace

void visit_options(ChainSpacing& spacing, OptionVisitor& visitor) {
  using T = ChainSpacing;
  constexpr OptionTable table{
      option<&T::max_spacing_m>("largest distance between snapshots along the path", 0.1, 20),
      option<&T::bytes_per_100_m>("bytes that 100 m of a route may take; 0: as many as homing "
                                  "needs",
                                  0, 1e6),
  };
  table.visit(spacing, visitor);
}

ChainRecorder::ChainRecorder(const SnapshotShape& shape, const ChainSpacing& spacing,
                             const ChainOdometry& odometry)
    : spacing_(spacing), chain_(shape, std::nullopt, odometry) {
  validate(spacing_);
  const double fewest = 100.0 * bytes_per_snapshot() / spacing_.max_spacing_m;
  require(spacing_.bytes_per_100_m == 0.0 || spacing_.bytes_per_100_m >= fewest, "bytes_per_100_m",
          spacing_.bytes_per_100_m,
          "0, or " + format_number(std::ceil(fewest)) +
              " and more, as there is a snapshot at least every " +
              format_number(spacing_.max_spacing_m) + " m");
}

double ChainRecorder::bytes_per_snapshot() const noexcept {
  return static_cast<double>(chain_.shape().bytes() + ChainLeg::bytes);
}

double ChainRecorder::min_spacing_m() const noexcept {
  if (spacing_.bytes_per_100_m == 0.0) return min_snapshot_spacing_m;
  return std::max(100.0 * bytes_per_snapshot() / spacing_.bytes_per_100_m, min_snapshot_spacing_m);
}

bool ChainRecorder::can_home(const StoredView& from, const StoredView& to) const {
  const HomeVector vector = home_vector(to.snapshot, from.view, {}, compared_headings);
  return vector.length() > 0.0 &&
         is_right_direction(vector.direction_rad(), from.position, to.position);
}

// True if homing bridges the error of odometry over the way between the last snapshot and a view,
// in both directions.
bool ChainRecorder::can_be_reached(std::size_t index) const {
  const StoredView& view = views_[index];
  const double error_m = chain_.odometry().position_error_m(view.path_m);
  for (std::size_t i = 1; i < index; ++i) {
    const StoredView& other = views_[i];
    const auto must_reach = [&](const StoredView& to) {
      const double between_m = distance(other.position, to.position);
      return between_m >= min_compared_m && between_m <= error_m;
    };
    if (must_reach(view) && !can_home(other, view)) return false;
    if (must_reach(views_.front()) && !can_home(other, views_.front())) return false;
  }
  return true;
}

std::size_t ChainRecorder::add(const HomingView& view, const Pose2& moved) {
  require(is_finite(moved), "motion between views", moved.x_m, "finite");
  if (views_.empty()) {
    chain_ = SnapshotChain(chain_.shape(), view.elevations(), chain_.odometry());
    const HomingView reduced = reduce_view(view, chain_.shape().rows, chain_.shape().components);
    chain_.append({}, reduced);
    views_.push_back({reduced, chain_.view(0), {}, 0.0});
    return 1;
  }
  odometry_from_robot_ = odometry_from_robot_ * moved;
  path_m_ += std::hypot(moved.x_m, moved.y_m);
  if (path_m_ - views_.back().path_m < kept_view_spacing_m) return chain_.snapshots();
  const HomingView reduced = reduce_view(view, chain_.shape().rows, chain_.shape().components);
  const HomingView level = rotate(reduced, -odometry_from_robot_.heading_rad);
  const SnapshotShape& shape = chain_.shape();
  views_.push_back({level, unpack_snapshot(pack_snapshot(level, shape), shape, level.elevations()),
                    odometry_from_robot_.position(), path_m_});
  const std::size_t last = views_.size() - 1;
  if (path_m_ >= min_spacing_m() && path_m_ <= spacing_.max_spacing_m && can_be_reached(last)) {
    reachable_ = last;
  }
  const double reachable_m = views_[reachable_].path_m;
  const double tested_m = std::max(2.0 * min_spacing_m(), (1.0 + tested_beyond) * reachable_m);
  if (path_m_ < std::min(tested_m, spacing_.max_spacing_m)) return chain_.snapshots();
  std::size_t next = reachable_;
  for (std::size_t i = 1; next == 0 && i < views_.size(); ++i) {
    if (views_[i].path_m >= min_spacing_m() || i == last) next = i;
  }
  take_snapshot(next);
  return chain_.snapshots();
}

void ChainRecorder::take_snapshot(std::size_t index) {
  std::vector<Point2> path;
  for (std::size_t i = 0; i <= index; ++i) path.push_back(views_[i].position);
  std::vector<std::size_t> way_points;
  find_way_points(path, 0, index, way_points);
  for (const std::size_t i : way_points) chain_.append(path[i], std::nullopt);
  chain_.append(path[index], views_[index].view);
  compare_with_snapshot(index);
  const double path_m = views_[index].path_m;
  views_.erase(views_.begin(), views_.begin() + static_cast<std::ptrdiff_t>(index));
  for (StoredView& view : views_) view.path_m -= path_m;
  path_m_ -= path_m;
  reachable_ = 0;
}

// Compares a view, as the snapshot that it becomes, with the views before it and with the other
// snapshots.
void ChainRecorder::compare_with_snapshot(std::size_t index) {
  const HomingView snapshot = chain_.view(chain_.nodes().size() - 1);
  const Point2 place = views_[index].position;
  double reach_m = 0.0;
  bool is_reached = true;
  const auto compare = [&](const HomingView& view, Point2 from) {
    pairs_.push_back(panonav::compare_with_snapshot(snapshot, place, view, from));
  };
  for (std::size_t i = index; i-- > 0;) {
    const double away_m = distance(views_[i].position, place);
    if (away_m > max_compared_m) continue;
    compare(views_[i].view, views_[i].position);
    if (away_m < min_compared_m) continue;
    is_reached = is_reached && pairs_.back().is_right;
    if (is_reached) reach_m = std::max(reach_m, away_m);
  }
  reaches_m_.push_back(reach_m);
  for (std::size_t node = 0; node + 1 < chain_.nodes().size(); ++node) {
    if (chain_.nodes()[node].has_snapshot()) {
      compare(chain_.view(node), chain_.nodes()[node].position);
    }
  }
}

SnapshotChain ChainRecorder::finish() const {
  ChainRecorder ended = *this;
  if (reachable_ > 0 && reachable_ + 1 < views_.size()) ended.take_snapshot(reachable_);
  if (ended.views_.size() > 1) ended.take_snapshot(ended.views_.size() - 1);
  if (!ended.views_.empty()) ended.chain_.refine_last(ended.views_.back().view);
  ended.chain_.set_model(learn_chain_model(ended.pairs_, ended.reaches_m_));
  return ended.chain_;
}

}  // namespace panonav
