#include "panonav/localisation/memory_update.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

constexpr double sure_probability = 0.9;  // of what is said with that and more, 99 % is right
constexpr double agreeing_share = 0.8;
constexpr std::size_t fewest_witnesses = 3;
constexpr double min_spread_spacings = 2.0;
constexpr double witness_reach_spacings = 8.0;
constexpr std::size_t max_witnesses = 64;  // before a picture, and after it
constexpr double agreeing_heading_rad = radians(20.0);
constexpr double travel_error = 0.05;  // error of a way by odometry, share
constexpr double explained_share = 0.5;
constexpr double new_picture_spacings = 0.25;

Pose2 carried(const PoseWitness& witness, const Pose2& odometry) {
  return witness.pose * (inverse(witness.odometry) * odometry);
}

}  // namespace

void visit_options(MemoryUpdateOptions& options, OptionVisitor& visitor) {
  using T = MemoryUpdateOptions;
  constexpr OptionTable table{
      option<&T::appearances>("views of one place that learning keeps beside each other", 1, 100),
      option<&T::failures>("runs in a row in which a view failed before it is forgotten", 1, 1e6),
      option<&T::max_views>("views that learning lets the memory grow to; 0: 'appearances' times "
                            "its places",
                            0, 4e9),
  };
  table.visit(options, visitor);
}

std::optional<Pose2> witnessed_pose(const Pose2& odometry, std::span<const PoseWitness> witnesses,
                                    const std::optional<PoseWitness>& own, double spacing_m) {
  if (witnesses.size() < fewest_witnesses) return std::nullopt;
  std::vector<Pose2> said;
  for (const PoseWitness& witness : witnesses) said.push_back(carried(witness, odometry));
  const auto agree = [&](std::size_t a, std::size_t b) {
    const double travelled_m = witnesses[a].travelled_m + witnesses[b].travelled_m;
    return distance(said[a].position(), said[b].position()) <=
               0.5 * spacing_m + travel_error * travelled_m &&
           std::abs(angle_difference(said[a].heading_rad, said[b].heading_rad)) <=
               agreeing_heading_rad;
  };
  std::vector<std::size_t> best;
  for (std::size_t a = 0; a < said.size(); ++a) {
    std::vector<std::size_t> with;
    for (std::size_t b = 0; b < said.size(); ++b) {
      if (agree(a, b)) with.push_back(b);
    }
    if (with.size() > best.size()) best = std::move(with);
  }
  if (best.size() < fewest_witnesses ||
      static_cast<double>(best.size()) < agreeing_share * static_cast<double>(said.size())) {
    return std::nullopt;
  }
  double spread_m = 0.0;
  for (const std::size_t a : best) {
    for (const std::size_t b : best) {
      spread_m = std::max(
          spread_m, distance(witnesses[a].odometry.position(), witnesses[b].odometry.position()));
    }
  }
  if (spread_m < min_spread_spacings * spacing_m) return std::nullopt;

  double weights = 0.0;
  Pose2 mean;
  double offset_rad = 0.0;
  const double middle_rad = said[best.front()].heading_rad;
  const auto count = [&](const Pose2& pose, const PoseWitness& witness) {
    const double deviation_m = std::hypot(std::max(0.5 * witness.radius_m, 0.05 * spacing_m),
                                          travel_error * witness.travelled_m);
    const double weight = 1.0 / (deviation_m * deviation_m);
    weights += weight;
    mean.x_m += weight * pose.x_m;
    mean.y_m += weight * pose.y_m;
    offset_rad += weight * angle_difference(pose.heading_rad, middle_rad);
  };
  for (const std::size_t a : best) count(said[a], witnesses[a]);
  if (own) {
    const Point2 middle{mean.x_m / weights, mean.y_m / weights};
    if (distance(own->pose.position(), middle) <= 0.5 * spacing_m &&
        std::abs(angle_difference(own->pose.heading_rad, middle_rad)) <= agreeing_heading_rad) {
      count(own->pose, *own);
    }
  }
  return Pose2{mean.x_m / weights, mean.y_m / weights,
               wrap_angle(middle_rad + offset_rad / weights)};
}

MemoryUpdate::MemoryUpdate(const ColumnRanking& ranking, const ObservationModel& model,
                           MemoryUse use, const MemoryUpdateOptions& options)
    : ranking_(&ranking), use_(std::move(use)), options_(options) {
  validate(options);
  if (!(use_.spacing_m > 0.0)) {
    use_.spacing_m = model.spacing_m;
    use_.far_difference = model.far_difference;
    use_.range_m = model.range_m;
    use_.places = static_cast<int>(ranking.memory().size());
  }
  const auto views = static_cast<int>(ranking.memory().size());
  if (use_.runs > 0) use_.places += std::max(0, views - use_.size);
  use_.size = views;
  ++use_.runs;
  std::erase_if(use_.views,
                [&](const auto& view) { return !ranking.memory().contains(view.first); });
}

std::optional<PoseWitness> MemoryUpdate::Picture::witness() const {
  if (!view.pose || view.known_probability < sure_probability) return std::nullopt;
  return PoseWitness{view.odometry, *view.pose, view.radius_m.value_or(0.0), 0.0};
}

void MemoryUpdate::add(MemoryUpdate::AnsweredView view) {
  const std::size_t number = count_++;
  double travelled_m = 0.0;
  if (!pictures_.empty()) {
    const Picture& last = pictures_.back();
    const double step_m = distance(last.view.odometry.position(), view.odometry.position());
    if (step_m < new_picture_spacings * use_.spacing_m) return;
    travelled_m = last.travelled_m + step_m;
  }
  pictures_.push_back({number, travelled_m, std::move(view)});
  decide_ready(false);
}

void MemoryUpdate::decide_ready(bool all) {
  const double reach_m = witness_reach_spacings * use_.spacing_m;
  while (undecided_ < pictures_.size()) {
    const bool seen_enough =
        pictures_.back().travelled_m > pictures_[undecided_].travelled_m + reach_m ||
        pictures_.size() - undecided_ > max_witnesses;
    if (!all && !seen_enough) return;
    decide(undecided_);
    ++undecided_;
    if (undecided_ > max_witnesses) {
      pictures_.pop_front();
      --undecided_;
    }
  }
}

std::vector<ViewId> MemoryUpdate::around(Point2 position, double radius_m) const {
  std::vector<ViewId> found;
  const VisualMemory& memory = ranking_->memory();
  for (const ViewId view : memory.views()) {
    const auto& pose = memory.info(view).pose;
    if (pose && pose->heading_rad && distance(pose->position(), position) <= radius_m) {
      found.push_back(view);
    }
  }
  return found;
}

void MemoryUpdate::decide(std::size_t index) {
  const Picture& picture = pictures_[index];
  const double reach_m = witness_reach_spacings * use_.spacing_m;
  std::vector<PoseWitness> witnesses;
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const double travelled_m = std::abs(pictures_[i].travelled_m - picture.travelled_m);
    if (i == index || travelled_m > reach_m) continue;
    if (auto witness = pictures_[i].witness()) {
      witness->travelled_m = travelled_m;
      witnesses.push_back(*witness);
    }
  }
  const auto own = picture.witness();
  const auto pose = witnessed_pose(picture.view.odometry, witnesses, own, use_.spacing_m);
  if (!pose) return;
  ++certain_;

  const ColumnProfiles profiles(picture.view.signature, ranking_->components());
  const double most = use_.far_difference * use_.far_difference;
  bool explained = false;
  std::vector<ViewId> unlike;
  for (const ViewId view : around(pose->position(), use_.spacing_m)) {
    const ReferencePose& reference = *ranking_->memory().info(view).pose;
    const double off_m = distance(reference.position(), pose->position());
    const ColumnMatch match = match_columns(profiles, ranking_->profiles(view));
    const double turn_rad =
        angle_difference(*reference.heading_rad + match.heading_rad, pose->heading_rad);
    const double similarity = std::abs(turn_rad) <= agreeing_heading_rad
                                  ? most - match.difference * match.difference
                                  : 0.0;
    if (similarity >= explained_share * most * std::exp(-off_m / use_.range_m)) {
      explained = true;
      matched_.insert(view);
    } else if (off_m <= 0.5 * use_.spacing_m) {
      unlike.push_back(view);
    }
  }
  // Where nothing explains the view, something may stand before the camera: that is no fault of the
  // references.
  if (explained) failed_.insert(unlike.begin(), unlike.end());
  const bool is_sure =
      own && distance(own->pose.position(), pose->position()) <= 0.5 * use_.spacing_m;
  const bool is_learnt = std::ranges::any_of(chosen_, [&](const Chosen& other) {
    return distance(other.pose.position(), pose->position()) <= 0.5 * use_.spacing_m;
  });
  if ((!explained || !is_sure) && !is_learnt) chosen_.push_back({picture.number, *pose, explained});
}

bool MemoryUpdate::can_become_view(std::size_t number) const {
  for (std::size_t i = undecided_; i < pictures_.size(); ++i) {
    if (pictures_[i].number == number) return true;
  }
  return std::ranges::any_of(chosen_, [&](const Chosen& c) { return c.number == number; });
}

bool MemoryUpdate::is_near_known_place() const {
  if (pictures_.empty()) return false;
  const double from_m = pictures_.back().travelled_m - witness_reach_spacings * use_.spacing_m;
  return std::ranges::any_of(pictures_, [&](const Picture& picture) {
    return picture.travelled_m >= from_m && picture.witness();
  });
}

bool MemoryUpdate::is_less_useful(ViewId a, ViewId b) const {
  const auto rank = [&](ViewId view) {
    const auto found = use_.views.find(view);
    const MemoryUse::View use = found == use_.views.end() ? MemoryUse::View{} : found->second;
    return std::tuple(!(use.learnt && use.matched == 0), -use.failed, use.last_run, use.matched,
                      view);
  };
  return rank(a) < rank(b);
}

MemoryUpdate::Changes MemoryUpdate::finish() {
  decide_ready(true);
  MemoryUpdate::Changes changes;
  changes.certain = certain_;
  changes.matched.assign(matched_.begin(), matched_.end());
  for (const ViewId view : matched_) {
    MemoryUse::View& use = use_.views[view];
    ++use.matched;
    use.failed = 0;
    use.last_run = use_.runs;
  }
  std::set<ViewId> dropped;
  for (const ViewId view : failed_) {
    if (!matched_.contains(view)) ++use_.views[view].failed;
  }
  const double half_m = 0.5 * use_.spacing_m;
  const auto appearances_at = [&](Point2 position) {
    std::vector<ViewId> views = around(position, half_m);
    std::erase_if(views, [&](ViewId view) { return dropped.contains(view); });
    return views;
  };
  for (const auto& [view, use] : use_.views) {
    if (use.failed < options_.failures) continue;
    const auto beside = appearances_at(ranking_->memory().info(view).pose->position());
    if (std::ranges::any_of(beside, [&](ViewId other) { return matched_.contains(other); })) {
      dropped.insert(view);
      changes.forgotten.push_back(view);
    }
  }
  const std::size_t most = options_.max_views > 0 ? static_cast<std::size_t>(options_.max_views)
                                                  : static_cast<std::size_t>(options_.appearances) *
                                                        static_cast<std::size_t>(use_.places);
  const auto by_use = [this](ViewId a, ViewId b) { return is_less_useful(a, b); };
  for (const Chosen& chosen : chosen_) {
    std::vector<ViewId> beside = appearances_at(chosen.pose.position());
    const std::size_t views = ranking_->memory().size() - dropped.size() + changes.added.size();
    const bool full = beside.size() >= static_cast<std::size_t>(options_.appearances);
    if (full || views >= most) {
      if (chosen.explained) continue;
      std::erase_if(beside, [&](ViewId view) { return matched_.contains(view); });
      if (beside.empty()) continue;
      const ViewId worst = *std::ranges::min_element(beside, by_use);
      dropped.insert(worst);
      changes.replaced.push_back(worst);
    }
    changes.added.push_back(
        {chosen.number, {chosen.pose.x_m, chosen.pose.y_m, chosen.pose.heading_rad}});
  }
  for (const ViewId view : dropped) use_.views.erase(view);
  std::ranges::sort(changes.added, {}, &MemoryUpdate::Changes::Added::number);
  std::ranges::sort(changes.replaced);
  changes.use = std::move(use_);
  return changes;
}

}  // namespace panonav
