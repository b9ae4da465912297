#include "panonav_fleet/internal/view_sketches.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/internal/comparison.hpp"
#include "panonav_fleet/internal/sketch_search.hpp"

namespace panonav::fleet {

namespace {

LiveSegment make_live_segment(std::shared_ptr<const SketchSegment> sketches) {
  LiveSegment segment{std::move(sketches), {}, 0};
  segment.count = segment.sketches->rows();
  segment.live.assign(segment.sketches->blocks(), ~std::uint64_t{0});
  if (segment.count % 64 != 0) segment.live.back() >>= 64 - segment.count % 64;
  return segment;
}

}  // namespace

struct ViewSketches::Implementation {
  explicit Implementation(SignatureShape shape)
      : layout(std::make_shared<const SegmentLayout>(shape)) {}

  std::shared_ptr<const SegmentLayout> layout;
  std::vector<LiveSegment> segments;  // full ones, then the growing one
  /// Magnitudes of the last segment until it is full, because it is sketched again when views are
  /// added.
  std::shared_ptr<const std::vector<std::uint8_t>> growing;
  std::size_t size = 0;

  /// Appends the views of the growing segment with their magnitudes; nothing if all segments are
  /// full.
  void append_growing_segment(std::vector<ViewId>& ids,
                              std::vector<std::uint8_t>& magnitudes) const {
    if (!growing) return;
    const LiveSegment& last = segments.back();
    const std::size_t view_bytes = layout->shape().size();
    for (std::size_t row = 0; row < last.sketches->rows(); ++row) {
      if (!last.has(row)) continue;
      ids.push_back(last.sketches->views()[row]);
      const auto from = growing->begin() + static_cast<std::ptrdiff_t>(row * view_bytes);
      magnitudes.insert(magnitudes.end(), from, from + static_cast<std::ptrdiff_t>(view_bytes));
    }
  }
};

ViewSketches::ViewSketches(SignatureShape shape) {
  static_cast<void>(VisualMemory(shape, 1.0F, {}));  // refuses shapes that no memory has
  implementation_ = std::make_unique<Implementation>(shape);
}
ViewSketches::~ViewSketches() = default;
ViewSketches::ViewSketches(const ViewSketches& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
ViewSketches& ViewSketches::operator=(const ViewSketches& other) {
  if (this != &other) *implementation_ = *other.implementation_;
  return *this;
}
ViewSketches::ViewSketches(ViewSketches&&) noexcept = default;
ViewSketches& ViewSketches::operator=(ViewSketches&&) noexcept = default;

SignatureShape ViewSketches::shape() const noexcept {
  return implementation_->layout->shape();
}
std::size_t ViewSketches::size() const noexcept {
  return implementation_->size;
}

std::uint64_t ViewSketches::bytes() const noexcept {
  std::uint64_t bytes = implementation_->growing ? implementation_->growing->size() : 0;
  for (const LiveSegment& segment : implementation_->segments) {
    bytes += segment.sketches->bytes() + segment.live.size() * sizeof(std::uint64_t);
  }
  return bytes;
}

std::vector<ViewId> ViewSketches::views() const {
  std::vector<ViewId> views;
  views.reserve(size());
  for (const LiveSegment& segment : implementation_->segments) {
    for (std::size_t row = 0; row < segment.sketches->rows(); ++row) {
      if (segment.has(row)) views.push_back(segment.sketches->views()[row]);
    }
  }
  if (!std::ranges::is_sorted(views)) std::ranges::sort(views);
  return views;
}

void ViewSketches::insert(std::span<const ViewId> views, std::span<const std::uint8_t> magnitudes) {
  Implementation& own = *implementation_;
  const std::size_t view_bytes = shape().size();
  require(magnitudes.size() == views.size() * view_bytes, "number of magnitudes",
          static_cast<double>(magnitudes.size()), to_text(double(views.size() * view_bytes)));
  if (views.empty()) return;
  // The views of the growing segment come first.
  std::vector<ViewId> ids;
  std::vector<std::uint8_t> bytes;
  own.append_growing_segment(ids, bytes);
  if (own.growing) {
    own.segments.pop_back();
    own.growing.reset();
  }
  own.size += views.size();
  const std::size_t max_rows = own.layout->max_rows();
  while (!views.empty()) {
    const std::size_t count = std::min(views.size(), max_rows - ids.size());
    const auto of_these = magnitudes.first(count * view_bytes);
    if (ids.empty() && count == max_rows) {
      own.segments.push_back(make_live_segment(
          std::make_shared<const SketchSegment>(*own.layout, views.first(count), of_these)));
    } else {
      ids.insert(ids.end(), views.begin(), views.begin() + static_cast<std::ptrdiff_t>(count));
      bytes.insert(bytes.end(), of_these.begin(), of_these.end());
      if (ids.size() == max_rows || count == views.size()) {
        own.segments.push_back(
            make_live_segment(std::make_shared<const SketchSegment>(*own.layout, ids, bytes)));
        if (ids.size() < max_rows) {
          own.growing = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
        }
        ids.clear();
        bytes.clear();
      }
    }
    views = views.subspan(count);
    magnitudes = magnitudes.subspan(of_these.size());
  }
}

void ViewSketches::insert(const ViewSketches& other) {
  Implementation& own = *implementation_;
  const Implementation& added = *other.implementation_;
  if (!(shape() == other.shape())) {
    throw ContractError(
        "shape of other sketches",
        std::to_string(other.shape().rows) + " x " + std::to_string(other.shape().components),
        std::to_string(shape().rows) + " x " + std::to_string(shape().components));
  }
  const std::size_t full = added.segments.size() - (added.growing ? 1 : 0);
  const auto at = own.segments.end() - (own.growing ? 1 : 0);
  own.segments.insert(at, added.segments.begin(),
                      added.segments.begin() + static_cast<std::ptrdiff_t>(full));
  for (std::size_t i = 0; i < full; ++i) own.size += added.segments[i].count;
  std::vector<ViewId> ids;
  std::vector<std::uint8_t> bytes;
  added.append_growing_segment(ids, bytes);
  insert(ids, bytes);
}

void ViewSketches::erase(std::span<const ViewId> views) {
  Implementation& own = *implementation_;
  std::vector<ViewId> gone(views.begin(), views.end());
  std::ranges::sort(gone);
  for (LiveSegment& segment : own.segments) {
    const SketchSegment& sketches = *segment.sketches;
    const auto first = std::ranges::lower_bound(gone, sketches.smallest_id());
    if (first == gone.end() || sketches.largest_id() < *first) continue;
    for (std::size_t row = 0; row < sketches.rows(); ++row) {
      if (!segment.has(row) || !std::ranges::binary_search(gone, sketches.views()[row])) continue;
      segment.live[row / 64] &= ~(std::uint64_t{1} << (row % 64));
      --segment.count;
      --own.size;
    }
  }
  if (own.growing && own.segments.back().count == 0) own.growing.reset();
  std::erase_if(own.segments, [](const LiveSegment& segment) { return segment.count == 0; });
}

SearchResult ViewSketches::search(const PackedSignature& query, const SearchOptions& options,
                                  const SearchMask& mask, const ReadViews& read,
                                  Executor& executor) const {
  require(options.top >= 1, "top", options.top, ">= 1");
  require_signature(query, shape());
  require_mask(mask, shape());
  const int components = resolve_components(options.components, shape());
  const std::size_t top = std::min(static_cast<std::size_t>(options.top), size());
  const std::uint64_t in_full = std::uint64_t{size()} * static_cast<std::uint64_t>(components) *
                                static_cast<std::uint64_t>(shape().rows);
  SearchResult result;
  if (top > 0) {
    result = search_segments(*implementation_->layout, implementation_->segments, query, components,
                             mask, top, read, executor);
  }
  result.bytes_in_full = in_full;
  return result;
}

}  // namespace panonav::fleet
