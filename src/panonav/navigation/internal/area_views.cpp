#include "panonav/navigation/internal/area_views.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

SeenView::SeenView(const FourierSignature& seen, float full_scale, int components_)
    : packed(pack(seen, full_scale)),
      view(homing_view(seen)),
      components(components_ == 0 ? seen.components() : components_) {
  require(components >= 3 || components_ == 0, "components", components, "0, or 3 or more");
  if (components_ != 0) view = first_components(view, components_);
}

AreaViews::AreaViews(const ViewSource& source, int links) : source_(&source), links_(links) {}

std::optional<std::size_t> AreaViews::area() const noexcept {
  return here_.area;
}

void AreaViews::begin(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                      Loading& loading) const {
  loading = {.area = area};
  for (const std::size_t node : nodes_around(graph, areas.nodes.at(area), links_)) {
    loading.views.push_back(graph.view(node));
  }
}

void AreaViews::load(Loading& loading, std::size_t most) const {
  const std::size_t count = std::min(most, loading.views.size() - loading.loaded);
  if (count == 0) return;
  loading.parts.push_back(source_->load(std::span(loading.views).subspan(loading.loaded, count)));
  loading.coefficients.add(loading.parts.back());
  loading.loaded += count;
}

void AreaViews::enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area) {
  if (here_.area == area) return;
  if (ahead_.area == area) {
    here_ = std::move(ahead_);
  } else {
    begin(graph, areas, area, here_);
  }
  ahead_ = {};
  load(here_, here_.views.size());
}

void AreaViews::load_ahead(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                           int max_views) {
  if (here_.area == area) return;
  if (ahead_.area != area) begin(graph, areas, area, ahead_);
  load(ahead_, static_cast<std::size_t>(max_views));
}

const VisualMemory* AreaViews::part_of(ViewId view) const {
  const auto after = std::ranges::upper_bound(
      here_.parts, view, {}, [](const VisualMemory& part) { return part.views().front(); });
  if (after == here_.parts.begin()) return nullptr;
  const VisualMemory& part = *std::prev(after);
  return part.contains(view) ? &part : nullptr;
}

std::optional<CompassReading> AreaViews::turn_against(ViewId view, const SeenView& seen) {
  const VisualMemory* const part = part_of(view);
  require(part != nullptr, "view", static_cast<double>(view.value), "one that is loaded");
  bytes_read_ += 2 * static_cast<std::uint64_t>(seen.packed.shape.rows) * seen.components;
  return compass(seen.packed, part->packed(view), seen.components);
}

const HomingView& AreaViews::view(ViewId view, int components) {
  const HomingView* const held = here_.coefficients.find(view);
  require(held != nullptr, "view", static_cast<double>(view.value), "one that is loaded");
  // Magnitudes and phases, a byte each.
  bytes_read_ += 2 * static_cast<std::uint64_t>(held->rows()) *
                 (components == 0 ? held->components() : components);
  return *held;
}

std::optional<FoundView> AreaViews::nearest(const NavigationGraph& graph,
                                            std::span<const std::size_t> nodes,
                                            const SeenView& seen) {
  std::optional<FoundView> best;
  for (const std::size_t node : nodes) {
    const VisualMemory* const part = part_of(graph.view(node));
    if (part == nullptr) continue;
    const auto dissimilarity =
        dissimilarity_packed(seen.packed, part->packed(graph.view(node)), seen.components);
    bytes_read_ += static_cast<std::uint64_t>(seen.packed.shape.rows) * seen.components;
    const bool nearer =
        !best || std::tuple(dissimilarity, node) < std::tuple(best->dissimilarity, best->node);
    if (nearer) best = {node, dissimilarity, 0.0};
  }
  if (best) {
    best->difference = image_difference(view(graph.view(best->node), seen.components), seen.view);
  }
  return best;
}

std::optional<FoundView> AreaViews::nearest(const NavigationGraph& graph, const SeenView& seen) {
  std::optional<Match> best;
  for (const VisualMemory& part : here_.parts) {
    const SearchResult found = part.search(seen.packed, {.top = 1, .components = seen.components});
    bytes_read_ += found.bytes_read;
    for (const Match& match : found.matches) {
      if (!best || match.dissimilarity < best->dissimilarity) best = match;
    }
  }
  if (!best) return std::nullopt;
  return FoundView{*graph.node_of(best->view), best->dissimilarity,
                   image_difference(view(best->view, seen.components), seen.view)};
}

std::vector<PackedSignature> AreaViews::with_most_alike(ViewId view, const SeenView& seen,
                                                        int count) const {
  const VisualMemory* const own = part_of(view);
  require(own != nullptr, "view", static_cast<double>(view.value), "one that is loaded");
  std::vector<Match> others;
  for (const VisualMemory& part : here_.parts) {
    const SearchResult found =
        part.search(seen.packed, {.top = count, .components = seen.components},
                    {.excluded_views = std::span(&view, part.contains(view) ? 1 : 0)});
    others.insert(others.end(), found.matches.begin(), found.matches.end());
  }
  std::ranges::sort(others, {},
                    [](const Match& match) { return std::pair(match.dissimilarity, match.view); });
  std::vector<PackedSignature> alike{own->packed(view)};
  for (const Match& match : others) {
    if (alike.size() > static_cast<std::size_t>(count)) break;
    alike.push_back(part_of(match.view)->packed(match.view));
  }
  return alike;
}

}  // namespace panonav
