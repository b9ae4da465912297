#include "panonav/memory/sketch_index.hpp"

#include <algorithm>
#include <cstdlib>

namespace panonav {

namespace {

constexpr std::size_t group_bytes = 8;
constexpr std::int32_t no_slack = -static_cast<std::int32_t>(SketchIndex::no_view);

std::size_t groups_of(std::size_t dimensions) {
  return (dimensions + group_bytes - 1) / group_bytes;
}

/// The code nearest to `sum`, and what it misses. Any code would be safe, so rounding of the float
/// product does no harm.
struct Code {
  std::uint8_t code;
  std::int32_t missed;
};
Code encode_sum(std::int32_t sum, std::int32_t offset, std::uint64_t step, float inverse_step) {
  const float scaled = static_cast<float>(sum - offset) * inverse_step + 0.5F;
  const auto code = static_cast<std::int32_t>(std::clamp(scaled, 0.0F, 255.0F));
  const std::int32_t decoded = offset + code * static_cast<std::int32_t>(step);
  return {static_cast<std::uint8_t>(code), std::abs(sum - decoded)};
}

void set_scale(SketchScale& scale, std::vector<std::int32_t> lowest,
               std::vector<std::int32_t> highest, std::size_t groups) {
  scale.offsets = std::move(lowest);
  scale.highest = std::move(highest);
  scale.steps.assign(groups, 1);
  scale.inverse_steps.assign(groups, 1.0F);
  for (std::size_t d = 0; d < scale.offsets.size(); ++d) {
    const auto range = static_cast<std::uint64_t>(scale.highest[d] - scale.offsets[d]);
    std::uint64_t& step = scale.steps[d / group_bytes];
    step = std::max(step, (range + 254) / 255);
    scale.inverse_steps[d / group_bytes] = 1.0F / static_cast<float>(step);
  }
}

/// A query in the codes of one segment.
/// Where all views lie within the scale, what the query lies outside of it is part of the distance.
void encode_query(const SketchScale& scale, bool covers, std::span<const std::int32_t> sums,
                  std::span<const std::uint8_t> mask, std::size_t groups, std::uint8_t* values,
                  kernels::SketchQuery& encoded) {
  std::int32_t constant = 0;
  std::int32_t largest_slack = 0;
  const std::size_t dimensions = std::min(sums.size(), groups * group_bytes);
  for (std::size_t d = 0; d < dimensions; ++d) {
    if (mask[d] == 0) {
      values[d] = 0;
      continue;
    }
    const std::uint64_t step = scale.steps[d / group_bytes];
    std::int32_t sum = sums[d];
    if (covers) {
      sum = std::clamp(sum, scale.offsets[d], scale.highest[d]);
      constant += std::abs(sums[d] - sum);
      largest_slack += static_cast<std::int32_t>(step / 2 + 1);
    }
    const Code code = encode_sum(sum, scale.offsets[d], step, scale.inverse_steps[d / group_bytes]);
    values[d] = code.code;
    constant -= code.missed;
  }
  encoded.steps = scale.steps.data();
  encoded.groups = groups;
  encoded.constant = constant;
  encoded.largest_slack = covers ? largest_slack : static_cast<std::int32_t>(SketchIndex::no_view);
}

}  // namespace

SketchLayout::SketchLayout(SignatureShape shape_) : shape(shape_) {
  // Where a block would hold fewer than about three rows, a sketch costs as much as what it saves.
  if (shape.rows >= 3) coarse_blocks = shape.rows >= 6 ? 2 : 1;
  if (shape.rows >= 20) fine_blocks = BlockSums::blocks_per_component;
  const auto components = static_cast<std::size_t>(shape.components);
  coarse_groups = groups_of(components * coarse_blocks);
  fine_groups = (groups_of(components * fine_blocks) + 7) / 8 * 8;
}

void SketchLayout::sum_blocks(const std::uint8_t* magnitudes, BlockSums& sums) const {
  const auto components = static_cast<std::size_t>(shape.components);
  sums.fine.resize(components * fine_blocks);
  sums.coarse.resize(components * coarse_blocks);
  const int blocks = fine_blocks > 0 ? fine_blocks : coarse_blocks;
  std::int32_t* const out = fine_blocks > 0 ? sums.fine.data() : sums.coarse.data();
  std::array<int, BlockSums::blocks_per_component + 1> borders{};
  for (int block = 0; block <= blocks; ++block) borders[block] = first_row(block, blocks);
  for (std::size_t k = 0; k < components; ++k) {
    const std::uint8_t* const rows = magnitudes + k * shape.rows;
    for (int block = 0; block < blocks; ++block) {
      std::int32_t sum = 0;
      for (int row = borders[block]; row < borders[block + 1]; ++row) sum += rows[row];
      out[k * blocks + block] = sum;
    }
  }
  if (fine_blocks == 0) return;
  const int joined = fine_blocks / coarse_blocks;
  for (std::size_t d = 0; d < sums.coarse.size(); ++d) {
    sums.coarse[d] = 0;
    for (int i = 0; i < joined; ++i) sums.coarse[d] += sums.fine[d * joined + i];
  }
}

SketchIndex::Segment SketchIndex::make_segment() const {
  // Until enough views are there to learn from, a scale that holds every possible sum.
  const auto make_level = [this](int blocks, std::size_t groups) {
    std::vector<std::int32_t> highest(static_cast<std::size_t>(layout_.shape.components) * blocks);
    for (std::size_t d = 0; d < highest.size(); ++d) {
      const int block = static_cast<int>(d) % blocks;
      highest[d] = 255 * (layout_.first_row(block + 1, blocks) - layout_.first_row(block, blocks));
    }
    Level level;
    std::vector<std::int32_t> lowest(highest.size(), 0);
    set_scale(level.scale, std::move(lowest), std::move(highest), groups);
    return level;
  };
  Segment segment;
  segment.coarse = make_level(layout_.coarse_blocks, layout_.coarse_groups);
  segment.fine = make_level(layout_.fine_blocks, layout_.fine_groups);
  return segment;
}

bool SketchIndex::encode(Segment& segment, std::size_t place, const BlockSums& sums) const {
  const auto encode_level = [](Level& level, std::size_t where, std::size_t group_stride,
                               std::size_t slack_at, const std::vector<std::int32_t>& values) {
    std::int32_t slack = 0;
    bool within = true;
    const SketchScale& scale = level.scale;
    for (std::size_t d = 0; d < values.size(); ++d) {
      const std::size_t group = d / group_bytes;
      const Code code =
          encode_sum(values[d], scale.offsets[d], scale.steps[group], scale.inverse_steps[group]);
      level.codes[where + group * group_stride + d % group_bytes] = code.code;
      slack += code.missed;
      within = within && values[d] >= scale.offsets[d] && values[d] <= scale.highest[d];
    }
    level.slacks[slack_at] = slack;
    level.covers = level.covers && within;
    return within;
  };
  bool within = encode_level(segment.coarse,
                             (place / 8 * layout_.coarse_groups * 8 + place % 8) * group_bytes,
                             8 * group_bytes, place, sums.coarse);
  if (layout_.fine_blocks > 0) {
    within &= encode_level(segment.fine, place * layout_.fine_groups * group_bytes, group_bytes,
                           place, sums.fine);
  }
  return within;
}

void SketchIndex::learn(Segment& segment, std::size_t first_row, const ViewStore& store) const {
  BlockSums sums;
  std::vector<std::int32_t> low_coarse, high_coarse, low_fine, high_fine;
  const auto widen = [](const std::vector<std::int32_t>& values, std::vector<std::int32_t>& low,
                        std::vector<std::int32_t>& high) {
    if (low.empty()) {
      low = values;
      high = values;
    }
    for (std::size_t d = 0; d < values.size(); ++d) {
      low[d] = std::min(low[d], values[d]);
      high[d] = std::max(high[d], values[d]);
    }
  };
  const std::size_t rows = segment.coarse.slacks.size();
  for (std::size_t place = 0; place < rows; ++place) {
    if (segment.coarse.slacks[place] == no_slack) continue;
    layout_.sum_blocks(store.magnitudes(static_cast<Row>(first_row + place)), sums);
    widen(sums.coarse, low_coarse, high_coarse);
    widen(sums.fine, low_fine, high_fine);
  }
  set_scale(segment.coarse.scale, std::move(low_coarse), std::move(high_coarse),
            layout_.coarse_groups);
  set_scale(segment.fine.scale, std::move(low_fine), std::move(high_fine), layout_.fine_groups);
  segment.coarse.covers = true;
  segment.fine.covers = true;
  for (std::size_t place = 0; place < rows; ++place) {
    if (segment.coarse.slacks[place] == no_slack) continue;
    layout_.sum_blocks(store.magnitudes(static_cast<Row>(first_row + place)), sums);
    encode(segment, place, sums);
  }
  segment.learnt_from = segment.used;
  segment.outside = 0;
}

void SketchIndex::insert(const ViewStore& store, Row row) {
  if (!layout_.any()) return;
  const std::size_t number = row / rows_per_segment;
  const std::size_t place = row % rows_per_segment;
  if (number == segments_.size()) segments_.push_back(make_segment());
  Segment& segment = segments_[number];
  if (place >= segment.coarse.slacks.size()) {
    const std::size_t rows = place / rows_per_block * rows_per_block + rows_per_block;
    segment.coarse.codes.resize(rows * layout_.coarse_groups * group_bytes);
    segment.coarse.slacks.resize(rows, no_slack);
    segment.fine.codes.resize(rows * layout_.fine_groups * group_bytes);
    segment.fine.slacks.resize(layout_.fine_blocks > 0 ? rows : 0, no_slack);
  }
  rows_end_ = std::max(rows_end_, std::size_t{row} + 1);

  BlockSums sums;
  layout_.sum_blocks(store.magnitudes(row), sums);
  if (!encode(segment, place, sums)) ++segment.outside;
  ++segment.used;
  constexpr std::size_t enough_to_learn = 16;
  const bool grown = segment.used >= std::max(enough_to_learn, 4 * segment.learnt_from);
  const bool drifted = segment.outside >= enough_to_learn + segment.used / 4;
  if (grown || drifted) learn(segment, number * rows_per_segment, store);
}

void SketchIndex::erase(Row row) {
  if (!layout_.any()) return;
  Segment& segment = segments_[row / rows_per_segment];
  const std::size_t place = row % rows_per_segment;
  segment.coarse.slacks[place] = no_slack;
  if (layout_.fine_blocks > 0) segment.fine.slacks[place] = no_slack;
  --segment.used;
}

SketchIndex::Query SketchIndex::prepare(const std::uint8_t* magnitudes, int components,
                                        std::span<const std::uint8_t> allowed_rows) const {
  Query query;
  layout_.sum_blocks(magnitudes, query.sums);
  const auto mask_of = [&](int blocks, std::size_t groups) {
    std::vector<std::uint8_t> mask(groups * group_bytes, 0);
    for (int block = 0; block < blocks; ++block) {
      bool counts = true;
      if (!allowed_rows.empty()) {
        for (int row = layout_.first_row(block, blocks); row < layout_.first_row(block + 1, blocks);
             ++row) {
          counts = counts && allowed_rows[row] != 0;
        }
      }
      for (int k = 0; counts && k < components; ++k) {
        mask[static_cast<std::size_t>(k) * blocks + block] = 255;
      }
    }
    return mask;
  };
  query.coarse_mask = mask_of(layout_.coarse_blocks, layout_.coarse_groups);
  query.fine_mask = mask_of(layout_.fine_blocks, layout_.fine_groups);
  const auto wanted = static_cast<std::size_t>(components);
  query.coarse_groups = groups_of(wanted * layout_.coarse_blocks);
  query.fine_groups = (groups_of(wanted * layout_.fine_blocks) + 7) / 8 * 8;
  return query;
}

void SketchIndex::coarse_bounds(const kernels::DistanceKernels& kernels, const Query& query,
                                std::span<std::uint32_t> bounds,
                                std::span<std::uint32_t> smallest) const {
  std::vector<std::uint8_t> values(layout_.coarse_groups * group_bytes, 0);
  kernels::SketchQuery encoded{};
  encoded.values = values.data();
  encoded.mask = query.coarse_mask.data();
  encoded.stored_groups = layout_.coarse_groups;
  std::size_t block = 0;
  for (const Segment& segment : segments_) {
    encode_query(segment.coarse.scale, segment.coarse.covers, query.sums.coarse, query.coarse_mask,
                 query.coarse_groups, values.data(), encoded);
    const std::size_t blocks_here = segment.coarse.slacks.size() / rows_per_block;
    for (std::size_t i = 0; i < blocks_here; ++i, ++block) {
      const std::size_t place = i * rows_per_block;
      smallest[block] = kernels.sketch_bounds(
          segment.coarse.codes.data() + place * layout_.coarse_groups * group_bytes,
          segment.coarse.slacks.data() + place, rows_per_block / 8, encoded,
          bounds.data() + block * rows_per_block);
    }
  }
}

SketchIndex::FineBounds::FineBounds(const SketchIndex& index,
                                    const kernels::DistanceKernels& kernels, const Query& query)
    : index_(index),
      kernels_(kernels),
      query_(query),
      values_(index.layout_.fine_groups * group_bytes, 0),
      mask_(query.fine_mask.begin(), query.fine_mask.end()) {
  encoded_.values = values_.data();
  encoded_.mask = mask_.data();
  encoded_.stored_groups = index.layout_.fine_groups;
}

std::uint32_t SketchIndex::FineBounds::operator()(Row row) {
  const std::size_t number = row / rows_per_segment;
  const std::size_t place = row % rows_per_segment;
  const Level& level = index_.segments_[number].fine;
  if (number != segment_) {
    encode_query(level.scale, level.covers, query_.sums.fine, query_.fine_mask, query_.fine_groups,
                 values_.data(), encoded_);
    segment_ = number;
  }
  return kernels_.sketch_bound(
      level.codes.data() + place * index_.layout_.fine_groups * group_bytes, level.slacks[place],
      encoded_);
}

void SketchIndex::FineBounds::prefetch(Row row) const noexcept {
  const Level& level = index_.segments_[row / rows_per_segment].fine;
  const std::uint8_t* const code =
      level.codes.data() + (row % rows_per_segment) * index_.layout_.fine_groups * group_bytes;
  for (std::size_t i = 0; i < query_.fine_groups * group_bytes; i += 64) {
    __builtin_prefetch(code + i);
  }
}

std::size_t SketchIndex::FineBounds::bytes() const noexcept {
  return query_.fine_groups * group_bytes + sizeof(std::int32_t);
}

}  // namespace panonav
