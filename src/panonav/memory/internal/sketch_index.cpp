#include "panonav/memory/internal/sketch_index.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <numeric>

#include "panonav/kernels/sketch.hpp"

namespace panonav {

namespace {

constexpr std::size_t group_bytes = 8;          // summed by one instruction
constexpr std::size_t min_views_to_learn = 64;  // smallest number of views
// Slack of a row without a view, which raises its bound above every limit.
constexpr std::int32_t no_slack = -static_cast<std::int32_t>(SketchIndex::no_view);

std::size_t group_count(std::size_t dimensions) {
  return (dimensions + group_bytes - 1) / group_bytes;
}

/// The sums of two neighbours of eight bytes each, in 16 bits.
std::uint64_t sum_pairs(std::uint64_t eight) {
  constexpr std::uint64_t even = 0x00FF00FF00FF00FFU;
  return (eight & even) + ((eight >> 8U) & even);
}

std::uint64_t load_eight(const std::uint8_t* bytes) {
  std::uint64_t eight = 0;
  std::memcpy(&eight, bytes, sizeof eight);
  return eight;
}

/// The sum of `count` bytes.
std::int32_t sum_bytes(const std::uint8_t* bytes, int count) {
  constexpr int width = 8;
  std::int32_t sum = 0;
  if (count < width) {
    for (int i = 0; i < count; ++i) sum += bytes[i];
    return sum;
  }
  // A product gathers the four pairs in the highest 16 bits.
  constexpr std::uint64_t each_pair = 0x0001000100010001U;
  const int rest = count % width;
  std::uint64_t pairs = 0;
  if (rest > 0) {
    // Eight bytes that end with the last one, without those that the words below contain.
    const std::uint64_t last = load_eight(bytes + count - width);
    const int others = 8 * (width - rest);
    pairs = sum_pairs(std::endian::native == std::endian::little ? last >> others : last << others);
  }
  for (int i = 0; i + width <= count; i += width) {
    pairs += sum_pairs(load_eight(bytes + i));
    sum += static_cast<std::int32_t>((pairs * each_pair) >> 48U);
    pairs = 0;
  }
  return sum;
}

kernels::SumScale to_sum_scale(const SketchScale& scale, std::size_t groups) {
  return {scale.offsets.data(), scale.highest.data(), scale.steps.data(),
          scale.inverse_steps.data(), groups};
}

void set_scale(SketchScale& scale, std::vector<std::int32_t> lowest,
               std::vector<std::int32_t> highest) {
  const std::size_t groups = lowest.size() / group_bytes;
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

/// Encodes a query with the scale of one segment. `values` must have room for all groups. If all
/// views are within the scale (`covers`), the part of the query outside of it is added to every
/// distance.
void encode_query(const SketchScale& scale, bool covers, std::span<const std::int32_t> sums,
                  std::span<const std::uint8_t> mask, std::size_t groups, std::uint8_t* values,
                  kernels::DistanceKernels::SketchQuery& encoded) {
  std::int32_t constant = 0;
  std::int32_t max_slack = 0;
  groups = std::min(groups, scale.steps.size());
  for (std::size_t group = 0; group < groups; ++group) {
    std::array<std::int32_t, group_bytes> offsets{};
    std::array<std::int32_t, group_bytes> inside{};
    std::array<std::int32_t, group_bytes> counts{};
    for (std::size_t i = 0; i < group_bytes; ++i) {
      const std::size_t d = group * group_bytes + i;
      counts[i] = mask[d] != 0 ? 1 : 0;
      // Dimensions that are not compared get code 0 without a rounding error.
      offsets[i] = counts[i] * scale.offsets[d];
      inside[i] = counts[i] * sums[d];
      if (covers) {
        const std::int32_t highest = counts[i] * scale.highest[d];
        const std::int32_t clamped = std::min(std::max(inside[i], offsets[i]), highest);
        constant += std::abs(inside[i] - clamped);
        inside[i] = clamped;
      }
    }
    const std::uint64_t step = scale.steps[group];
    const kernels::SumScale of_group{offsets.data(), offsets.data(), &step,
                                     &scale.inverse_steps[group], 1};
    constant -= kernels::encode_sums(inside, of_group, values + group * group_bytes, group_bytes,
                                     kernels::chosen_instructions())
                    .missed;
    for (const std::int32_t count : counts) {
      max_slack += count * static_cast<std::int32_t>(step / 2 + 1);
    }
  }
  encoded.steps = scale.steps.data();
  encoded.groups = groups;
  encoded.constant = constant;
  encoded.max_slack = covers ? max_slack : static_cast<std::int32_t>(SketchIndex::no_view);
}

}  // namespace

SketchLayout::SketchLayout(SignatureShape shape_) : shape(shape_) {
  // A sketch of blocks with fewer than about three rows would cost as much as it saves.
  if (shape.rows >= 3) coarse_blocks = shape.rows >= 6 ? 2 : 1;
  if (shape.rows >= 20) {
    fine_blocks = BlockSums::blocks_per_component;
    // Views differ more in their low components, as the spectra of images fall with frequency.
    low_components = (shape.components + 2) / 3;
  }
  const auto components = static_cast<std::size_t>(shape.components);
  coarse_groups = group_count(coarse_dimensions(shape.components));
  fine_groups = (group_count(components * fine_blocks) + 7) / 8 * 8;
}

void SketchLayout::sum_blocks(const std::uint8_t* magnitudes, BlockSums& sums) const {
  sums.fine.resize(fine_groups * group_bytes);
  sums.coarse.resize(coarse_groups * group_bytes);
  sum_blocks(magnitudes, BlockSumsOf{sums.fine, sums.coarse});
}

void SketchLayout::sum_blocks(const std::uint8_t* magnitudes, const BlockSumsOf& sums) const {
  const auto components = static_cast<std::size_t>(shape.components);
  const int blocks = fine_blocks > 0 ? fine_blocks : coarse_blocks;
  std::int32_t* const out = fine_blocks > 0 ? sums.fine.data() : sums.coarse.data();
  std::array<int, BlockSums::blocks_per_component + 1> borders{};
  for (int block = 0; block <= blocks; ++block) borders[block] = first_row(block, blocks);
  for (std::size_t k = 0; k < components; ++k) {
    const std::uint8_t* const rows = magnitudes + k * shape.rows;
    for (int block = 0; block < blocks; ++block) {
      out[k * blocks + block] =
          sum_bytes(rows + borders[block], borders[block + 1] - borders[block]);
    }
  }
  if (fine_blocks == 0) return;
  const std::int32_t* fine = sums.fine.data();
  std::size_t d = 0;
  for (int k = 0; k < shape.components; ++k) {
    const int joined = fine_blocks / coarse_blocks_of(k);
    for (int block = 0; block < coarse_blocks_of(k); ++block, fine += joined) {
      sums.coarse[d++] = std::accumulate(fine, fine + joined, std::int32_t{0});
    }
  }
}

SketchIndex::Segment SketchIndex::make_segment() const {
  // Starts with a scale that covers every possible sum, until there are enough views to learn a
  // narrower one.
  BlockSums highest;
  layout_.sum_blocks(std::vector<std::uint8_t>(layout_.shape.size(), 255).data(), highest);
  Segment segment;
  set_scale(segment.coarse.scale, std::vector<std::int32_t>(highest.coarse.size(), 0),
            highest.coarse);
  set_scale(segment.fine.scale, std::vector<std::int32_t>(highest.fine.size(), 0), highest.fine);
  return segment;
}

bool SketchIndex::encode(Segment& segment, std::size_t place, const BlockSumsOf& sums) const {
  const auto encode_level = [place](Level& level, std::uint8_t* codes, std::size_t group_stride,
                                    std::span<const std::int32_t> values) {
    const kernels::EncodedSums encoded =
        kernels::encode_sums(values, to_sum_scale(level.scale, level.scale.steps.size()), codes,
                             group_stride, kernels::chosen_instructions());
    level.slacks[place] = encoded.missed;
    level.covers = level.covers && encoded.is_within;
    return encoded.is_within;
  };
  const std::size_t octet = place / 8 * layout_.coarse_groups * 8 + place % 8;
  bool within = encode_level(segment.coarse, segment.coarse.codes.data() + octet * group_bytes,
                             8 * group_bytes, sums.coarse);
  if (layout_.fine_blocks > 0) {
    const std::size_t at = place * layout_.fine_groups * group_bytes;
    within &= encode_level(segment.fine, segment.fine.codes.data() + at, group_bytes, sums.fine);
  }
  return within;
}

void SketchIndex::learn_scales(Segment& segment, std::size_t first_row,
                               const ViewStore& store) const {
  std::vector<std::size_t> places;
  places.reserve(segment.used);
  for (std::size_t place = 0; place < segment.coarse.slacks.size(); ++place) {
    if (segment.coarse.slacks[place] != no_slack) places.push_back(place);
  }
  // The sums of the places one after the other.
  const std::size_t coarse_size = layout_.coarse_groups * group_bytes;
  const std::size_t fine_size = layout_.fine_groups * group_bytes;
  std::vector<std::int32_t> coarse(places.size() * coarse_size);
  std::vector<std::int32_t> fine(places.size() * fine_size);
  const auto sums_of = [&](std::size_t i) {
    return BlockSumsOf{std::span(fine).subspan(i * fine_size, fine_size),
                       std::span(coarse).subspan(i * coarse_size, coarse_size)};
  };
  for (std::size_t i = 0; i < places.size(); ++i)
    layout_.sum_blocks(store.magnitudes(static_cast<Row>(first_row + places[i])), sums_of(i));
  const auto set_learnt_scale = [](Level& level, std::span<const std::int32_t> sums,
                                   std::size_t size) {
    std::vector<std::int32_t> lowest(sums.begin(),
                                     sums.begin() + static_cast<std::ptrdiff_t>(size));
    std::vector<std::int32_t> highest = lowest;
    for (; !sums.empty(); sums = sums.subspan(size)) {
      for (std::size_t d = 0; d < size; ++d) {
        lowest[d] = std::min(lowest[d], sums[d]);
        highest[d] = std::max(highest[d], sums[d]);
      }
    }
    set_scale(level.scale, std::move(lowest), std::move(highest));
    level.covers = true;
  };
  set_learnt_scale(segment.coarse, coarse, coarse_size);
  if (fine_size > 0) set_learnt_scale(segment.fine, fine, fine_size);
  for (std::size_t i = 0; i < places.size(); ++i) encode(segment, places[i], sums_of(i));
  segment.learnt_from = segment.used;
  segment.outside = 0;
}

SketchIndex::Segment& SketchIndex::get_or_create_segment(Row row) {
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
  return segment;
}

void SketchIndex::insert(const ViewStore& store, Row row) {
  if (!layout_.has_sketches()) return;
  const std::size_t place = row % rows_per_segment;
  Segment& segment = get_or_create_segment(row);

  BlockSums sums;
  layout_.sum_blocks(store.magnitudes(row), sums);
  if (!encode(segment, place, {sums.fine, sums.coarse})) ++segment.outside;
  ++segment.used;
  // A scale learnt from fewer views can only be too narrow, so it is learnt again if enough views
  // are outside of it.
  const bool first = segment.learnt_from == 0 && segment.used >= min_views_to_learn;
  const bool drifted = segment.learnt_from > 0 && segment.outside >= 8 + segment.used / 8;
  if (first || drifted) learn_scales(segment, row - place, store);
}

void SketchIndex::insert(const ViewStore& store, std::span<const Row> rows) {
  if (!layout_.has_sketches()) return;
  while (!rows.empty()) {
    const std::size_t number = rows.front() / rows_per_segment;
    const auto end =
        std::ranges::find_if(rows, [number](Row row) { return row / rows_per_segment != number; });
    const auto here = rows.first(static_cast<std::size_t>(end - rows.begin()));
    rows = rows.subspan(here.size());
    if (here.size() < min_views_to_learn) {
      for (const Row row : here) insert(store, row);
      continue;
    }
    for (const Row row : here) {
      Segment& segment = get_or_create_segment(row);
      segment.coarse.slacks[row % rows_per_segment] = 0;  // present; encoded by `learn_scales`
      ++segment.used;
    }
    learn_scales(segments_[number], number * rows_per_segment, store);
  }
}

void SketchIndex::erase(Row row) {
  if (!layout_.has_sketches()) return;
  Segment& segment = segments_[row / rows_per_segment];
  const std::size_t place = row % rows_per_segment;
  segment.coarse.slacks[place] = no_slack;
  if (layout_.fine_blocks > 0) segment.fine.slacks[place] = no_slack;
  --segment.used;
}

SketchIndex::Query SketchIndex::make_query(const std::uint8_t* magnitudes, int components,
                                           std::span<const std::uint8_t> allowed_rows) const {
  Query query;
  layout_.sum_blocks(magnitudes, query.sums);
  const auto counts = [&](int block, int blocks) {
    if (allowed_rows.empty()) return true;
    const auto rows = allowed_rows.subspan(
        layout_.first_row(block, blocks),
        layout_.first_row(block + 1, blocks) - layout_.first_row(block, blocks));
    return std::ranges::count(rows, 0) == 0;
  };
  query.coarse_mask.assign(layout_.coarse_groups * group_bytes, 0);
  query.fine_mask.assign(layout_.fine_groups * group_bytes, 0);
  std::size_t coarse = 0;
  std::size_t fine = 0;
  for (int k = 0; k < components; ++k) {
    const int blocks = layout_.coarse_blocks_of(k);
    for (int i = 0; i < blocks; ++i) query.coarse_mask[coarse++] = counts(i, blocks) ? 255 : 0;
    for (int i = 0; i < layout_.fine_blocks; ++i) {
      query.fine_mask[fine++] = counts(i, layout_.fine_blocks) ? 255 : 0;
    }
  }
  query.coarse_groups = group_count(coarse);
  query.fine_groups = (group_count(fine) + 7) / 8 * 8;
  return query;
}

void SketchIndex::compute_coarse_bounds(const kernels::DistanceKernels& kernels, const Query& query,
                                        std::span<std::uint32_t> bounds,
                                        std::span<std::uint32_t> smallest) const {
  std::vector<std::uint8_t> values(layout_.coarse_groups * group_bytes, 0);
  kernels::DistanceKernels::SketchQuery encoded{};
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

void SketchIndex::FineBounds::operator()(Row first, std::span<const std::uint32_t> places,
                                         std::uint32_t* bounds) {
  const std::size_t number = first / rows_per_segment;
  const std::size_t place = first % rows_per_segment;
  const Level& level = index_.segments_[number].fine;
  if (number != segment_) {
    encode_query(level.scale, level.covers, query_.sums.fine, query_.fine_mask, query_.fine_groups,
                 values_.data(), encoded_);
    segment_ = number;
  }
  kernels_.sketch_bounds_at(level.codes.data() + place * index_.layout_.fine_groups * group_bytes,
                            level.slacks.data() + place, places.data(), places.size(), encoded_,
                            bounds);
}

std::size_t SketchIndex::FineBounds::bytes() const noexcept {
  return query_.fine_groups * group_bytes + sizeof(std::int32_t);
}

}  // namespace panonav
