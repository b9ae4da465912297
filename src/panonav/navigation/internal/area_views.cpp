#include "panonav/navigation/internal/area_views.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

QueryView::QueryView(const FourierSignature& signature, float full_scale, int components_)
    : packed(pack(signature, full_scale)),
      view(homing_view(signature)),
      components(components_ == 0 ? signature.components() : components_) {
  require(components >= 3 || components_ == 0, "components", components, "0, or 3 or more");
  if (components_ != 0) view = first_components(view, components_);
}

AreaViews::AreaCache AreaViews::make_area_cache(const NavigationGraph& graph, const SubAreas& areas,
                                                std::size_t area) const {
  AreaCache cache{.area = area};
  for (const std::size_t node : nodes_around(graph, areas.nodes.at(area), links_)) {
    cache.views.push_back(graph.view(node));
  }
  return cache;
}

void AreaViews::load(AreaCache& area, std::size_t max_views) const {
  const std::size_t count = std::min(max_views, area.views.size() - area.loaded);
  if (count == 0) return;
  const auto views = std::span(area.views).subspan(area.loaded, count);
  const VisualMemory& part = area.parts.emplace_back(source_->load(views));
  for (const ViewId view : part.views()) area.coefficients.emplace(view, homing_view(part, view));
  area.loaded += count;
}

void AreaViews::enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area) {
  if (current_.area == area) return;
  current_ =
      prefetched_.area == area ? std::move(prefetched_) : make_area_cache(graph, areas, area);
  prefetched_ = {};
  load(current_, current_.views.size());
}

void AreaViews::prefetch(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                         int max_views) {
  if (current_.area == area) return;
  if (prefetched_.area != area) prefetched_ = make_area_cache(graph, areas, area);
  load(prefetched_, static_cast<std::size_t>(max_views));
}

const VisualMemory* AreaViews::find_part(ViewId view) const {
  const auto after = std::ranges::upper_bound(
      current_.parts, view, {}, [](const VisualMemory& part) { return part.views().front(); });
  if (after == current_.parts.begin()) return nullptr;
  const VisualMemory& part = *std::prev(after);
  return part.contains(view) ? &part : nullptr;
}

const VisualMemory& AreaViews::part_of(ViewId view) const {
  const VisualMemory* const part = find_part(view);
  require(part != nullptr, "view", static_cast<double>(view.value), "one that is loaded");
  return *part;
}

std::optional<CompassReading> AreaViews::read_compass(ViewId view, const QueryView& query) {
  const VisualMemory& part = part_of(view);
  bytes_read_ += 2 * static_cast<std::uint64_t>(query.packed.shape.rows) * query.components;
  return compass(query.packed, part.packed(view), query.components);
}

const HomingView& AreaViews::read_coefficients(ViewId view, int components) {
  const auto held = current_.coefficients.find(view);
  require(held != current_.coefficients.end(), "view", static_cast<double>(view.value),
          "one that is loaded");
  // Magnitudes and phases, a byte each.
  bytes_read_ += 2 * static_cast<std::uint64_t>(held->second.rows()) *
                 (components == 0 ? held->second.components() : components);
  return held->second;
}

std::optional<FoundView> AreaViews::find_nearest(const NavigationGraph& graph,
                                                 std::span<const std::size_t> nodes,
                                                 const QueryView& query) {
  std::optional<FoundView> best;
  for (const std::size_t node : nodes) {
    const VisualMemory* const part = find_part(graph.view(node));
    if (part == nullptr) continue;
    const auto dissimilarity =
        dissimilarity_packed(query.packed, part->packed(graph.view(node)), query.components);
    bytes_read_ += static_cast<std::uint64_t>(query.packed.shape.rows) * query.components;
    const bool is_nearer =
        !best || std::tuple(dissimilarity, node) < std::tuple(best->dissimilarity, best->node);
    if (is_nearer) best = {node, dissimilarity, 0.0};
  }
  if (best) {
    best->difference =
        image_difference(read_coefficients(graph.view(best->node), query.components), query.view);
  }
  return best;
}

std::optional<FoundView> AreaViews::find_nearest(const NavigationGraph& graph,
                                                 const QueryView& query) {
  std::optional<Match> best;
  for (const VisualMemory& part : current_.parts) {
    const SearchResult found =
        part.search(query.packed, {.top = 1, .components = query.components});
    bytes_read_ += found.bytes_read;
    for (const Match& match : found.matches) {
      if (!best || match.dissimilarity < best->dissimilarity) best = match;
    }
  }
  if (!best) return std::nullopt;
  return FoundView{*graph.node_of(best->view), best->dissimilarity,
                   image_difference(read_coefficients(best->view, query.components), query.view)};
}

std::vector<PackedSignature> AreaViews::most_similar_signatures(ViewId view, const QueryView& query,
                                                                int count) const {
  std::vector<PackedSignature> signatures{part_of(view).packed(view)};
  std::vector<Match> others;
  for (const VisualMemory& part : current_.parts) {
    const SearchResult found =
        part.search(query.packed, {.top = count, .components = query.components},
                    {.excluded_views = std::span(&view, part.contains(view) ? 1 : 0)});
    others.insert(others.end(), found.matches.begin(), found.matches.end());
  }
  std::ranges::sort(others, {},
                    [](const Match& match) { return std::pair(match.dissimilarity, match.view); });
  for (const Match& match : others) {
    if (signatures.size() > static_cast<std::size_t>(count)) break;
    signatures.push_back(part_of(match.view).packed(match.view));
  }
  return signatures;
}

}  // namespace panonav
