#include "panonav/signature/local_features.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <span>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/feature_match.hpp"

namespace panonav {

namespace {

// Radius of the patch around a corner from which points are compared: with 8 degrees 11 percentage
// points more places are recognised than with 14 (docs/decisions.md).
constexpr double patch_radius_rad = radians(8.0);
// Half-width of an azimuth window, and the largest number of corners kept in it. The limit spreads
// corners over all azimuths, instead of, say, on one poster.
constexpr double window_half_width_rad = radians(6.0);
constexpr int max_kept_in_window = 4;
// Rows at the upper and lower edge in which no corners are searched, because a part of their
// neighbourhood is missing.
constexpr int margin_rows = 3;
constexpr int descriptor_bits = 256;

// A panorama with padding: columns wrap round beyond both ends, the outer rows are repeated. Loops
// therefore need no index wrapping.
template <class Value>
struct Padded {
  Padded(int rows_, int columns_, int pad_rows_, int pad_columns_)
      : rows(rows_),
        columns(columns_),
        pad_rows(pad_rows_),
        pad_columns(pad_columns_),
        stride(columns_ + 2 * pad_columns_),
        values(static_cast<std::size_t>(rows_ + 2 * pad_rows_) * static_cast<std::size_t>(stride)) {
  }
  /// Row y from column 0 on.
  Value* row(int y) { return values.data() + offset(y); }
  const Value* row(int y) const { return values.data() + offset(y); }
  [[nodiscard]] std::ptrdiff_t offset(int y) const {
    return static_cast<std::ptrdiff_t>(y + pad_rows) * stride + pad_columns;
  }
  void fill_padding() {
    for (int y = 0; y < rows; ++y) {
      Value* const at = row(y);
      for (int x = 1; x <= pad_columns; ++x) {
        at[-x] = at[columns - 1 - (x - 1) % columns];
        at[columns + x - 1] = at[(x - 1) % columns];
      }
    }
    for (int y = 1; y <= pad_rows; ++y) {
      std::copy_n(row(0) - pad_columns, stride, row(-y) - pad_columns);
      std::copy_n(row(rows - 1) - pad_columns, stride, row(rows - 1 + y) - pad_columns);
    }
  }
  int rows, columns, pad_rows, pad_columns, stride;
  std::vector<Value> values;
};

using Grey = Padded<float>;

// Sums over squares with sides of 2 * radius + 1 pixels. Every column adds in the same order, so a
// rotated view gives bit-identical sums.
Grey compute_box_sums(const Grey& from, int radius, int pad_rows, int pad_columns) {
  Grey columns(from.rows, from.columns, radius, 0);
  for (int y = 0; y < from.rows; ++y) {
    const float* const in = from.row(y);
    float* const out = columns.row(y);
    for (int x = 0; x < from.columns; ++x) out[x] = in[x - radius];
    for (int i = 1 - radius; i <= radius; ++i) {
      for (int x = 0; x < from.columns; ++x) out[x] += in[x + i];
    }
  }
  columns.fill_padding();
  Grey sums(from.rows, from.columns, pad_rows, pad_columns);
  for (int y = 0; y < from.rows; ++y) {
    float* const out = sums.row(y);
    for (int j = -radius; j <= radius; ++j) {
      const float* const in = columns.row(y + j);
      for (int x = 0; x < from.columns; ++x) out[x] += in[x];
    }
  }
  sums.fill_padding();
  return sums;
}

// Computes the smaller eigenvalue of the structure tensor [Shi and Tomasi 1994], over 5 x 5 pixels.
Grey compute_corner_strengths(const Grey& smooth) {
  const int rows = smooth.rows;
  const int columns = smooth.columns;
  Grey xx(rows, columns, 0, 2);
  Grey xy(rows, columns, 0, 2);
  Grey yy(rows, columns, 0, 2);
  for (int y = 0; y < rows; ++y) {
    const float* const above = smooth.row(y - 1);
    const float* const here = smooth.row(y);
    const float* const below = smooth.row(y + 1);
    float* const xx_row = xx.row(y);
    float* const xy_row = xy.row(y);
    float* const yy_row = yy.row(y);
    for (int x = 0; x < columns; ++x) {
      const float along = here[x + 1] - here[x - 1];
      const float down = below[x] - above[x];
      xx_row[x] = along * along;
      xy_row[x] = along * down;
      yy_row[x] = down * down;
    }
  }
  for (Grey* products : {&xx, &xy, &yy}) {
    products->fill_padding();
    *products = compute_box_sums(*products, 2, 0, 0);
  }
  Grey strengths(rows, columns, 2, 2);
  for (int y = 0; y < rows; ++y) {
    const float* const xx_row = xx.row(y);
    const float* const xy_row = xy.row(y);
    const float* const yy_row = yy.row(y);
    float* const strength_row = strengths.row(y);
    for (int x = 0; x < columns; ++x) {
      const float a = xx_row[x];
      const float b = xy_row[x];
      const float c = yy_row[x];
      strength_row[x] = 0.5F * (a + c - std::sqrt((a - c) * (a - c) + 4.0F * b * b));
    }
  }
  strengths.fill_padding();
  return strengths;
}

struct Corner {
  int column, row;
  float strength;
};

// True if the pixel is the strongest of the 5 x 5 pixels around it; of equal ones the first.
bool is_corner(const Grey& strengths, int row, int column) {
  const float here = strengths.row(row)[column];
  for (int j = -2; j <= 2; ++j) {
    const float* const other = strengths.row(row + j) + column;
    for (int i = -2; i <= 2; ++i) {
      if (other[i] > here || (other[i] == here && (j < 0 || (j == 0 && i < 0)))) return false;
    }
  }
  return true;
}

std::vector<Corner> find_corners(const Grey& smooth, int first_row, int end_row) {
  // Strength of a gradient of one grey level per pixel in its weaker direction: the factor 9 is
  // from 3 x 3 smoothing, 2 from differences over two pixels, 25 from the sum over 5 x 5 pixels.
  constexpr float min_strength = 25.0F * (2.0F * 9.0F) * (2.0F * 9.0F);
  const Grey strengths = compute_corner_strengths(smooth);
  std::vector<Corner> all;
  for (int y = first_row; y < end_row; ++y) {
    const float* const row = strengths.row(y);
    for (int x = 0; x < strengths.columns; ++x) {
      // Its neighbours in the row exclude most pixels.
      if (!(row[x] > min_strength && row[x] > row[x - 1] && row[x] >= row[x + 1])) continue;
      if (is_corner(strengths, y, x)) all.push_back({x, y, row[x]});
    }
  }
  std::ranges::sort(all, {}, [](const Corner& c) { return std::pair(c.column, c.row); });
  const int columns = strengths.columns;
  const int window = static_cast<int>(window_half_width_rad / (2.0 * std::numbers::pi) * columns);
  std::vector<Corner> kept;
  for (std::size_t i = 0; i < all.size(); ++i) {
    int stronger = 0;
    const auto count = [&](std::size_t step) {
      for (std::size_t n = 1; n < all.size(); ++n) {
        const Corner& other = all[(i + n * step) % all.size()];
        const int apart = std::abs(other.column - all[i].column);
        if (std::min(apart, columns - apart) > window) return;
        if (other.strength > all[i].strength) ++stronger;
      }
    };
    count(1);                                         // to larger columns, and round
    if (2 * window < columns) count(all.size() - 1);  // to smaller ones
    if (stronger < max_kept_in_window) kept.push_back(all[i]);
  }
  if (kept.size() > LocalFeatures::max_count) {
    std::ranges::stable_sort(kept, std::greater<>(), &Corner::strength);
    kept.resize(LocalFeatures::max_count);
  }
  std::ranges::sort(kept, {}, [](const Corner& c) { return std::pair(c.row, c.column); });
  return kept;
}

// Draws the pairs of points around a corner that a descriptor compares: normally distributed about
// the corner, the same for every view [Calonder et al. 2010].
using PointPairs = std::array<std::array<int, 4>, descriptor_bits>;
PointPairs sample_point_pairs(int rows, int columns) {
  Random random(5);
  const auto draw_offset = [&](int radius) {
    double value = 0.0;
    do value = random.normal(0.0, 0.5 * radius);
    while (std::abs(value) > radius);
    return static_cast<int>(std::lround(value));
  };
  PointPairs pairs{};
  for (auto& pair : pairs) {
    do {
      for (std::size_t i = 0; i < pair.size(); ++i)
        pair[i] = draw_offset(i % 2 == 0 ? columns : rows);
    } while (pair[0] == pair[2] && pair[1] == pair[3]);
  }
  return pairs;
}

// Returns the pairs of these radii, which are drawn once: drawing takes a tenth of an extraction.
std::shared_ptr<const PointPairs> get_or_sample_point_pairs(int rows, int columns) {
  static std::mutex mutex;
  static std::map<std::pair<int, int>, std::shared_ptr<const PointPairs>> drawn;
  constexpr std::size_t max_drawn = 64;  // 4 kB each; a program uses one or two
  const std::lock_guard lock(mutex);
  if (drawn.size() >= max_drawn) drawn.clear();
  auto& pairs = drawn[{rows, columns}];
  if (!pairs) pairs = std::make_shared<const PointPairs>(sample_point_pairs(rows, columns));
  return pairs;
}

double row_height_rad(PanoramaShape shape, ElevationBand band) {
  return (band.top_rad - band.bottom_rad) / shape.rows;
}

// Bearings and descriptors of a view's features, as a structure of arrays.
struct Bearings {
  explicit Bearings(const LocalFeatures& view) {
    const double column_rad = 2.0 * std::numbers::pi / view.shape.columns;
    const double row_rad = row_height_rad(view.shape, view.elevations);
    descriptor_words.reserve(4 * view.features.size());
    for (const LocalFeatures::Feature& feature : view.features) {
      const double azimuth = column_rad * feature.column;
      azimuths.push_back(azimuth);
      sines.push_back(static_cast<float>(std::sin(azimuth)));
      cosines.push_back(static_cast<float>(std::cos(azimuth)));
      tangents.push_back(
          static_cast<float>(std::tan(view.elevations.top_rad - (feature.row + 0.5) * row_rad)));
      descriptor_words.insert(descriptor_words.end(), feature.bits.begin(), feature.bits.end());
    }
  }
  std::vector<double> azimuths;
  std::vector<float> sines, cosines, tangents;
  std::vector<std::uint64_t> descriptor_words;
};

// Features that are each other's nearest, sorted by azimuth in the query minus azimuth in the
// reference: the pairs that a rotation brings within a right angle of each other are contiguous.
// The list is stored twice, so that ranges across the wrap are contiguous, too.
class MutualMatches {
 public:
  struct Window {
    int turn, begin, count;
  };

  MutualMatches(const Bearings& query, const Bearings& reference,
                std::span<const std::uint16_t> nearest_of_query,
                std::span<const std::uint16_t> nearest_of_reference) {
    struct Pair {
      double azimuth_rad;
      std::size_t query, reference;
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < nearest_of_query.size() && !nearest_of_reference.empty(); ++i) {
      const std::size_t j = nearest_of_query[i];
      if (nearest_of_reference[j] == i)
        pairs.push_back({query.azimuths[i] - reference.azimuths[j], i, j});
    }
    for (Pair& pair : pairs) {
      if (pair.azimuth_rad < 0.0) pair.azimuth_rad += 2.0 * std::numbers::pi;
    }
    std::ranges::sort(pairs, {}, [](const Pair& p) { return std::pair(p.azimuth_rad, p.query); });
    for (const double period_offset_rad : {0.0, 2.0 * std::numbers::pi}) {
      for (const auto& [azimuth_rad, i, j] : pairs) {
        azimuths_.push_back(azimuth_rad + period_offset_rad);
        const float numbers[numbers_per_match] = {
            query.sines[i],
            query.cosines[i],
            query.tangents[i],
            reference.sines[j],
            reference.cosines[j],
            reference.tangents[j],
            query.sines[i] * reference.cosines[j] - query.cosines[i] * reference.sines[j],
            query.cosines[i] * reference.cosines[j] + query.sines[i] * reference.sines[j]};
        for (std::size_t n = 0; n < numbers_per_match; ++n) values_[n].push_back(numbers[n]);
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return azimuths_.size() / 2; }

  /// Returns the range of matches whose features a rotation by `turn` steps brings within a right
  /// angle of each other; 0 <= turn * step_rad < 2 pi.
  [[nodiscard]] Window select_within_right_angle(int turn, double step_rad) const {
    constexpr double right_angle = 0.5 * std::numbers::pi;
    double from = -turn * step_rad - right_angle;
    while (from < 0.0) from += 2.0 * std::numbers::pi;
    const auto begin = std::ranges::upper_bound(azimuths_, from);
    const auto end = std::lower_bound(begin, azimuths_.end(), from + 2.0 * right_angle);
    return {turn, static_cast<int>(begin - azimuths_.begin()), static_cast<int>(end - begin)};
  }

  [[nodiscard]] kernels::MatchedBearings bearings(int begin, int count) const {
    const auto at = [&](std::size_t n) { return values_[n].data() + begin; };
    return {
        at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), static_cast<std::size_t>(count)};
  }

 private:
  static constexpr std::size_t numbers_per_match = 8;
  std::vector<double> azimuths_;
  std::array<std::vector<float>, numbers_per_match> values_;  // as MatchedBearings has them
};

constexpr int rotation_steps = 128;
constexpr double tolerance_rad = radians(2.0);
// Largest accepted ratio of the distance between the views to the distance of a feature from either
// view.
constexpr float max_ratio = 2.0F;

struct AngleTable {
  std::array<float, rotation_steps> sines, cosines;
};
// Tabulates cosines and sines of the multiples of `step`.
AngleTable make_angle_table(double step) {
  AngleTable table{};
  for (std::size_t i = 0; i < table.sines.size(); ++i) {
    table.sines[i] = static_cast<float>(std::sin(step * static_cast<double>(i)));
    table.cosines[i] = static_cast<float>(std::cos(step * static_cast<double>(i)));
  }
  return table;
}

}  // namespace

std::optional<LocalFeatures> extract_features(const Panorama& panorama,
                                              const PreprocessingOptions& preprocessing) {
  if (!panorama.elevations()) return std::nullopt;
  const PanoramaShape shape{panorama.rows(), panorama.columns()};
  require_unmasked_rows(preprocessing, shape.rows);
  LocalFeatures view{shape, *panorama.elevations(), {}};
  const int radius_columns = std::max(
      3,
      static_cast<int>(std::lround(patch_radius_rad / (2.0 * std::numbers::pi) * shape.columns)));
  const int radius_rows = std::clamp(
      static_cast<int>(std::lround(patch_radius_rad / row_height_rad(shape, view.elevations))), 3,
      std::max(3, shape.rows));
  Grey grey(shape.rows, shape.columns, 1, 1);
  for (int y = 0; y < shape.rows; ++y) {
    const std::span<const float> from = panorama.row(y);
    float* const to = grey.row(y);
    for (int x = 0; x < shape.columns; ++x) {
      to[x] = static_cast<float>(static_cast<int>(std::clamp(from[x], 0.0F, 1.0F) * 255.0F + 0.5F));
    }
  }
  grey.fill_padding();
  const Grey smooth = compute_box_sums(grey, 1, std::max(1, radius_rows), radius_columns);
  const std::vector<Corner> corners =
      find_corners(smooth, std::max(margin_rows, preprocessing.masked_rows_top),
                   shape.rows - std::max(margin_rows, preprocessing.masked_rows_bottom));
  const auto pairs = get_or_sample_point_pairs(radius_rows, radius_columns);
  std::array<std::pair<std::ptrdiff_t, std::ptrdiff_t>, descriptor_bits> offsets;
  for (std::size_t i = 0; i < pairs->size(); ++i) {
    const auto& [x0, y0, x1, y1] = (*pairs)[i];
    offsets[i] = {std::ptrdiff_t{y0} * smooth.stride + x0, std::ptrdiff_t{y1} * smooth.stride + x1};
  }
  for (const Corner& corner : corners) {
    LocalFeatures::Feature& feature = view.features.emplace_back(LocalFeatures::Feature{
        static_cast<std::uint16_t>(corner.column), static_cast<std::uint16_t>(corner.row), {}});
    const float* const here = smooth.row(corner.row) + corner.column;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const bool brighter = here[offsets[i].first] < here[offsets[i].second];
      feature.bits[i / 64] |= std::uint64_t{brighter} << (i % 64);
    }
  }
  return view;
}

std::vector<std::uint8_t> pack(const LocalFeatures& view) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(view.features.size() * LocalFeatures::packed_bytes);
  const auto put = [&](std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  for (const LocalFeatures::Feature& feature : view.features) {
    put(feature.column, 2);
    put(feature.row, 2);
    for (const std::uint64_t word : feature.bits) put(word, 8);
  }
  return bytes;
}

LocalFeatures unpack_features(std::span<const std::uint8_t> bytes, PanoramaShape shape,
                              ElevationBand elevations) {
  constexpr std::size_t size = LocalFeatures::packed_bytes;
  require(bytes.size() % size == 0 && bytes.size() <= size * LocalFeatures::max_count,
          "bytes of local features", static_cast<double>(bytes.size()),
          "36 for each, up to 256 of them");
  LocalFeatures view{shape, elevations, {}};
  const auto get = [&](std::size_t at, std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value |= std::uint64_t{bytes[at + i]} << (8 * i);
    return value;
  };
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    LocalFeatures::Feature feature{
        static_cast<std::uint16_t>(get(at, 2)), static_cast<std::uint16_t>(get(at + 2, 2)), {}};
    require(feature.column < shape.columns, "column of a local feature", feature.column,
            "one of the panorama's");
    require(feature.row < shape.rows, "row of a local feature", feature.row,
            "one of the panorama's");
    for (std::size_t w = 0; w < feature.bits.size(); ++w) feature.bits[w] = get(at + 4 + 8 * w, 8);
    view.features.push_back(feature);
  }
  return view;
}

LocalFeatures::Match match_features(const LocalFeatures& query, const LocalFeatures& reference,
                                    int more_than) {
  if (query.shape != reference.shape || query.elevations != reference.elevations) {
    throw ContractError("local features", "of another panorama", "of one shape and band");
  }
  const Bearings query_bearings(query);
  const Bearings reference_bearings(reference);
  const std::size_t count = query.features.size();
  std::vector<std::uint16_t> nearest_of_query(count);
  std::vector<std::uint16_t> nearest_of_reference(reference.features.size());
  const kernels::Instructions instructions = kernels::chosen_instructions();
  kernels::nearest_descriptors(query_bearings.descriptor_words, reference_bearings.descriptor_words,
                               nearest_of_query, nearest_of_reference, instructions);
  const MutualMatches matched(query_bearings, reference_bearings, nearest_of_query,
                              nearest_of_reference);
  if (static_cast<std::int64_t>(matched.size()) <= more_than) return {};

  static const AngleTable full_angles = make_angle_table(2.0 * std::numbers::pi / rotation_steps);
  static const AngleTable half_angles = make_angle_table(std::numbers::pi / rotation_steps);
  static const kernels::MotionHypotheses hypotheses = [] {
    kernels::MotionHypotheses made{};
    for (int d = 0; d < kernels::motion_axes; ++d) {
      made.cosine[d] = static_cast<float>(std::cos(std::numbers::pi * d / kernels::motion_axes));
      made.sine[d] = static_cast<float>(std::sin(std::numbers::pi * d / kernels::motion_axes));
    }
    made.tolerance_sine = static_cast<float>(std::sin(tolerance_rad));
    made.tolerance_cosine = static_cast<float>(std::cos(tolerance_rad));
    made.max_ratio = max_ratio;
    return made;
  }();
  // A rotation can explain at most the features that it brings within a right angle of each other.
  std::array<MutualMatches::Window, rotation_steps> windows;
  for (std::size_t t = 0; t < rotation_steps; ++t) {
    windows[t] = matched.select_within_right_angle(static_cast<int>(t),
                                                   2.0 * std::numbers::pi / rotation_steps);
  }
  std::ranges::sort(windows, [](const auto& a, const auto& b) {  // the best come first
    return std::pair(-a.count, a.turn) < std::pair(-b.count, b.turn);
  });

  LocalFeatures::Match match;
  std::array<std::int32_t, 2 * std::size_t{kernels::motion_axes}> explained{};
  for (const auto& [turn, begin, bound] : windows) {
    if (bound <= std::max(match.verified, more_than)) break;
    const auto t = static_cast<std::size_t>(turn);
    kernels::count_explained(matched.bearings(begin, bound),
                             {full_angles.sines[t], full_angles.cosines[t], half_angles.sines[t],
                              half_angles.cosines[t]},
                             hypotheses, explained, instructions);
    const std::int32_t max_explained = *std::ranges::max_element(explained);
    if (max_explained > std::max(match.verified, more_than)) {
      match.verified = max_explained;
      match.heading_rad = wrap_angle(2.0 * std::numbers::pi * turn / rotation_steps);
    }
  }
  return match;
}

}  // namespace panonav
