#include "panonav_fleet/internal/sketch_segment.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>
#include <numeric>

namespace panonav::fleet {

namespace {

constexpr std::size_t codes_per_cell = 16;  // each code has four bits
constexpr std::size_t sums_per_step = 8;    // that share a step

std::size_t round_up(std::size_t count, std::size_t multiple) {
  return (count + multiple - 1) / multiple * multiple;
}

/// Returns the number of blocks of a component. Low components have more, because views differ most
/// in them; with 15 components the sums fill whole cache lines.
int choose_block_count(int level, int component, int components) {
  constexpr std::array default_block_counts{2, 4, 16};
  if (level == 2) return component == 0 ? 2 * default_block_counts[2] : default_block_counts[2];
  if (component < 2) return 2 * default_block_counts[static_cast<std::size_t>(level)];
  const bool last = component + 2 >= components;
  return default_block_counts[static_cast<std::size_t>(level)] / (last ? 2 : 1);
}

std::int32_t sum_bytes(const std::uint8_t* bytes, int count) {
  return std::accumulate(bytes, bytes + count, std::int32_t{0});
}

}  // namespace

SegmentLayout::SegmentLayout(SignatureShape shape) : shape_(shape) {
  const auto max_blocks = static_cast<int>(std::bit_floor(static_cast<unsigned>(shape.rows)));
  for (int level = 0; level < levels; ++level) {
    std::size_t sums = 0;
    for (int k = 0; k < shape.components; ++k) {
      const int blocks = std::min(max_blocks, choose_block_count(level, k, shape.components));
      blocks_[level].push_back(blocks);
      sums += static_cast<std::size_t>(blocks);
    }
    dimensions_[level] = round_up(sums, level == 0 ? 2 : 64);
  }
  constexpr std::size_t page_bytes = LargePageAllocator<std::uint8_t>::page_bytes;
  max_rows_ = std::clamp<std::size_t>(page_bytes / bytes() / kernels::cell_block, 1, 128) *
              kernels::cell_block;
}

void SegmentLayout::sum_blocks(const std::uint8_t* magnitudes, std::int32_t* sums) const {
  std::array<std::int32_t*, levels> at{sums, sums + dimensions_[0],
                                       sums + dimensions_[0] + dimensions_[1]};
  std::int32_t* const end = sums + total();
  for (int k = 0; k < shape_.components; ++k) {
    const std::uint8_t* const rows = magnitudes + static_cast<std::size_t>(k) * shape_.rows;
    const int finest = blocks_[2][k];
    for (int block = 0; block < finest; ++block) {
      const int first = first_row(block, finest);
      at[2][block] = sum_bytes(rows + first, first_row(block + 1, finest) - first);
    }
    for (int level = 1; level >= 0; --level) {
      const int blocks = blocks_[level][k];
      const int joined = blocks_[level + 1][k] / blocks;
      for (int block = 0; block < blocks; ++block) {
        const std::int32_t* const from = at[level + 1] + block * joined;
        at[level][block] = std::accumulate(from, from + joined, std::int32_t{0});
      }
    }
    for (int level = 0; level < levels; ++level) at[level] += blocks_[level][k];
  }
  std::fill(at[0], sums + dimensions_[0], 0);
  std::fill(at[1], sums + dimensions_[0] + dimensions_[1], 0);
  std::fill(at[2], end, 0);
}

std::vector<std::int32_t> SegmentLayout::make_sum_flags(
    int components, std::span<const std::uint8_t> allowed_rows) const {
  std::vector<std::int32_t> sum_flags;
  std::size_t padded = 0;
  for (int level = 0; level < levels; ++level) {
    for (int k = 0; k < components; ++k) {
      const int blocks = blocks_[level][k];
      for (int block = 0; block < blocks; ++block) {
        const int first = first_row(block, blocks);
        const int rows = first_row(block + 1, blocks) - first;
        const bool all =
            allowed_rows.empty() || std::ranges::count(allowed_rows.subspan(first, rows), 0) == 0;
        sum_flags.push_back(all ? 1 : 0);
      }
    }
    padded += dimensions_[level];
    sum_flags.resize(padded, 0);
  }
  return sum_flags;
}

SketchSegment::SketchSegment(const SegmentLayout& layout, std::span<const ViewId> views,
                             std::span<const std::uint8_t> magnitudes)
    : views_(views.begin(), views.end()),
      smallest_id_(std::ranges::min(views)),
      largest_id_(std::ranges::max(views)) {
  std::vector<std::int32_t> sums(views.size() * layout.total());
  for (std::size_t row = 0; row < views.size(); ++row) {
    layout.sum_blocks(magnitudes.data() + row * layout.shape().size(),
                      sums.data() + row * layout.total());
  }
  const std::size_t padded = blocks() * kernels::cell_block;
  // Sketches of levels 1 and 2 begin on cache lines.
  begins_[1] = round_up(padded * layout.dimensions(0) / 2, 64);
  begins_[2] = begins_[1] + padded * layout.dimensions(1);
  codes_.resize(begins_[2] + padded * layout.dimensions(2));
  const std::size_t view_bytes = layout.shape().size();
  lowest_.assign(magnitudes.begin(), magnitudes.begin() + static_cast<std::ptrdiff_t>(view_bytes));
  highest_ = lowest_;
  for (std::size_t row = 1; row < views.size(); ++row) {
    const std::uint8_t* const view = magnitudes.data() + row * view_bytes;
    for (std::size_t i = 0; i < view_bytes; ++i) {
      lowest_[i] = std::min(lowest_[i], view[i]);
      highest_[i] = std::max(highest_[i], view[i]);
    }
  }
  make_cells(layout, sums);
  make_level(layout, 1, sums);
  make_level(layout, 2, sums);
}

std::size_t SketchSegment::blocks() const noexcept {
  return (views_.size() + kernels::cell_block - 1) / kernels::cell_block;
}

std::uint64_t SketchSegment::bytes() const noexcept {
  std::uint64_t bytes = codes_.size() + views_.size() * sizeof(ViewId) +
                        (cell_low_.size() + cell_high_.size()) * sizeof(std::int32_t) +
                        lowest_.size() + highest_.size();
  for (const Scale& scale : scales_) {
    bytes += (2 * scale.offsets.size() + scale.max_missed.size()) * sizeof(std::int32_t) +
             scale.steps.size() * (sizeof(std::uint64_t) + sizeof(float));
  }
  return bytes;
}

// Chooses codes so that each represents about the same number of views.
void SketchSegment::make_cells(const SegmentLayout& layout, const std::vector<std::int32_t>& sums) {
  constexpr unsigned max_bins = 1024;
  const std::size_t cells = layout.dimensions(0);
  std::vector<std::int32_t> low(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(cells));
  std::vector<std::int32_t> high = low;
  for (std::size_t row = 0; row < rows(); ++row) {
    const std::int32_t* const of_row = sums.data() + row * layout.total();
    for (std::size_t d = 0; d < cells; ++d) {
      low[d] = std::min(low[d], of_row[d]);
      high[d] = std::max(high[d], of_row[d]);
    }
  }
  std::vector<int> shifts(cells);
  for (std::size_t d = 0; d < cells; ++d) {
    const auto range = static_cast<unsigned>(high[d] - low[d]);
    while ((range >> shifts[d]) >= max_bins) ++shifts[d];
  }
  const auto bin = [&](std::size_t d, std::int32_t sum) {
    return d * max_bins + static_cast<std::size_t>((sum - low[d]) >> shifts[d]);
  };
  std::vector<std::uint32_t> counts(cells * max_bins, 0);
  for (std::size_t row = 0; row < rows(); ++row) {
    const std::int32_t* const of_row = sums.data() + row * layout.total();
    for (std::size_t d = 0; d < cells; ++d) ++counts[bin(d, of_row[d])];
  }
  std::vector<std::uint8_t> code_of_bin(counts.size());
  for (std::size_t d = 0; d < cells; ++d) {
    std::size_t below = 0;
    for (std::size_t b = d * max_bins; b < (d + 1) * max_bins; ++b) {
      code_of_bin[b] =
          static_cast<std::uint8_t>(std::min(codes_per_cell - 1, below * codes_per_cell / rows()));
      below += counts[b];
    }
  }
  cell_low_.assign(cells * codes_per_cell, std::numeric_limits<std::int32_t>::max());
  cell_high_.assign(cells * codes_per_cell, std::numeric_limits<std::int32_t>::min());
  for (std::size_t row = 0; row < rows(); ++row) {
    const std::int32_t* const of_row = sums.data() + row * layout.total();
    std::uint8_t* const block =
        codes_.data() + row / kernels::cell_block * kernels::cell_block * (cells / 2);
    const std::size_t row_in_block = row % kernels::cell_block;
    for (std::size_t d = 0; d < cells; ++d) {
      const std::uint8_t code = code_of_bin[bin(d, of_row[d])];
      std::int32_t& smallest = cell_low_[d * codes_per_cell + code];
      std::int32_t& largest = cell_high_[d * codes_per_cell + code];
      smallest = std::min(smallest, of_row[d]);
      largest = std::max(largest, of_row[d]);
      std::uint8_t& byte = block[d / 2 * kernels::cell_block + row_in_block];
      byte = static_cast<std::uint8_t>(byte | (d % 2 == 0 ? code : code << 4));
    }
  }
  for (std::size_t i = 0; i < cell_low_.size(); ++i) {  // codes of no view
    if (cell_high_[i] < cell_low_[i]) cell_low_[i] = cell_high_[i] = low[i / codes_per_cell];
  }
}

void SketchSegment::make_level(const SegmentLayout& layout, int level,
                               const std::vector<std::int32_t>& sums) {
  const std::size_t count = layout.dimensions(level);
  const std::size_t groups = count / sums_per_step;
  std::size_t begin = 0;
  for (int before = 0; before < level; ++before) begin += layout.dimensions(before);
  Scale& scale = scales_[static_cast<std::size_t>(level) - 1];
  const auto of = [&](std::size_t row) { return sums.data() + row * layout.total() + begin; };
  scale.offsets.assign(of(0), of(0) + count);
  scale.highest = scale.offsets;
  for (std::size_t row = 0; row < rows(); ++row) {
    const std::int32_t* const of_row = of(row);
    for (std::size_t d = 0; d < count; ++d) {
      scale.offsets[d] = std::min(scale.offsets[d], of_row[d]);
      scale.highest[d] = std::max(scale.highest[d], of_row[d]);
    }
  }
  scale.steps.assign(groups, 1);
  scale.inverse_steps.assign(groups, 1.0F);
  scale.max_missed.assign(groups, 0);
  for (std::size_t d = 0; d < count; ++d) {
    const auto range = static_cast<std::uint64_t>(scale.highest[d] - scale.offsets[d]);
    std::uint64_t& step = scale.steps[d / sums_per_step];
    step = std::max(step, (range + 254) / 255);
    scale.inverse_steps[d / sums_per_step] = 1.0F / static_cast<float>(step);
  }
  for (std::size_t row = 0; row < rows(); ++row) {
    const std::int32_t* const of_row = of(row);
    std::uint8_t* const codes =
        codes_.data() + begins_[static_cast<std::size_t>(level)] + row * count;
    std::int32_t slack = 0;
    for (std::size_t group = 0; group < groups; ++group) {
      const auto step = static_cast<std::int32_t>(scale.steps[group]);
      std::int32_t missed = 0;
      for (std::size_t d = group * sums_per_step; d < (group + 1) * sums_per_step; ++d) {
        // The bounds are correct for any code, so rounding of the float product does no harm.
        const std::int32_t above = of_row[d] - scale.offsets[d];
        const float scaled = static_cast<float>(above) * scale.inverse_steps[group] + 0.5F;
        const auto code = static_cast<std::int32_t>(std::min(scaled, 255.0F));
        codes[d] = static_cast<std::uint8_t>(code);
        missed += std::abs(above - code * step);
      }
      scale.max_missed[group] = std::max(scale.max_missed[group], missed);
      slack += missed;
    }
    scale.max_slack = std::max(scale.max_slack, slack);
  }
}

SegmentQuery::SegmentQuery(const SegmentLayout& layout, std::span<const std::uint8_t> magnitudes,
                           int components, std::span<const std::uint8_t> allowed_rows)
    : sums(layout.total()), sum_flags(layout.make_sum_flags(components, allowed_rows)) {
  layout.sum_blocks(magnitudes.data(), sums.data());
  for (std::size_t i = layout.dimensions(0); i < sum_flags.size(); ++i) {
    mask.push_back(sum_flags[i] != 0 ? 255 : 0);
  }
  for (std::size_t i = 0; i < mask.size(); i += sums_per_step) {
    group_flags.push_back(std::ranges::count(std::span(mask).subspan(i, sums_per_step), 255) > 0);
  }
}

void SegmentQuery::choose_unit(const SegmentLayout& layout, std::uint32_t largest) {
  constexpr std::uint32_t max_code = 254;
  unit = largest / max_code + 1;
  // Slightly less than the inverse, so that rounding never makes an entry too large.
  const float inverse = (1.0F - 1e-6F) / static_cast<float>(unit);
  factors.resize(layout.dimensions(0));
  for (std::size_t d = 0; d < factors.size(); ++d) {
    factors[d] = static_cast<float>(sum_flags[d]) * inverse;
  }
}

void SketchSegment::clamp(std::span<const std::uint8_t> magnitudes,
                          std::span<std::uint8_t> clamped) const {
  for (std::size_t i = 0; i < clamped.size(); ++i) {
    clamped[i] = std::min(std::max(magnitudes[i], lowest_[i]), highest_[i]);
  }
}

void SketchSegment::prefetch_tables() const noexcept {
  const auto prefetch = [](const auto& numbers) {
    const auto* const bytes = reinterpret_cast<const char*>(numbers.data());
    const std::size_t count = numbers.size() * sizeof(numbers[0]);
    for (std::size_t i = 0; i < count; i += 64) __builtin_prefetch(bytes + i);
  };
  prefetch(cell_low_);
  prefetch(cell_high_);
  for (const Scale& scale : scales_) {
    prefetch(scale.offsets);
    prefetch(scale.highest);
  }
}

void SketchSegment::make_cell_tables(const SegmentLayout& layout,
                                     const kernels::DistanceKernels& kernels,
                                     const SegmentQuery& query,
                                     std::span<std::uint8_t> tables) const {
  kernels.cell_tables(cell_low_.data(), cell_high_.data(), query.sums.data(), query.factors.data(),
                      layout.dimensions(0), tables.data());
}

std::span<const std::uint32_t> SketchSegment::compute_cell_bounds(
    const SegmentLayout& layout, const kernels::DistanceKernels& kernels, const SegmentQuery& query,
    std::span<const std::uint8_t> tables, std::uint32_t limit, std::size_t first, std::size_t count,
    std::span<std::uint8_t> bounds, std::span<std::uint32_t> indices) const {
  const std::size_t pairs = layout.dimensions(0) / 2;
  const std::uint32_t inside = limit - std::min(limit, query.outside);
  const auto units = static_cast<std::uint8_t>(std::min(inside / query.unit, 255U));
  return indices.first(kernels.cell_bounds(codes_.data() + first * kernels::cell_block * pairs,
                                           count, {tables.data(), pairs, units}, bounds.data(),
                                           indices.data()));
}

// The sums of all views are within the scale, so the part of the query's sum outside of it is
// part of the distance.
void SketchSegment::compute_level_bounds(const SegmentLayout& layout,
                                         const kernels::DistanceKernels& kernels,
                                         const SegmentQuery& query, int level,
                                         std::span<const std::uint32_t> rows,
                                         std::span<std::uint8_t> values,
                                         std::uint32_t* bounds) const {
  const Scale& scale = scales_[static_cast<std::size_t>(level) - 1];
  const std::size_t groups = scale.steps.size();
  const std::size_t begin = level == 2 ? layout.dimensions(1) : 0;  // among levels 1 and 2
  const std::size_t sums_begin = layout.dimensions(0) + begin;
  const std::int32_t constant =
      kernels.encode_query(query.sums.data() + sums_begin, query.sum_flags.data() + sums_begin,
                           {scale.offsets.data(), scale.highest.data(), scale.steps.data(),
                            scale.inverse_steps.data(), groups},
                           values.data());
  std::int32_t slack = 0;
  for (std::size_t group = 0; group < groups; ++group) {
    if (query.group_flags[begin / sums_per_step + group]) slack += scale.max_missed[group];
  }
  const kernels::DistanceKernels::SketchQuery encoded{
      values.data(),
      query.mask.data() + begin,
      scale.steps.data(),
      groups,
      groups,
      constant + static_cast<std::int32_t>(query.outside),
      std::min(slack, scale.max_slack)};
  kernels.sketch_bounds_at(codes_.data() + begins_[static_cast<std::size_t>(level)], nullptr,
                           rows.data(), rows.size(), encoded, bounds);
}

}  // namespace panonav::fleet
