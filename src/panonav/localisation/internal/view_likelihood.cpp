#include "panonav/localisation/internal/view_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Distance in spacings within which references are near a cell: contains twelve even slightly
/// outside the area of the references.
constexpr double reach_spacings = 2.0;
/// Mean distance of a position in a square of a grid from the nearest corner, in spacings.
constexpr double mean_corner_distance_spacings = 0.3826;
/// Largest number of references near a cell: the corners of a grid square and the ring around them,
/// without its corners.
constexpr std::size_t max_near_sites = 12;
/// Largest number of cached column profiles (2.5 kB each, 50 MB in all): more than a robot passes
/// in an hour.
constexpr std::size_t max_cached_profiles = 20'000;
/// Number of sites whose profiles are loaded together: 2.4 MB of signatures.
constexpr std::size_t sites_per_load = 1000;
constexpr auto lane_count = static_cast<std::size_t>(kernels::similarity_lanes);
static_assert(max_near_sites <= lane_count);

}  // namespace

ViewLikelihood::ViewLikelihood(std::unique_ptr<ComparedViews> views, const ObservationModel& model,
                               bool compass)
    : views_(std::move(views)), model_(model), compass_(compass) {
  require(model.spacing_m > 0.0, "spacing of the references", model.spacing_m, "> 0 m");
  require(model.range_m > 0.0, "range of similarity", model.range_m, "> 0 m");
  decay_.per_metre = static_cast<float>(1.0 / model.range_m);
  update_sites();
}

void ViewLikelihood::update_sites() {
  std::vector<Site> sites;
  for (const auto& [view, pose] : views_->posed_views()) {
    Site& site = sites.emplace_back();
    site.view = view;
    site.position = pose.position();
    site.reference_heading_rad = pose.heading_rad ? static_cast<float>(*pose.heading_rad)
                                                  : std::numeric_limits<float>::quiet_NaN();
    site.heading_rad = site.reference_heading_rad;
  }
  require(!sites.empty(), "views with a pose", 0.0, ">= 1");
  sites_.swap(sites);
  differences_.assign(sites_.size(), 0.0);
  keep_profiles(sites);
  compared_sites_.clear();
  signature_.reset();
  view_.reset();
  index_sites();
}

void ViewLikelihood::keep_profiles(std::span<const Site> former_sites) {
  std::vector<std::shared_ptr<const ColumnProfiles>> kept(sites_.size());
  cached_profiles_ = 0;
  for (std::size_t i = 0; i < former_sites.size(); ++i) {
    if (!profiles_[i]) continue;
    const auto site = site_of(former_sites[i].view);
    if (!site) continue;
    kept[*site] = std::move(profiles_[i]);
    ++cached_profiles_;
  }
  profiles_ = std::move(kept);
}

void ViewLikelihood::index_sites() {
  cell_m_ = model_.spacing_m;
  cells_per_metre_ = 1.0 / cell_m_;
  const double reach_m =
      std::max(reach_spacings * model_.spacing_m, std::min(model_.range_m, 4 * model_.spacing_m));
  const auto around = static_cast<std::int32_t>(std::ceil(reach_m / cell_m_));
  table_ = {};
  cells_.clear();
  near_sites_.clear();
  lanes_.clear();
  std::vector<std::pair<GridCell, std::uint32_t>> by_cell;  // ascending, with the site in the cell
  for (std::uint32_t s = 0; s < sites_.size(); ++s)
    by_cell.emplace_back(cell_of(sites_[s].position), s);
  std::ranges::sort(by_cell);
  // Column by column of cells, so that only the sites near one column are listed at once.
  std::vector<std::pair<std::int32_t, std::uint32_t>> near_column;  // cell along y, site
  std::int32_t next_x = std::numeric_limits<std::int32_t>::min();
  for (const auto& [site_cell, unused] : by_cell) {
    for (std::int32_t x = std::max(next_x, site_cell.x - around); x <= site_cell.x + around; ++x) {
      near_column.clear();
      auto near = std::ranges::lower_bound(by_cell, x - around, {},
                                           [](const auto& entry) { return entry.first.x; });
      for (; near != by_cell.end() && near->first.x <= x + around; ++near)
        near_column.emplace_back(near->first.y, near->second);
      std::ranges::sort(near_column);
      add_cells(x, near_column, around, reach_m + 0.5 * cell_m_);
    }
    next_x = std::max(next_x, site_cell.x + around + 1);
  }
  group_of_cell_.assign(cells_.size() + 1, 0);
}

void ViewLikelihood::add_cells(std::int32_t x,
                               std::span<const std::pair<std::int32_t, std::uint32_t>> near_column,
                               std::int32_t around, double reach_m) {
  std::vector<std::pair<float, std::uint32_t>> near;  // distance, site
  std::int32_t next_y = std::numeric_limits<std::int32_t>::min();
  auto first = near_column.begin();  // first view near the cell
  for (const auto& [site_y, unused] : near_column) {
    for (std::int32_t y = std::max(next_y, site_y - around); y <= site_y + around; ++y) {
      const Point2 centre = centre_of({x, y});
      while (first->first < y - around) ++first;
      near.clear();
      for (auto at = first; at != near_column.end() && at->first <= y + around; ++at) {
        const Point2 position = sites_[at->second].position;
        const double across_m = position.x_m - centre.x_m;
        const double along_m = position.y_m - centre.y_m;
        const double distance_m = std::sqrt(across_m * across_m + along_m * along_m);
        if (distance_m <= reach_m) near.emplace_back(static_cast<float>(distance_m), at->second);
      }
      if (near.empty()) continue;
      const auto end =
          near.begin() + static_cast<std::ptrdiff_t>(std::min(max_near_sites, near.size()));
      std::ranges::partial_sort(near, end);
      Cell cell{{x, y}, static_cast<std::uint32_t>(near_sites_.size()), 0, 0, 0};
      for (auto at = near.begin(); at != end; ++at) near_sites_.push_back(at->second);
      cell.end = static_cast<std::uint32_t>(near_sites_.size());
      table_.find_or_add(cell.grid_cell);
      cells_.push_back(cell);
    }
    next_y = std::max(next_y, site_y + around + 1);
  }
}

GridCell ViewLikelihood::cell_of(Point2 position) const noexcept {
  constexpr double limit = 2e9;  // farther than any memory reaches
  return {cell_index(position.x_m * cells_per_metre_, limit),
          cell_index(position.y_m * cells_per_metre_, limit)};
}

Point2 ViewLikelihood::centre_of(GridCell cell) const noexcept {
  return {(cell.x + 0.5) * cell_m_, (cell.y + 0.5) * cell_m_};
}

bool ViewLikelihood::has_site_within(Point2 position, double reach_m) const {
  return std::ranges::any_of(
      sites_, [&](const Site& site) { return distance(site.position, position) <= reach_m; });
}

std::size_t ViewLikelihood::count_cells(double side_m) const {
  std::set<std::pair<double, double>> cells;
  for (const Site& site : sites_) {
    cells.emplace(std::floor(site.position.x_m / side_m), std::floor(site.position.y_m / side_m));
  }
  return cells.size();
}

void ViewLikelihood::set_view(const PackedSignature& view) {
  const SignatureShape shape = views_->shape();
  if (view.shape != shape) {
    throw ContractError("rows of the view's signature", view.shape.rows,
                        to_text(shape.rows) + " with " + to_text(shape.components) + " components");
  }
  signature_ = view;
  view_.emplace(view, views_->components());
  compared_sites_.clear();
  max_similarity_ = 0.0;
  decay_.blur_square_m2 = 0.0F;
  lanes_.clear();
  ++revision_;
  ++view_number_;
}

std::vector<std::uint32_t> ViewLikelihood::search(int count) {
  std::vector<std::uint32_t> sites;
  for (const Match& match : views_->search(signature_.value(), count)) {
    if (const auto site = site_of(match.view)) sites.push_back(*site);
  }
  return sites;
}

void ViewLikelihood::compare(std::span<const std::uint32_t> sites) {
  for (; !sites.empty(); sites = sites.subspan(std::min(sites.size(), sites_per_load))) {
    const auto part = sites.first(std::min(sites.size(), sites_per_load));
    load_profiles(part);
    for (const std::uint32_t site : part) {
      if (profiles_[site] && !is_compared(site)) compare_loaded(site);
    }
  }
}

void ViewLikelihood::load_profiles(std::span<const std::uint32_t> sites) {
  if (cached_profiles_ + sites.size() > max_cached_profiles) {
    for (auto& profiles : profiles_) profiles.reset();
    cached_profiles_ = 0;
  }
  std::vector<std::uint32_t> loaded;
  std::vector<ViewId> views;
  for (const std::uint32_t site : sites) {
    if (profiles_[site]) continue;
    loaded.push_back(site);
    views.push_back(sites_[site].view);
  }
  if (views.empty()) return;
  views_->load(views, [&](std::size_t i, std::shared_ptr<const ColumnProfiles> profiles) {
    profiles_[loaded[i]] = std::move(profiles);
    ++cached_profiles_;
  });
}

void ViewLikelihood::compare_loaded(std::uint32_t site) {
  Site& s = sites_[site];
  const auto [match, other] = find_two_best_column_matches(*view_, *profiles_[site]);
  const double far = model_.far_difference;
  s.compared_view_number = view_number_;
  const auto to_similarity = [far](const ColumnMatch& m) {
    return static_cast<float>(std::max(0.0, far * far - m.difference * m.difference));
  };
  s.similarity = to_similarity(match);
  s.other_similarity = to_similarity(other);
  s.log_similarity = std::log(s.similarity);
  s.other_log_similarity = std::log(s.other_similarity);
  if (static_cast<double>(s.similarity) > max_similarity_) {
    max_similarity_ = static_cast<double>(s.similarity);
    const double apart_m = model_.range_m * std::log(far * far / max_similarity_);
    const double nearest_m = mean_corner_distance_spacings * model_.spacing_m;
    decay_.blur_square_m2 =
        static_cast<float>(std::max(0.0, apart_m * apart_m - nearest_m * nearest_m));
  }
  s.heading_rad = s.reference_heading_rad + static_cast<float>(match.heading_rad);
  s.other_heading_rad = s.heading_rad + static_cast<float>(other.heading_rad - match.heading_rad);
  differences_[site] = match.difference;
  compared_sites_.push_back(site);
  lanes_.clear();
  ++revision_;
}

std::optional<double> ViewLikelihood::min_difference(std::span<const std::uint32_t> sites) const {
  std::optional<double> smallest;
  for (const std::uint32_t site : sites) {
    if (!is_compared(site)) continue;
    const double difference = differences_[site];
    if (!smallest || difference < *smallest) smallest = difference;
  }
  return smallest;
}

const kernels::SimilarityLanes& ViewLikelihood::get_or_create_lanes(Cell& cell) {
  if (cell.lanes_revision == revision_) return lanes_[cell.lanes];
  cell.lanes_revision = revision_;
  cell.lanes = static_cast<std::uint32_t>(lanes_.size());
  kernels::SimilarityLanes& lanes = lanes_.emplace_back();
  for (std::size_t i = 0; i < lane_count; ++i) {
    lanes.x_m[i] = 1e6F / decay_.per_metre;
    lanes.y_m[i] = lanes.heading_rad[i] = lanes.per_square_turn[i] = 0.0F;
    lanes.other_heading_rad[i] = 0.0F;
    lanes.log_similarity[i] = lanes.other_log_similarity[i] =
        -std::numeric_limits<float>::infinity();
  }
  // Positions are relative to the cell, so that floats keep their precision far from the origin.
  const Point2 centre = centre_of(cell.grid_cell);
  const auto per_square_turn =
      static_cast<float>(-0.5 / (model_.heading_width_rad * model_.heading_width_rad));
  for (std::size_t i = 0; i < cell.end - cell.begin; ++i) {
    const Site& s = sites_[near_sites_[cell.begin + i]];
    lanes.x_m[i] = static_cast<float>(s.position.x_m - centre.x_m);
    lanes.y_m[i] = static_cast<float>(s.position.y_m - centre.y_m);
    if (s.compared_view_number != view_number_) continue;
    lanes.log_similarity[i] = s.log_similarity;
    if (!compass_ || std::isnan(s.heading_rad)) continue;
    lanes.heading_rad[i] = s.heading_rad;
    lanes.other_heading_rad[i] = s.other_heading_rad;
    lanes.other_log_similarity[i] = s.other_log_similarity;
    lanes.per_square_turn[i] = per_square_turn;
  }
  return lanes;
}

void ViewLikelihood::compute_log_ratios(const Particles& particles, std::span<double> ratios) {
  if (particles.empty()) return;
  // Passes successive particles of one cell to the kernel together.
  constexpr std::size_t block_size = 128;
  std::array<float, block_size> x_m, y_m, heading_rad, explained;
  std::size_t begin = 0;
  auto next = cell_of(particles.position(0));
  while (begin < particles.size()) {
    const auto grid_cell = next;
    const Point2 centre = centre_of(grid_cell);
    std::size_t count = 0;
    do {
      x_m[count] = static_cast<float>(particles.x_m[begin + count] - centre.x_m);
      y_m[count] = static_cast<float>(particles.y_m[begin + count] - centre.y_m);
      heading_rad[count] = static_cast<float>(particles.heading_rad[begin + count]);
      ++count;
      if (begin + count == particles.size()) break;
      next = cell_of(particles.position(begin + count));
    } while (count < block_size && next == grid_cell);
    if (const auto cell = table_.find(grid_cell)) {
      kernels::explain_similarity(
          get_or_create_lanes(cells_[*cell]), decay_, std::span(x_m).first(count),
          std::span(y_m).first(count), std::span(heading_rad).first(count),
          std::span(explained).first(count), kernels::chosen_instructions());
    } else {
      explained.fill(0.0F);
    }
    for (std::size_t i = 0; i < count; ++i) {
      ratios[begin + i] = model_.sharpness * static_cast<double>(explained[i]);
    }
    begin += count;
  }
}

std::span<const std::uint32_t> ViewLikelihood::sites_near(Point2 position) const noexcept {
  const auto cell = table_.find(cell_of(position));
  if (!cell) return {};
  return std::span(near_sites_)
      .subspan(cells_[*cell].begin, cells_[*cell].end - cells_[*cell].begin);
}

void ViewLikelihood::group_particles(const Particles& particles) {
  groups_.clear();
  group_of_.resize(particles.size());
  GridCell last;
  std::uint32_t at = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const GridCell grid_cell = cell_of(particles.position(i));
    if (i == 0 || grid_cell != last) {
      last = grid_cell;
      const auto none = static_cast<std::uint32_t>(cells_.size());
      const std::uint32_t cell = table_.find(grid_cell).value_or(none);
      at = group_of_cell_[cell];
      if (at >= groups_.size() || groups_[at].cell != cell) {
        at = group_of_cell_[cell] = static_cast<std::uint32_t>(groups_.size());
        groups_.push_back({cell, 0, 0.0});
      }
    }
    group_of_[i] = at;
    ++groups_[at].count;
    groups_[at].weight += particles.weight[i];
  }
}

void ViewLikelihood::reorder_by_cell(Particles& particles) {
  group_particles(particles);
  std::uint32_t begin = 0;
  for (Group& group : groups_) {
    const std::uint32_t count = group.count;
    group.count = begin;
    begin += count;
  }
  arranged_.resize(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    arranged_.set(groups_[group_of_[i]].count++, particles.pose(i), particles.weight[i]);
  }
  std::swap(particles, arranged_);
}

std::vector<std::uint32_t> ViewLikelihood::heaviest_sites(const Particles& particles,
                                                          std::size_t max_sites,
                                                          double min_weight) {
  group_particles(particles);
  std::vector<double> mass(sites_.size());
  std::vector<std::uint32_t> found;
  for (const Group& group : groups_) {
    if (group.cell == cells_.size()) continue;
    const Cell& cell = cells_[group.cell];
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      if (mass[near_sites_[i]] == 0.0) found.push_back(near_sites_[i]);
      mass[near_sites_[i]] += group.weight;
    }
  }
  std::erase_if(found, [&](std::uint32_t site) { return mass[site] < min_weight; });
  max_sites = std::min(max_sites, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(max_sites),
                    found.end(), [&](std::uint32_t a, std::uint32_t b) {
                      return mass[a] != mass[b] ? mass[a] > mass[b] : a < b;
                    });
  found.resize(max_sites);
  return found;
}

std::optional<std::uint32_t> ViewLikelihood::site_of(ViewId view) const noexcept {
  const auto at = std::ranges::lower_bound(sites_, view, {}, &Site::view);
  if (at == sites_.end() || at->view != view) return std::nullopt;
  return static_cast<std::uint32_t>(at - sites_.begin());
}

}  // namespace panonav
