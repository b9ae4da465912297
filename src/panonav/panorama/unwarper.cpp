#include "panonav/panorama/unwarper.hpp"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>
#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/kernels/remap.hpp"
#include "panonav/panorama/internal/unwarp_table.hpp"
#include "panonav/panorama/picture.hpp"

namespace panonav {

namespace {

ElevationBand validated_band(const Camera& camera, const UnwarperOptions& options) {
  validate(camera);
  validate(options);
  constexpr double zenith = std::numbers::pi / 2.0;
  // Refuses a rig that leaves out some azimuths, whatever the band is.
  if (std::holds_alternative<RigModel>(camera.model)) (void)visible_elevations(camera);
  const ElevationBand band = options.elevations ? *options.elevations : visible_elevations(camera);
  double bottom = -zenith;
  double top = zenith;
  if (const auto* picture = std::get_if<EquirectangularModel>(&camera.model)) {
    bottom = picture->elevation_bottom_rad;
    top = picture->elevation_top_rad;
  }
  require(band.bottom_rad >= bottom && band.bottom_rad < band.top_rad, "elevations bottom_rad",
          band.bottom_rad, to_text(bottom) + " .. below top_rad");
  require(band.top_rad <= top, "elevations top_rad", band.top_rad,
          "above bottom_rad .. " + to_text(top));
  return band;
}

Panorama unwrap_picture(const Camera& camera, ImageView image, const ElevationBand& kept, int rows,
                        int columns) {
  const auto& model = std::get<EquirectangularModel>(camera.model);
  return panorama_from_picture(
      image,
      {camera.direction, camera.forward_column,
       ElevationBand{model.elevation_bottom_rad, model.elevation_top_rad}, kept},
      {rows, columns});
}

}  // namespace

void visit_options(UnwarperOptions& options, OptionVisitor& visitor) {
  using T = UnwarperOptions;
  constexpr OptionTable table{
      option<&T::rows>("rows of the panorama", 1, 4096),
      option<&T::columns>("columns of the panorama", 4, 16384),
      no_option<&T::elevations>("a valid range (dataset.toml and verbs use degrees)"),
  };
  table.visit(options, visitor);
}

Unwarper::Unwarper(const Camera& camera, const UnwarperOptions& options)
    : camera_(camera),
      rows_(options.rows),
      columns_(options.columns),
      elevations_(validated_band(camera, options)) {
  if (!std::holds_alternative<EquirectangularModel>(camera_.model)) {
    table_ = std::make_shared<const UnwarpTable>(
        make_unwarp_table(camera_, rows_, columns_, elevations_));
  }
}

bool Unwarper::is_visible(int row, int column) const noexcept {
  return !table_ || table_->visible.empty() ||
         table_->visible[static_cast<std::size_t>(row) * columns_ + column] != 0;
}

std::vector<std::uint32_t> Unwarper::find_read_pixels() const {
  const ImageSize size = camera_.image_size;
  std::vector<std::uint8_t> is_read(static_cast<std::size_t>(size.width) * size.height,
                                    table_ ? 0 : 1);
  // Marks the pixels of the image that a pixel of a level is the mean of.
  const auto mark = [&](std::size_t level, int u, int v) {
    const int side = 1 << level;
    for (int y = v * side; y < std::min((v + 1) * side, size.height); ++y) {
      for (int x = u * side; x < std::min((u + 1) * side, size.width); ++x)
        is_read[static_cast<std::size_t>(y) * size.width + x] = 1;
    }
  };
  for (std::size_t i = 0; table_ && i < table_->positions.size(); ++i) {
    std::size_t level = 0;  // the pairs of finer levels follow those of coarser ones
    while (!table_->levels[level].has_pairs() ||
           table_->levels[level].pairs_offset > table_->positions[i]) {
      ++level;
    }
    const UnwarpTable::Level& part = table_->levels[level];
    const auto offset = static_cast<int>(table_->positions[i] - part.pairs_offset);
    const int width = part.pair_right - part.pair_left;
    const int u = part.pair_left + offset % width;
    const int v = part.pair_top + offset / width;
    // The weights of a tap are bytes: (u, v), (u, v + 1), (u + 1, v), (u + 1, v + 1).
    for (int corner = 0; corner < 4; ++corner) {
      if ((table_->weights[i] >> (8 * corner) & 0xFFU) != 0)
        mark(level, u + corner / 2, v + corner % 2);
    }
  }
  std::vector<std::uint32_t> pixels;
  for (std::size_t i = 0; i < is_read.size(); ++i) {
    if (is_read[i] != 0) pixels.push_back(static_cast<std::uint32_t>(i));
  }
  return pixels;
}

void Unwarper::require_camera_size(ImageView image) const {
  const auto text = [](ImageSize size) {
    return std::to_string(size.width) + " x " + std::to_string(size.height);
  };
  if (image.size() != camera_.image_size) {
    throw ContractError("image size", text(image.size()),
                        text(camera_.image_size) + " (as the camera's calibration)");
  }
}

void Unwarper::build_halved_pairs(ImageView image, Workspace& workspace) const {
  const kernels::Instructions instructions = kernels::chosen_instructions();
  workspace.halved.resize(table_->halved_size);
  workspace.pairs.resize(table_->pairs_size);
  // The available part of the previous level; its first pixel is (left, top).
  struct Part {
    const std::uint8_t* data;
    std::ptrdiff_t stride;
    int left, top;
    [[nodiscard]] const std::uint8_t* at(int u, int v) const {
      return data + (v - top) * stride + (u - left);
    }
  };
  Part part{image.data, image.stride, 0, 0};
  for (std::size_t i = 0; i < table_->levels.size(); ++i) {
    const UnwarpTable::Level& level = table_->levels[i];
    if (i > 0) {
      const int width = level.right - level.left;
      const int height = level.bottom - level.top;
      std::uint8_t* const halved = workspace.halved.data() + level.halved_offset;
      kernels::halve(
          {part.at(2 * level.left, 2 * level.top), 2 * width, 2 * height, 1, part.stride}, halved,
          instructions);
      part = {halved, width, level.left, level.top};
    }
    if (level.has_pairs()) {
      kernels::pair_rows(
          {part.at(level.pair_left, level.pair_top), level.pair_right - level.pair_left,
           level.pair_bottom - level.pair_top + 1, 1, part.stride},
          workspace.pairs.data() + level.pairs_offset, instructions);
    }
  }
}

void Unwarper::compute_row_values(std::span<const std::uint16_t> pairs, int row,
                                  std::span<float> values) const {
  const UnwarpTable::Row& entry = table_->rows[row];
  const std::size_t count = static_cast<std::size_t>(entry.taps_per_value) * columns_;
  // Two lenses have twice as many taps, but each pair of taps has the weight of one.
  const int full_taps = entry.taps_per_value / lens_count(camera_);
  const float scale = 1.0F / static_cast<float>(255 * kernels::tap_weight_sum * full_taps);
  kernels::remap(pairs, std::span(table_->positions).subspan(entry.first_entry, count),
                 std::span(table_->weights).subspan(entry.first_entry, count), entry.taps_per_value,
                 scale, values, kernels::chosen_instructions());
}

Panorama Unwarper::unwrap(ImageView image) const {
  Workspace workspace;
  return unwrap(image, workspace);
}

Panorama Unwarper::unwrap(ImageView image, Workspace& workspace) const {
  std::vector<float> values(static_cast<std::size_t>(rows_) * columns_);
  unwrap_blocks(image, workspace, [&](int first_row, std::span<const float> block) {
    std::ranges::copy(block, values.begin() + static_cast<std::ptrdiff_t>(first_row) * columns_);
  });
  return {rows_, columns_, elevations_, std::move(values)};
}

void Unwarper::unwrap_blocks(
    ImageView image, Workspace& workspace,
    const std::function<void(int, std::span<const float>)>& consume_rows) const {
  require_camera_size(image);
  if (std::holds_alternative<EquirectangularModel>(camera_.model)) {
    const Panorama panorama = unwrap_picture(camera_, image, elevations_, rows_, columns_);
    for (int y = 0; y < rows_; y += rows_per_block) {
      const int count = std::min(rows_per_block, rows_ - y);
      consume_rows(y, panorama.values().subspan(static_cast<std::size_t>(y) * columns_,
                                                static_cast<std::size_t>(count) * columns_));
    }
    return;
  }
  std::optional<Image> grey;
  if (image.channels != 1) {
    grey = to_grey(image);
    image = grey->view();
  }
  build_halved_pairs(image, workspace);
  std::vector<float>& block = workspace.block;
  block.resize(static_cast<std::size_t>(rows_per_block) * columns_);
  for (int y = 0; y < rows_; y += rows_per_block) {
    const int count = std::min(rows_per_block, rows_ - y);
    for (int i = 0; i < count; ++i) {
      compute_row_values(
          workspace.pairs, y + i,
          std::span(block).subspan(static_cast<std::size_t>(i) * columns_, columns_));
    }
    consume_rows(y,
                 std::span<const float>(block).first(static_cast<std::size_t>(count) * columns_));
  }
}

}  // namespace panonav
