#include "panonav/mapping/internal/piece_joining.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/join_evidence.hpp"
#include "panonav/mapping/internal/lattice_links.hpp"

namespace panonav {

namespace {

/// Least number of different views of each piece whose links agree: two links between the same
/// places share their errors.
constexpr std::size_t min_agreeing_views = 3;
/// Growth of the tolerance of positions per distance from the meeting place: lengths err by a
/// quarter.
constexpr double drift_share = 0.25;
/// Probability that the turn of a wrong link agrees: 15 of 45 degrees, as rooms have right angles.
constexpr double p_heading_chance = 1.0 / 3.0;

/// Largest number of crossings between two pieces.
constexpr std::size_t max_crossings = 3;
/// Smallest probability of a crossing: a wrong one costs a detour, which the robot notices.
constexpr double min_crossing_probability = 0.5;

class JoinSearch {
 public:
  JoinSearch(std::span<const Pose2> poses, std::span<const CrossLink> links)
      : poses_(poses), links_(links) {
    for (std::size_t k = 0; k < links.size(); ++k) by_probability_.push_back(k);
    std::ranges::sort(by_probability_, {},
                      [&](std::size_t k) { return std::pair(-links_[k].probability, k); });
  }

  [[nodiscard]] std::optional<PieceJoin> find_best(double min_evidence) const {
    std::vector<Hypothesis> all;
    for (const std::size_t k : by_probability_) all.push_back(test(k));
    const auto best = std::ranges::max_element(all, {}, &Hypothesis::evidence);
    if (best == all.end() || count_views(best->agreeing) < min_agreeing_views) return std::nullopt;
    double other = 0.0;
    for (const Hypothesis& each : all) {
      if (!std::ranges::binary_search(best->agreeing, each.first)) {
        other = std::max(other, each.evidence);
      }
    }
    if (best->evidence - other < min_evidence) return std::nullopt;
    return PieceJoin{average(*best), best->agreeing};
  }

  /// Returns the most probable links that agree with the best relative pose, without those that are
  /// less probable than not.
  [[nodiscard]] std::vector<std::size_t> find_crossings() const {
    std::optional<Hypothesis> best;
    for (const std::size_t k : by_probability_) {
      Hypothesis each = test(k);
      if (!best || each.evidence > best->evidence) best = std::move(each);
    }
    std::vector<std::size_t> chosen;
    for (const std::size_t k : by_probability_) {
      if (chosen.size() == max_crossings || links_[k].probability < min_crossing_probability) break;
      if (std::ranges::binary_search(best->agreeing, k)) chosen.push_back(k);
    }
    return chosen;
  }

 private:
  struct Hypothesis {
    std::size_t first = 0;  // the link that proposes the pose
    Pose2 p_from_q;
    double evidence = 0.0;              // log-odds
    std::vector<std::size_t> agreeing;  // links, ascending
  };

  /// Returns the largest position error of link k, in link lengths, if the pieces meet at
  /// `meeting`.
  [[nodiscard]] double tolerance(std::size_t k, const Point2& meeting) const {
    const double far = distance(poses_[links_[k].in_p].position(), meeting);
    return position_tolerance + drift_share * far / links_[k].length;
  }

  /// Returns the relative pose that link k proposes with the evidence of all links. Links of one
  /// view share their errors, so the n-th link of a view is weighted by 1/n.
  [[nodiscard]] Hypothesis test(std::size_t first) const {
    const CrossLink& proposed = links_[first];
    const Point2 meeting = poses_[proposed.in_p].position();
    Hypothesis result{
        first, poses_[proposed.in_p] * proposed.step * inverse(poses_[proposed.in_q]), 0.0, {}};
    std::map<std::size_t, int> used;
    for (const std::size_t k : by_probability_) {
      const CrossLink& link = links_[k];
      const double allowed = tolerance(k, meeting);
      const bool agrees = is_near(poses_[link.in_p] * link.step,
                                  result.p_from_q * poses_[link.in_q], allowed * link.length);
      // Things repeat along walls and shelves: chance grows with the tolerance, in one dimension.
      const double chance = std::min(p_heading_chance, p_chance * allowed / position_tolerance);
      const double right = link.probability;
      const double ratio = agrees ? std::log((right + (1.0 - right) * chance) / chance)
                                  : std::log(1.0 - right + right * (1.0 - p_adjacent_agree));
      result.evidence += ratio / (1.0 + std::max(used[link.in_p], used[link.in_q]));
      ++used[link.in_p];
      ++used[link.in_q];
      if (agrees) result.agreeing.push_back(k);
    }
    std::ranges::sort(result.agreeing);
    return result;
  }

  /// Returns the smaller number of different views at which the links end, of both pieces.
  [[nodiscard]] std::size_t count_views(std::span<const std::size_t> links) const {
    std::set<std::size_t> in_p;
    std::set<std::size_t> in_q;
    for (const std::size_t k : links) {
      in_p.insert(links_[k].in_p);
      in_q.insert(links_[k].in_q);
    }
    return std::min(in_p.size(), in_q.size());
  }

  /// Returns the mean relative pose of the links that agree with the hypothesis, weighted by their
  /// probabilities over their squared tolerances.
  [[nodiscard]] Pose2 average(const Hypothesis& best) const {
    const Point2 meeting = poses_[links_[best.first].in_p].position();
    double weights = 0.0;
    double turned = 0.0;
    std::vector<double> weight;
    for (const std::size_t k : best.agreeing) {
      const CrossLink& link = links_[k];
      const double deviation = tolerance(k, meeting) * link.length;
      weight.push_back(link.probability / (deviation * deviation));
      weights += weight.back();
      turned += weight.back() * angle_difference((poses_[link.in_p] * link.step).heading_rad,
                                                 (best.p_from_q * poses_[link.in_q]).heading_rad);
    }
    Pose2 mean{0.0, 0.0, wrap_angle(best.p_from_q.heading_rad + turned / weights)};
    Point2 shift;
    for (std::size_t i = 0; i < weight.size(); ++i) {
      const CrossLink& link = links_[best.agreeing[i]];
      const Pose2 read = poses_[link.in_p] * link.step;
      const Point2 at = (mean * poses_[link.in_q]).position();
      shift.x_m += weight[i] / weights * (read.x_m - at.x_m);
      shift.y_m += weight[i] / weights * (read.y_m - at.y_m);
    }
    mean.x_m = shift.x_m;
    mean.y_m = shift.y_m;
    return mean;
  }

  std::span<const Pose2> poses_;
  std::span<const CrossLink> links_;
  std::vector<std::size_t> by_probability_;  // numbers of the links, the most probable first
};

/// The best join of two pieces p and q, of which q is the smaller one.
struct FoundJoin {
  std::size_t p = 0;
  std::size_t q = 0;
  std::size_t smaller_views = 0;
  std::vector<std::size_t> agreeing;  // numbers of all cross links
  Pose2 p_from_q;
};

/// Returns the numbers of the links between each two pieces, that with more views first.
std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> links_between(
    std::span<const CrossLink> links, std::span<const std::size_t> components,
    const std::map<std::size_t, std::size_t>& views) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> between;
  for (std::size_t k = 0; k < links.size(); ++k) {
    std::size_t p = components[links[k].in_p];
    std::size_t q = components[links[k].in_q];
    if (p == q) continue;
    if (std::pair(views.at(p), q) < std::pair(views.at(q), p)) std::swap(p, q);
    between[{p, q}].push_back(k);
  }
  return between;
}

/// Returns the links with these numbers, each from a view of piece p.
std::vector<CrossLink> links_from(std::size_t p, std::span<const std::size_t> numbers,
                                  std::span<const CrossLink> links,
                                  std::span<const std::size_t> components) {
  std::vector<CrossLink> own;
  for (const std::size_t k : numbers) {
    CrossLink link = links[k];
    if (components[link.in_p] != p) {
      std::swap(link.in_p, link.in_q);
      link.step = inverse(link.step);
    }
    own.push_back(link);
  }
  return own;
}

std::map<std::size_t, std::size_t> count_views(std::span<const std::size_t> components) {
  std::map<std::size_t, std::size_t> views;
  for (const std::size_t component : components) ++views[component];
  return views;
}

std::optional<FoundJoin> find_best_join(std::span<const CrossLink> links,
                                        std::span<const Pose2> poses,
                                        std::span<const std::size_t> components,
                                        std::size_t min_views) {
  const auto views = count_views(components);
  std::optional<FoundJoin> best;
  for (const auto& [pieces, numbers] : links_between(links, components, views)) {
    const auto own = links_from(pieces.first, numbers, links, components);
    const std::size_t smaller_views = views.at(pieces.second);
    if (smaller_views < min_views) continue;
    const auto found = find_piece_join(poses, own, smaller_views);
    if (!found || (best && best->agreeing.size() >= found->agreeing.size())) continue;
    best = FoundJoin{pieces.first, pieces.second, smaller_views, {}, found->p_from_q};
    for (const std::size_t i : found->agreeing) best->agreeing.push_back(numbers[i]);
  }
  return best;
}

}  // namespace

std::vector<JoinedPieces> join_pieces(std::span<const CrossLink> links, std::vector<Pose2>& poses,
                                      std::vector<std::size_t>& components, std::size_t min_views) {
  std::vector<JoinedPieces> joined;
  while (const auto join = find_best_join(links, poses, components, min_views)) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (components[i] != join->q) continue;
      components[i] = join->p;
      poses[i] = join->p_from_q * poses[i];
    }
    joined.push_back({join->smaller_views, join->agreeing});
  }
  return joined;
}

std::optional<PieceJoin> find_piece_join(std::span<const Pose2> poses,
                                         std::span<const CrossLink> links,
                                         std::size_t smaller_views) {
  return JoinSearch(poses, links)
      .find_best(std::log(min_join_odds * static_cast<double>(smaller_views)));
}

std::vector<std::size_t> choose_crossings(std::span<const CrossLink> links,
                                          std::span<const Pose2> poses,
                                          std::span<const std::size_t> components) {
  std::vector<std::size_t> chosen;
  const auto views = count_views(components);
  for (const auto& [pieces, numbers] : links_between(links, components, views)) {
    const auto own = links_from(pieces.first, numbers, links, components);
    for (const std::size_t i : JoinSearch(poses, own).find_crossings()) {
      chosen.push_back(numbers[i]);
    }
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace panonav
