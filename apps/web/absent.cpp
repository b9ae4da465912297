// Functions of libraries that a page does not have: the browser decodes pictures, and routes are
// followed by robots.

#include <istream>

#include "panonav/core/error.hpp"
#include "panonav/io/internal/image_codecs.hpp"
#include "panonav/io/internal/xmp_packet.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/internal/route_lines.hpp"

namespace panonav {

namespace {

[[noreturn]] void throw_undecoded(std::string_view name) {
  throw FileError(name, "is an image file; a page passes the pixels that the browser decoded");
}

}  // namespace

namespace detail {

using Bytes = std::span<const std::uint8_t>;

Image decode_png(Bytes, std::string_view name, const ImageLimits&) {
  throw_undecoded(name);
}
std::optional<GreyLevels> decode_png_of_16_bits(Bytes, std::string_view name, const ImageLimits&) {
  throw_undecoded(name);
}
ImageSize png_size(Bytes, std::string_view name, const ImageLimits&) {
  throw_undecoded(name);
}
Image decode_jpeg(Bytes, std::string_view name, const ImageLimits&, JpegColours) {
  throw_undecoded(name);
}
ImageSize check_jpeg(Bytes, std::string_view name, const ImageLimits&) {
  throw_undecoded(name);
}
ImageSize jpeg_size(Bytes, std::string_view name, const ImageLimits&) {
  throw_undecoded(name);
}
std::vector<std::uint8_t> encode_png(ImageView) {
  throw_undecoded("picture");
}
std::vector<std::uint8_t> encode_jpeg(ImageView, int) {
  throw_undecoded("picture");
}
std::optional<std::string> read_xmp_packet(std::istream&) {
  return std::nullopt;
}

}  // namespace detail

std::vector<std::uint8_t> pack_route_lines(const RoutePanorama&, std::size_t, std::size_t) {
  throw ContractError("route", std::string_view("in a page"), "a memory without routes");
}
SnapshotChain SnapshotChain::unpack(std::span<const std::uint8_t>) {
  throw ContractError("route", std::string_view("in a page"), "a memory without routes");
}
bool unpack_route_lines(std::span<const std::uint8_t>, std::size_t, RoutePanorama&) {
  return false;
}

}  // namespace panonav
