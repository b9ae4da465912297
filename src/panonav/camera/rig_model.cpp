#include "panonav/camera/rig_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>

#include "panonav/camera/camera.hpp"
#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Distance from the right edge of a camera's picture within which a point is moved to it, so that
/// it belongs to no other picture.
constexpr double edge_px = 1e-6;

std::string format_size(ImageSize size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

}  // namespace

bool operator==(const RigModel& a, const RigModel& b) {
  return a.cameras == b.cameras;
}

Camera make_rig(std::vector<Camera> cameras) {
  Camera rig;
  const RigModel& model = rig.model.emplace<RigModel>(RigModel{std::move(cameras)});
  validate(model);
  rig.image_size = find_picture_size(model);
  return rig;
}

void validate(const RigModel& model) {
  const std::size_t count = model.cameras.size();
  require(count >= RigModel::min_cameras && count <= RigModel::max_cameras, "cameras of a rig",
          static_cast<double>(count),
          std::to_string(RigModel::min_cameras) + " .. " + std::to_string(RigModel::max_cameras));
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = "camera " + std::to_string(i) + " of the rig: ";
    if (!std::holds_alternative<PinholeModel>(model.cameras[i].model)) {
      throw ContractError(name + "model", "another", "pinhole");
    }
    try {
      validate(model.cameras[i]);
    } catch (const ContractError& error) {
      throw ContractError(name + error.what());
    }
  }
}

ImageSize find_picture_size(const RigModel& model) {
  ImageSize size;
  for (const Camera& camera : model.cameras) {
    size.width += camera.image_size.width;
    size.height = std::max(size.height, camera.image_size.height);
  }
  return size;
}

std::vector<RigModel::Tile> list_tiles(const RigModel& model) {
  std::vector<RigModel::Tile> tiles;
  int left_px = 0;
  for (std::size_t i = 0; i < model.cameras.size(); ++i) {
    tiles.push_back({i, left_px, model.cameras[i].image_size});
    left_px += tiles.back().size.width;
  }
  return tiles;
}

RigModel::Tile tile_at(const RigModel& model, double u_px) {
  RigModel::Tile tile{0, 0, model.cameras.front().image_size};
  while (tile.camera + 1 < model.cameras.size() && u_px >= tile.left_px + tile.size.width) {
    tile.left_px += tile.size.width;
    tile.size = model.cameras[++tile.camera].image_size;
  }
  return tile;
}

std::optional<PixelPoint> project(const RigModel& model, const Direction3& direction) {
  std::optional<PixelPoint> best;
  double best_cosine = -1.0;
  int left_px = 0;
  for (const Camera& camera : model.cameras) {
    const auto& lens = std::get<PinholeModel>(camera.model);
    const Direction3 in_lens = find_rotation(lens).lens_from_robot(direction);
    const double cosine = in_lens.x / std::hypot(in_lens.x, in_lens.y, in_lens.z);
    if (cosine > best_cosine) {
      if (const auto pixel = project_from_lens(camera, lens, in_lens)) {
        const double right_px = camera.image_size.width - edge_px;
        best = PixelPoint{left_px + std::min(pixel->u_px, right_px), pixel->v_px};
        best_cosine = cosine;
      }
    }
    left_px += camera.image_size.width;
  }
  return best;
}

std::optional<Direction3> unproject(const RigModel& model, PixelPoint pixel) {
  const RigModel::Tile tile = tile_at(model, pixel.u_px);
  return unproject(model.cameras[tile.camera], {pixel.u_px - tile.left_px, pixel.v_px});
}

Image join_pictures(const RigModel& model, std::span<const ImageView> pictures) {
  const std::size_t count = model.cameras.size();
  require(pictures.size() == count, "pictures of a rig", static_cast<double>(pictures.size()),
          std::to_string(count) + ", one of each camera");
  int channels = 1;
  for (std::size_t i = 0; i < count; ++i) {
    if (pictures[i].size() != model.cameras[i].image_size) {
      throw ContractError("picture of camera " + std::to_string(i), format_size(pictures[i].size()),
                          format_size(model.cameras[i].image_size) + ", as its camera");
    }
    channels = std::max(channels, pictures[i].channels);
  }
  const ImageSize size = find_picture_size(model);
  Image joined(size.width, size.height, channels);
  for (const RigModel::Tile& tile : list_tiles(model)) {
    const ImageView& picture = pictures[tile.camera];
    for (int v = 0; v < picture.height; ++v) {
      std::uint8_t* to =
          &joined.pixels()[static_cast<std::size_t>(channels) *
                           (static_cast<std::size_t>(v) * size.width + tile.left_px)];
      for (int u = 0; u < picture.width; ++u) {
        for (int c = 0; c < channels; ++c) *to++ = picture.at(u, v, picture.channels == 1 ? 0 : c);
      }
    }
  }
  return joined;
}

}  // namespace panonav
