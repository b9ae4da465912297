#include "panonav/panorama/hidden_values.hpp"

#include <algorithm>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// Interpolates linearly between the visible columns `from` and `from + length`, across the seam of
// the cylinder.
void interpolate_gap(std::span<float> row, int from, int length) {
  const int columns = static_cast<int>(row.size());
  const float first = row[from];
  const float last = row[static_cast<std::size_t>((from + length) % columns)];
  for (int i = 1; i < length; ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(length);
    row[static_cast<std::size_t>((from + i) % columns)] = first + share * (last - first);
  }
}

void fill_hidden_in_row(std::span<float> row, std::span<const std::uint8_t> hidden,
                        float mean_value) {
  const int columns = static_cast<int>(row.size());
  const auto visible = std::ranges::find(hidden, std::uint8_t{0});
  if (visible == hidden.end()) {
    std::ranges::fill(row, mean_value);
    return;
  }
  const int first_visible = static_cast<int>(visible - hidden.begin());
  int from = first_visible;
  for (int i = 1; i <= columns; ++i) {
    if (hidden[static_cast<std::size_t>((first_visible + i) % columns)] != 0) continue;
    interpolate_gap(row, from, first_visible + i - from);
    from = first_visible + i;
  }
}

}  // namespace

std::vector<std::uint8_t> find_hidden_values(ImageView mask, const Unwarper& unwarper) {
  require(mask.channels == 1, "channels of the mask", mask.channels, "1");
  Image visible_mask(mask.width, mask.height);
  for (int v = 0; v < mask.height; ++v) {
    for (int u = 0; u < mask.width; ++u) {
      visible_mask.at(u, v) = mask.data[v * mask.stride + u] == 0 ? 0 : 255;
    }
  }
  const Panorama visible_share = unwarper.unwrap(visible_mask.view());
  std::vector<std::uint8_t> hidden;
  hidden.reserve(visible_share.values().size());
  // The unwarper scales the brighter of two lenses down to the darker one, so a white image does
  // not become 1 everywhere; compare with its values.
  std::ranges::fill(visible_mask.pixels(), std::uint8_t{255});
  const Panorama all = unwarper.unwrap(visible_mask.view());
  // A value is hidden if masked pixels have more than 0.1 % of its weight, less than half a grey
  // level.
  for (std::size_t i = 0; i < all.values().size(); ++i) {
    hidden.push_back(visible_share.values()[i] < 0.999F * all.values()[i] ? 1 : 0);
  }
  if (std::ranges::count(hidden, std::uint8_t{0}) == 0) {
    throw ContractError("mask", "hides everything", "something is seen");
  }
  return hidden;
}

void fill_hidden_values(Panorama& panorama, std::span<const std::uint8_t> hidden) {
  const auto values = panorama.values();
  require(hidden.size() == values.size(), "number of entries of hidden",
          static_cast<double>(hidden.size()), std::to_string(values.size()));
  double sum = 0.0;
  std::size_t visible_count = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (hidden[i] != 0) continue;
    sum += static_cast<double>(values[i]);
    ++visible_count;
  }
  require(visible_count > 0, "number of visible values", 0.0, "1 or more");
  const auto mean = static_cast<float>(sum / static_cast<double>(visible_count));
  const auto columns = static_cast<std::size_t>(panorama.columns());
  for (std::size_t at = 0; at < values.size(); at += columns) {
    fill_hidden_in_row(values.subspan(at, columns), hidden.subspan(at, columns), mean);
  }
}

}  // namespace panonav
