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

// Returns the grey levels of 0 .. 255, summed over squares of 3 x 3 pixels. Every column adds in
// the same order, so a rotated view gives bit-identical sums, here and below.
Grey smooth_grey_levels(const Panorama& panorama, int pad_rows, int pad_columns) {
  const int columns = panorama.columns();
  Grey level(1, columns, 0, 1);  // one row
  Grey along_rows(panorama.rows(), columns, 1, 0);
  for (int y = 0; y < panorama.rows(); ++y) {
    const float* const from = panorama.row(y).data();
    float* const to = level.row(0);
    for (int x = 0; x < columns; ++x) {
      const float value = from[x] < 0.0F ? 0.0F : 1.0F < from[x] ? 1.0F : from[x];
      to[x] = static_cast<float>(static_cast<int>(value * 255.0F + 0.5F));
    }
    level.fill_padding();
    float* const out = along_rows.row(y);
    for (int x = 0; x < columns; ++x) out[x] = to[x - 1] + to[x] + to[x + 1];
  }
  along_rows.fill_padding();
  Grey sums(panorama.rows(), columns, pad_rows, pad_columns);
  for (int y = 0; y < panorama.rows(); ++y) {
    const float* const above = along_rows.row(y - 1);
    const float* const here = along_rows.row(y);
    const float* const below = along_rows.row(y + 1);
    float* const out = sums.row(y);
    for (int x = 0; x < columns; ++x) out[x] = above[x] + here[x] + below[x];
  }
  sums.fill_padding();
  return sums;
}

// Sums of the products of the gradients along and down (xx, xy, yy) over 5 x 5 pixels, row by row.
// Only the rows that the next sum needs are kept, which are in the processor's cache.
class StructureTensor {
 public:
  explicit StructureTensor(const Grey& smooth) : smooth_(smooth) {}

  // Computes the sums around row y; rows must be visited in order. The outer rows are repeated.
  void compute_row(int y) {
    for (; next_ < std::min(y + reach + 1, smooth_.rows); ++next_) sum_along_row(next_);
    for (int i = 0; i < 3; ++i) {
      std::array<const float*, ring> rows{};
      for (int j = -reach; j <= reach; ++j) {
        const int row = std::clamp(y + j, 0, smooth_.rows - 1);
        rows[static_cast<std::size_t>(j + reach)] = along_rows_.row(i * ring + row % ring);
      }
      const auto [r0, r1, r2, r3, r4] = rows;
      float* const out = sums_.row(i);
      for (int x = 0; x < smooth_.columns; ++x) out[x] = r0[x] + r1[x] + r2[x] + r3[x] + r4[x];
    }
  }
  [[nodiscard]] const float* xx() const { return sums_.row(0); }
  [[nodiscard]] const float* xy() const { return sums_.row(1); }
  [[nodiscard]] const float* yy() const { return sums_.row(2); }

 private:
  static constexpr int reach = 2;
  static constexpr int ring = 2 * reach + 1;

  void sum_along_row(int y) {
    const float* const above = smooth_.row(y - 1);
    const float* const here = smooth_.row(y);
    const float* const below = smooth_.row(y + 1);
    float* const xx = products_.row(0);
    float* const xy = products_.row(1);
    float* const yy = products_.row(2);
    for (int x = 0; x < smooth_.columns; ++x) {
      const float along = here[x + 1] - here[x - 1];
      const float down = below[x] - above[x];
      xx[x] = along * along;
      xy[x] = along * down;
      yy[x] = down * down;
    }
    products_.fill_padding();
    for (int i = 0; i < 3; ++i) {
      const float* const in = products_.row(i);
      float* const out = along_rows_.row(i * ring + y % ring);
      for (int x = 0; x < smooth_.columns; ++x)
        out[x] = in[x - 2] + in[x - 1] + in[x] + in[x + 1] + in[x + 2];
    }
  }

  const Grey& smooth_;
  int next_ = 0;                                 // row, the first that was not summed along itself
  Grey products_{3, smooth_.columns, 0, reach};  // one row
  Grey along_rows_{3 * ring, smooth_.columns, 0, 0};
  Grey sums_{3, smooth_.columns, 0, 0};
};

// Computes the smaller eigenvalue of the structure tensor [Shi and Tomasi 1994], over 5 x 5 pixels.
Grey compute_corner_strengths(const Grey& smooth) {
  StructureTensor tensor(smooth);
  Grey strengths(smooth.rows, smooth.columns, 2, 2);
  for (int y = 0; y < smooth.rows; ++y) {
    tensor.compute_row(y);
    const float* const xx = tensor.xx();
    const float* const xy = tensor.xy();
    const float* const yy = tensor.yy();
    float* const strength = strengths.row(y);
    for (int x = 0; x < smooth.columns; ++x) {
      const float a = xx[x];
      const float b = xy[x];
      const float c = yy[x];
      strength[x] = 0.5F * (a + c - std::sqrt((a - c) * (a - c) + 4.0F * b * b));
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
  std::vector<std::uint8_t> candidates(static_cast<std::size_t>(strengths.columns));
  for (int y = first_row; y < end_row; ++y) {
    const float* const above = strengths.row(y - 1);
    const float* const row = strengths.row(y);
    const float* const below = strengths.row(y + 1);
    // Its four neighbours exclude most pixels, without a branch.
    for (int x = 0; x < strengths.columns; ++x) {
      candidates[static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(
          static_cast<int>(row[x] > min_strength) & static_cast<int>(row[x] > row[x - 1]) &
          static_cast<int>(row[x] >= row[x + 1]) & static_cast<int>(row[x] > above[x]) &
          static_cast<int>(row[x] >= below[x]));
    }
    for (int x = 0; x < strengths.columns; ++x) {
      if (candidates[static_cast<std::size_t>(x)] == 0) continue;
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
  const Grey smooth = smooth_grey_levels(panorama, std::max(1, radius_rows), radius_columns);
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
    for (std::size_t w = 0; w < feature.bits.size(); ++w) {
      std::uint64_t word = 0;
      for (std::size_t i = 0; i < 64; ++i) {
        const auto& [first, second] = offsets[64 * w + i];
        word |= std::uint64_t{here[first] < here[second]} << i;
      }
      feature.bits[w] = word;
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

}  // namespace panonav
