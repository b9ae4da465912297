#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

struct Camera;
struct PixelPoint;

/// Several pinhole cameras that take their pictures at the same time from nearly one point. Their
/// pictures stand side by side in one, from left to right in the order of `cameras`, with their
/// upper edges in one line (`join_pictures`). Where several see a direction, that whose optical
/// axis is nearest counts. Projection assumes distant points.
struct RigModel {
  static constexpr std::size_t min_cameras = 2;  ///< smallest number
  static constexpr std::size_t max_cameras = 8;  ///< largest number

  /// Part of the picture that one camera took.
  struct Tile {
    std::size_t camera = 0;  ///< index of `cameras`
    int left_px = 0;         ///< first column
    ImageSize size;          ///< size of this camera's pictures
  };

  std::vector<Camera> cameras;  ///< pinhole cameras
  friend bool operator==(const RigModel& a, const RigModel& b);
};

/// Makes the camera whose pictures are those of these cameras, side by side. Throws like
/// `validate`.
[[nodiscard]] Camera make_rig(std::vector<Camera> cameras);

/// Throws ContractError that names the camera, the field, its value and its range.
void validate(const RigModel& model);

/// Returns the size of the pictures: the sum of the widths, and the largest height.
[[nodiscard]] ImageSize find_picture_size(const RigModel& model);
/// Returns the parts of the picture, from left to right.
[[nodiscard]] std::vector<RigModel::Tile> list_tiles(const RigModel& model);
/// Returns the part that a column belongs to; columns beyond the picture belong to the nearest one.
[[nodiscard]] RigModel::Tile tile_at(const RigModel& model, double u_px);

/// Projects a direction of the robot frame, of any length but 0, into the joined picture; nullopt
/// if no camera sees it.
[[nodiscard]] std::optional<PixelPoint> project(const RigModel& model, const Direction3& direction);
/// Returns the unit direction that a point of the joined picture shows; nullopt if it shows none.
[[nodiscard]] std::optional<Direction3> unproject(const RigModel& model, PixelPoint pixel);

/// Joins the pictures of a rig's cameras, given in the order of `RigModel::cameras`; what is below
/// the lower ones is black. Colour if one of them is. Throws ContractError if their number or a
/// size differs from the rig's.
[[nodiscard]] Image join_pictures(const RigModel& model, std::span<const ImageView> pictures);

}  // namespace panonav
