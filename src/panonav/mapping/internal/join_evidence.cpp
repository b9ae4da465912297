#include "panonav/mapping/internal/join_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

// Values without another source were chosen on simulated worlds.

/// Probability that, of two right links of a view, the longer one joins the more similar views; it
/// is 0.5 if one link is wrong.
constexpr double p_discordant = 0.15;
/// Smallest ratio of the lengths of two links whose similarities are compared; it exceeds the
/// error of lengths.
constexpr double min_longer_ratio = 1.2;
/// Number of links, the most certain ones, that each propose a relative pose.
constexpr std::size_t max_hypotheses = 8;

/// The links between two components, the most certain ones first.
class LinksBetween {
 public:
  LinksBetween(const ComponentLayout& layout, std::size_t p, std::size_t q)
      : layout_(layout), p_(p), q_(q), links_(layout.neighbours(p).at(q)) {
    std::ranges::sort(links_, {}, [&](std::size_t k) {
      return std::tuple(-link(k).probability, link(k).residual, k);
    });
  }

  [[nodiscard]] JoinHypothesis find_best() const {
    std::vector<JoinHypothesis> all;
    for (std::size_t h = 0; h < std::min(max_hypotheses, links_.size()); ++h) {
      all.push_back(propose(links_[h]));
    }
    JoinHypothesis best = *std::ranges::max_element(all, {}, &JoinHypothesis::evidence);
    double other = 0.0;
    for (std::size_t h = 0; h < all.size(); ++h) {
      if (differs(best, all[h], links_[h])) other = std::max(other, all[h].evidence);
    }
    best.evidence -= other;
    if (best.evidence > 0.0) {
      best.evidence += std::log((1.0 - p_adjacent_agree) / (1.0 - p_chance)) *
                       count_contradictions(best.p_from_q);
    }
    return best;
  }

 private:
  [[nodiscard]] const LatticeLink& link(std::size_t k) const { return layout_.links()[k]; }
  [[nodiscard]] const Pose2& pose(std::size_t view) const { return layout_.poses()[view]; }

  /// Returns the relative pose by link k, or the mean pose of the links that agree with it if the
  /// evidence for the mean is larger.
  [[nodiscard]] JoinHypothesis propose(std::size_t k) const {
    const auto ends = layout_.ends_of(k, p_);
    const Pose2 read = pose(ends.in_p) * ends.step * inverse(pose(ends.in_q));
    const double of_read = evidence_for(read, k);
    const Pose2 mean = average_agreeing(read);
    const double of_mean = evidence_for(mean, k);
    if (of_mean > of_read) return {of_mean, mean};
    return {of_read, read};
  }

  /// True if two relative poses put the view of link k at different places.
  [[nodiscard]] bool differs(const JoinHypothesis& a, const JoinHypothesis& b,
                             std::size_t k) const {
    const Pose2& at = pose(layout_.ends_of(k, p_).in_q);
    const Pose2 here = a.p_from_q * at;
    const Pose2 there = b.p_from_q * at;
    return std::abs(angle_difference(here.heading_rad, there.heading_rad)) >
               2.0 * turn_tolerance_rad ||
           distance(here.position(), there.position()) >
               near_distance_in_links * layout_.typical_length();
  }

  /// Returns the log-likelihood ratio of the similarity of a link's views against that of the
  /// links of the same views, inside their components, that are clearly longer in the layout.
  [[nodiscard]] double concordance(const ComponentLayout::Ends& ends, double layout_length,
                                   double residual) const {
    double longer = 0.0;
    double more_alike = 0.0;
    for (const std::size_t view : {ends.in_p, ends.in_q}) {
      for (const std::size_t k : layout_.links_of(view)) {
        const LatticeLink& own = link(k);
        if (!layout_.is_inside(own) || !layout_.agrees_inside(own)) continue;
        const double length = distance(pose(own.a).position(), pose(own.b).position());
        if (length < min_longer_ratio * layout_length) continue;
        longer += 1.0;
        more_alike += own.residual < residual ? 1.0 : 0.0;
      }
    }
    if (longer == 0.0) return 0.0;
    const double share = more_alike / longer;
    // The factor 2 adds one term for each of the two views.
    return 2.0 * (share * std::log(p_discordant / 0.5) +
                  (1.0 - share) * std::log((1.0 - p_discordant) / 0.5));
  }

  /// Returns the log-odds of the relative pose that link `first` proposes. Links of one view share
  /// their errors, so the n-th link of a view is weighted by 1/n.
  [[nodiscard]] double evidence_for(const Pose2& p_from_q, std::size_t first) const {
    std::map<std::size_t, int> used;
    const auto of_first = layout_.ends_of(first, p_);
    used[of_first.in_p] = used[of_first.in_q] = 1;
    const double prior = link(first).probability;
    double evidence = std::log(prior / (1.0 - prior));
    for (const std::size_t k : links_) {
      if (k == first) continue;
      const auto ends = layout_.ends_of(k, p_);
      if (!layout_.agrees_with(k, ends, p_from_q)) continue;
      const double right = link(k).probability;
      const Point2 there = (p_from_q * pose(ends.in_q)).position();
      const double ratio =
          std::log((right + (1.0 - right) * p_chance) / p_chance) +
          concordance(ends, distance(pose(ends.in_p).position(), there), link(k).residual);
      evidence += ratio / (1.0 + std::max(used[ends.in_p], used[ends.in_q]));
      ++used[ends.in_p];
      ++used[ends.in_q];
    }
    return evidence;
  }

  /// Returns the mean relative pose of the links that agree with `p_from_q`; `p_from_q` itself if
  /// these are fewer than two.
  [[nodiscard]] Pose2 average_agreeing(const Pose2& p_from_q) const {
    std::vector<std::tuple<double, Point2, Pose2>> agreeing;  // weight, in q, read in p
    double weights = 0.0;
    double turned = 0.0;
    for (const std::size_t k : links_) {
      const auto ends = layout_.ends_of(k, p_);
      if (!layout_.agrees_with(k, ends, p_from_q)) continue;
      const Pose2 read_pose = pose(ends.in_p) * ends.step;
      const double weight = link(k).probability / (link(k).length * link(k).length);
      weights += weight;
      turned += weight *
                angle_difference(read_pose.heading_rad, (p_from_q * pose(ends.in_q)).heading_rad);
      agreeing.emplace_back(weight, pose(ends.in_q).position(), read_pose);
    }
    if (agreeing.size() < 2) return p_from_q;
    Pose2 mean{0.0, 0.0, wrap_angle(p_from_q.heading_rad + turned / weights)};
    Point2 shift;
    for (const auto& [weight, in_q, read_pose] : agreeing) {
      const Point2 at = mean * in_q;
      shift.x_m += weight / weights * (read_pose.x_m - at.x_m);
      shift.y_m += weight / weights * (read_pose.y_m - at.y_m);
    }
    mean.x_m = shift.x_m;
    mean.y_m = shift.y_m;
    return mean;
  }

  /// Counts the views of both components that become adjacent to a view of the other one although
  /// none of their links agrees: no wall fits between them. Only views near the place where both
  /// meet are counted.
  [[nodiscard]] double count_contradictions(const Pose2& p_from_q) const {
    const double typical = layout_.typical_length();
    std::vector<Point2> meeting;
    std::set<std::size_t> agreeing;
    for (const std::size_t k : links_) {
      const auto ends = layout_.ends_of(k, p_);
      if (!layout_.agrees_with(k, ends, p_from_q)) continue;
      meeting.push_back(pose(ends.in_p).position());
      agreeing.insert({ends.in_p, ends.in_q});
    }
    std::set<std::size_t> without_link;
    for (const std::size_t b : layout_.members(q_)) {
      const Point2 at = (p_from_q * pose(b)).position();
      if (std::ranges::none_of(meeting, [&](Point2 m) {
            return distance(m, at) < near_distance_in_links * typical;
          })) {
        continue;
      }
      for (const std::size_t a : layout_.members(p_)) {
        if (distance(at, pose(a).position()) >= adjacent_distance_in_links * typical) continue;
        if (!agreeing.contains(a)) without_link.insert(a);
        if (!agreeing.contains(b)) without_link.insert(b);
      }
    }
    return static_cast<double>(without_link.size());
  }

  const ComponentLayout& layout_;
  std::size_t p_;
  std::size_t q_;
  std::vector<std::size_t> links_;
};

}  // namespace

JoinHypothesis find_best_hypothesis(const ComponentLayout& layout, std::size_t p, std::size_t q) {
  return LinksBetween(layout, p, q).find_best();
}

}  // namespace panonav
