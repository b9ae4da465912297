#include "runs/file_content.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/camera_calibration.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

/// First bytes of a format.
struct Magic {
  std::string_view bytes;
  std::size_t offset;
  FileContent kind;
  std::string_view description;
};

IdentifiedContent identify_riff(std::string_view head) {
  const std::string_view form = head.substr(std::min<std::size_t>(8, head.size()), 4);
  if (form == "WEBP") return {FileContent::picture, "WebP"};
  return {FileContent::other, "a RIFF file, such as a sound"};
}

IdentifiedContent identify_iso_media(std::string_view head) {
  const std::string brand(head.substr(std::min<std::size_t>(8, head.size()), 4));
  constexpr std::array<std::string_view, 6> images{"heic", "heix", "mif1", "avif", "heim", "msf1"};
  if (std::ranges::find(images, brand) != images.end()) {
    return {FileContent::picture, brand == "avif" ? "AVIF" : "HEIC or AVIF"};
  }
  return {FileContent::other, "a file of the MP4 family without images"};
}

constexpr std::array<Magic, 20> magics{{
    {"\x89PNG\r\n\x1a\n"sv, 0, FileContent::picture, "PNG"},
    {"\xff\xd8\xff"sv, 0, FileContent::picture, "JPEG"},
    {"\x1f\x8b"sv, 0, FileContent::other, "a gzip archive; unpack it first"},
    {"\x28\xb5\x2f\xfd"sv, 0, FileContent::other,
     "a Zstandard archive of something else than a recording; unpack it"},
    {"PK\x03\x04"sv, 0, FileContent::other, "a ZIP archive; unpack it first"},
    {"7z\xbc\xaf\x27\x1c"sv, 0, FileContent::other, "a 7z archive; unpack it first"},
    {"\xfd"
     "7zXZ"sv,
     0, FileContent::other, "an XZ archive; unpack it first"},
    {"BZh"sv, 0, FileContent::other, "a bzip2 archive; unpack it first"},
    {"ustar"sv, 257, FileContent::other, "a tar archive; unpack it first"},
    {"GIF8"sv, 0, FileContent::other, "a GIF image; convert it to PNG or JPEG"},
    {"II*\0"sv, 0, FileContent::other, "a TIFF or camera raw image; convert it to PNG or JPEG"},
    {"MM\0*"sv, 0, FileContent::other, "a TIFF or camera raw image; convert it to PNG or JPEG"},
    {"%PDF"sv, 0, FileContent::other, "a PDF document"},
    {"\x7f"
     "ELF"sv,
     0, FileContent::other, "a program or library"},
    {"\x93NUMPY"sv, 0, FileContent::other, "a NumPy array, such as signatures.npy of export"},
    {"\x89HDF"sv, 0, FileContent::other, "an HDF5 file"},
    {"# .PCD"sv, 0, FileContent::other, "a point cloud (PCD)"},
    {"#ROSBAG"sv, 0, FileContent::other, "a ROS 1 bag of another version than 2.0"},
    {"glTF"sv, 0, FileContent::mesh, "a mesh (glTF)"},
    {"ply\n"sv, 0, FileContent::mesh, "a mesh or point cloud (PLY)"},
}};

/// Identifies formats that a few first bytes alone would confuse with texts.
std::optional<IdentifiedContent> identify_simple_image(std::string_view head) {
  if (head.size() < 14) return std::nullopt;
  if (head.starts_with("BM") && head.substr(6, 4) == "\0\0\0\0"sv) {
    return IdentifiedContent{FileContent::other, "a BMP image; convert it to PNG or JPEG"};
  }
  const bool is_netpbm = head[0] == 'P' && head[1] >= '1' && head[1] <= '6' &&
                         (head[2] == '\n' || head[2] == ' ' || head[2] == '\r');
  if (!is_netpbm) return std::nullopt;
  return IdentifiedContent{FileContent::other,
                           "a PGM or PPM image, such as an occupancy map; verbs take no occupancy "
                           "maps, as map makes maps from images, and of images PNG and JPEG"};
}

bool is_mesh_name(const fs::path& file) {
  constexpr std::array<std::string_view, 7> endings{".dae", ".obj", ".stl", ".gltf",
                                                    ".glb", ".ply", ".3ds"};
  return std::ranges::find(endings, to_lower_case(file.extension().string())) != endings.end();
}

/// Returns the first line that is neither empty nor a comment.
std::string_view find_first_line(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (!line.empty() && line.front() != '#') return line;
  }
  return {};
}

/// True if the line is a row of numbers or names columns of a trajectory.
bool is_table_line(std::string_view line) {
  double value = 0.0;
  std::string separated(line);
  std::ranges::replace(separated, ',', ' ');
  const auto words = split_words(separated);
  const bool has_numbers =
      words.size() >= 4 &&
      std::ranges::all_of(words, [&](const std::string& word) { return read_number(word, value); });
  return has_numbers || (line.find("stamp_s") != line.npos && line.find(',') != line.npos);
}

IdentifiedContent identify_xml(std::string_view head) {
  if (head.find("<sdf") != head.npos) return {FileContent::world, "a Gazebo world or model (SDF)"};
  if (head.find("<COLLADA") != head.npos) return {FileContent::mesh, "a mesh (COLLADA)"};
  if (head.find("<graphml") != head.npos) {
    return {FileContent::other,
            "a graph (GraphML), which map and arrange write for other programs"};
  }
  if (head.find("<svg") != head.npos) return {FileContent::other, "an SVG drawing for a browser"};
  return {FileContent::other, "an XML file"};
}

std::optional<IdentifiedContent> identify_text(std::string_view head) {
  if (head.find('\0') != head.npos) return std::nullopt;
  // Other YAML is described as text.
  const auto calibration = identify_calibration(head);
  const bool names_camera = head.find("amera") != head.npos || head.find("istortion") != head.npos;
  if (calibration && (*calibration != CalibrationFormat::yaml || names_camera)) {
    return IdentifiedContent{FileContent::calibration, "the calibration of a camera"};
  }
  const std::string_view line = find_first_line(head);
  if (line.starts_with("<!DOCTYPE html") || line.starts_with("<html")) {
    if (head.find("<meta name=\"generator\" content=\"panonav ") != head.npos) {
      return IdentifiedContent{FileContent::page, "a page that panonav wrote"};
    }
    return IdentifiedContent{FileContent::other, "a web page"};
  }
  if (line.starts_with('<')) return identify_xml(head);
  if (line.starts_with('{')) {
    return IdentifiedContent{FileContent::other,
                             "JSON, such as answers of --json, which verbs print but do not take"};
  }
  if (is_table_line(line)) return IdentifiedContent{FileContent::table, "a table of numbers"};
  if (line.starts_with('[') || (line.find(" = ") != line.npos && line.find(';') == line.npos)) {
    return IdentifiedContent{FileContent::toml, "a TOML file"};
  }
  if (line.starts_with("file,")) {
    return IdentifiedContent{FileContent::other,
                             "the table of a data set; verbs take the folder that contains it"};
  }
  // The last character may be cut off.
  std::string_view whole = head;
  for (int i = 0; i < 4 && !whole.empty() && !is_utf8(whole); ++i) whole.remove_suffix(1);
  if (!is_utf8(whole)) return std::nullopt;
  return IdentifiedContent{
      FileContent::other,
      "a text that begins with '" + shorten_middle(to_readable_line(line), 40) + "'"};
}

}  // namespace

IdentifiedContent identify_content(const fs::path& file) {
  constexpr std::size_t head_bytes = 4096;
  std::string head(head_bytes, '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw FileError(file.string(), "cannot be opened");
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (stream.bad()) throw FileError(file.string(), "cannot be read");
  head.resize(static_cast<std::size_t>(stream.gcount()));
  if (head.empty()) {
    return {FileContent::other,
            "empty (0 bytes); it was probably not written or copied completely"};
  }
  if (head.starts_with("RIFF")) return identify_riff(head);
  if (head.size() > 8 && head.compare(4, 4, "ftyp") == 0) return identify_iso_media(head);
  if (const auto image = identify_simple_image(head)) return *image;
  for (const auto& [bytes, offset, kind, description] : magics) {
    if (head.size() >= offset && std::string_view(head).substr(offset).starts_with(bytes)) {
      return {kind, std::string(description)};
    }
  }
  const auto text = identify_text(head);
  if (is_mesh_name(file) && (!text || text->kind != FileContent::world)) {
    return {FileContent::mesh, "a mesh"};
  }
  return text.value_or(IdentifiedContent{FileContent::other, "binary data of an unknown format"});
}

}  // namespace panonav::command
