#include "panonav/localisation/memory_update.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/internal/pose_witness.hpp"

namespace panonav {

namespace {

/// Smallest `probability` of a sure localisation; 99 % of sure ones are right
/// (docs/decisions.md).
constexpr double min_sure_probability = 0.9;
/// Longest travel between an image and its witness, in spacings; over this length odometry errs by
/// 0.4 spacings.
constexpr double max_witness_travel_spacings = 8.0;
/// At most this many earlier images, and as many later ones, are witnesses for the pose of an image
/// (`find_witnessed_pose`).
constexpr std::size_t max_witnesses = 64;
/// A reference explains a view if their similarity is at least this share of the expected one.
constexpr double min_explained_share = 0.5;
/// Shortest travel between two images, in spacings; nearer images show the same.
constexpr double min_step_spacings = 0.25;

}  // namespace

void visit_options(MemoryUpdateOptions& options, OptionVisitor& visitor) {
  using T = MemoryUpdateOptions;
  constexpr OptionTable table{
      option<&T::appearances>(
          "largest number of views that show the same place with different appearances", 1, 100),
      option<&T::failures>(
          "number of consecutive runs without a match after which a view is deleted", 1, 1e6),
      option<&T::max_views>("largest number of views in the memory; 0: the option 'appearances' "
                            "times the number of places",
                            0, 4e9),
  };
  table.visit(options, visitor);
}

MemoryUpdate::MemoryUpdate(const ColumnRanking& ranking, const ObservationModel& model,
                           MemoryUpdate::UseStatistics use, const MemoryUpdateOptions& options)
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

std::optional<PoseWitness> MemoryUpdate::Image::witness() const {
  if (!view.pose || view.probability < min_sure_probability) return std::nullopt;
  return PoseWitness{view.odometry, *view.pose, view.radius_m, 0.0};
}

void MemoryUpdate::add(MemoryUpdate::LocalisedView view) {
  const std::size_t number = image_count_++;
  double travelled_m = 0.0;
  if (!images_.empty()) {
    const Image& last = images_.back();
    const double step_m = distance(last.view.odometry.position(), view.odometry.position());
    if (step_m < min_step_spacings * use_.spacing_m) return;
    travelled_m = last.travelled_m + step_m;
  }
  images_.push_back({number, travelled_m, std::move(view)});
  if (images_.back().witness()) ++sure_count_;
  decide_ready_images(false);
}

void MemoryUpdate::decide_ready_images(bool all) {
  const double reach_m = max_witness_travel_spacings * use_.spacing_m;
  while (undecided_ < images_.size()) {
    const bool is_ready = images_.back().travelled_m > images_[undecided_].travelled_m + reach_m ||
                          images_.size() - undecided_ > max_witnesses;
    if (!all && !is_ready) return;
    decide_image(undecided_);
    ++undecided_;
    if (undecided_ > max_witnesses) {
      images_.pop_front();
      --undecided_;
    }
  }
}

std::vector<ViewId> MemoryUpdate::find_views_around(Point2 position, double radius_m) const {
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

std::optional<Pose2> MemoryUpdate::find_certain_pose(std::size_t index) const {
  const Image& image = images_[index];
  std::vector<PoseWitness> witnesses;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const double travelled_m = std::abs(images_[i].travelled_m - image.travelled_m);
    if (i == index || travelled_m > max_witness_travel_spacings * use_.spacing_m) continue;
    if (auto witness = images_[i].witness()) {
      witness->travelled_m = travelled_m;
      witnesses.push_back(*witness);
    }
  }
  return find_witnessed_pose(image.view.odometry, witnesses, image.witness(), use_.spacing_m);
}

void MemoryUpdate::decide_image(std::size_t index) {
  const Image& image = images_[index];
  const auto pose = find_certain_pose(index);
  if (!pose) return;
  ++certain_count_;
  const double half_spacing_m = 0.5 * use_.spacing_m;
  const ColumnProfiles profiles(image.view.signature, ranking_->components());
  const double max_similarity = use_.far_difference * use_.far_difference;
  bool is_explained = false;
  std::vector<ViewId> unlike;
  for (const ViewId view : find_views_around(pose->position(), use_.spacing_m)) {
    const ReferencePose& reference = *ranking_->memory().info(view).pose;
    const double off_m = distance(reference.position(), pose->position());
    const ColumnMatch match = match_columns(profiles, *ranking_->profiles(view));
    const double turn_rad =
        angle_difference(*reference.heading_rad + match.heading_rad, pose->heading_rad);
    const double similarity = std::abs(turn_rad) <= heading_agreement_tolerance_rad
                                  ? max_similarity - match.difference * match.difference
                                  : 0.0;
    if (similarity >= min_explained_share * max_similarity * std::exp(-off_m / use_.range_m)) {
      is_explained = true;
      matched_.insert(view);
    } else if (off_m <= half_spacing_m) {
      unlike.push_back(view);
    }
  }
  // If no reference explains the view, something may occlude the camera, so no reference has
  // failed.
  if (is_explained) failed_.insert(unlike.begin(), unlike.end());
  const auto own = image.witness();
  const bool is_sure = own && distance(own->pose.position(), pose->position()) <= half_spacing_m;
  const bool is_learnt = std::ranges::any_of(chosen_, [&](const Chosen& other) {
    return distance(other.pose.position(), pose->position()) <= half_spacing_m;
  });
  if ((!is_explained || !is_sure) && !is_learnt) {
    chosen_.push_back({image.number, *pose, is_explained});
  }
}

bool MemoryUpdate::can_become_view(std::size_t number) const {
  for (std::size_t i = undecided_; i < images_.size(); ++i) {
    if (images_[i].number == number) return true;
  }
  return std::ranges::any_of(chosen_, [&](const Chosen& c) { return c.number == number; });
}

bool MemoryUpdate::is_near_known_place() const {
  if (images_.empty()) return false;
  const double from_m = images_.back().travelled_m - max_witness_travel_spacings * use_.spacing_m;
  return std::ranges::any_of(
      images_, [&](const Image& image) { return image.travelled_m >= from_m && image.witness(); });
}

bool MemoryUpdate::is_less_useful(ViewId a, ViewId b) const {
  const auto rank = [&](ViewId view) {
    const auto found = use_.views.find(view);
    const MemoryUpdate::UseStatistics::View use =
        found == use_.views.end() ? MemoryUpdate::UseStatistics::View{} : found->second;
    return std::tuple(!(use.learnt && use.matched == 0), -use.failed, use.last_run, use.matched,
                      view);
  };
  return rank(a) < rank(b);
}

MemoryUpdate::Changes MemoryUpdate::finish() {
  decide_ready_images(true);
  MemoryUpdate::Changes changes;
  changes.sure = sure_count_;
  changes.certain = certain_count_;
  changes.matched.assign(matched_.begin(), matched_.end());
  for (const ViewId view : matched_) {
    MemoryUpdate::UseStatistics::View& use = use_.views[view];
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
    std::vector<ViewId> views = find_views_around(position, half_m);
    std::erase_if(views, [&](ViewId view) { return dropped.contains(view); });
    return views;
  };
  for (const auto& [view, use] : use_.views) {
    if (use.failed < options_.failures) continue;
    const auto nearby = appearances_at(ranking_->memory().info(view).pose->position());
    if (std::ranges::any_of(nearby, [&](ViewId other) { return matched_.contains(other); })) {
      dropped.insert(view);
      changes.forgotten.push_back(view);
    }
  }
  const std::size_t max_views =
      options_.max_views > 0
          ? static_cast<std::size_t>(options_.max_views)
          : static_cast<std::size_t>(options_.appearances) * static_cast<std::size_t>(use_.places);
  const auto by_use = [this](ViewId a, ViewId b) { return is_less_useful(a, b); };
  for (const Chosen& chosen : chosen_) {
    std::vector<ViewId> nearby = appearances_at(chosen.pose.position());
    const std::size_t views = ranking_->memory().size() - dropped.size() + changes.added.size();
    const bool full = nearby.size() >= static_cast<std::size_t>(options_.appearances);
    if (full || views >= max_views) {
      if (chosen.is_explained) continue;
      std::erase_if(nearby, [&](ViewId view) { return matched_.contains(view); });
      if (nearby.empty()) continue;
      const ViewId worst = *std::ranges::min_element(nearby, by_use);
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
