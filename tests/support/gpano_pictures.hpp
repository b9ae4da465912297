#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::testing {

using GpanoProperties = std::vector<std::pair<std::string, std::string>>;

/// Returns an XMP text with properties of GPano, as attributes or as elements.
inline std::string make_xmp(const GpanoProperties& properties, bool as_elements,
                            const std::string& prefix = "GPano") {
  std::string attributes;
  std::string elements;
  for (const auto& [name, value] : properties) {
    attributes += "\n " + prefix + ":" + name + "=\"" + value + "\"";
    elements += "<" + prefix + ":" + name + ">" + value + "</" + prefix + ":" + name + ">\n";
  }
  return "<x:xmpmeta xmlns:x='adobe:ns:meta/'><rdf:RDF><rdf:Description rdf:about=''\n xmlns:" +
         prefix + "='http://ns.google.com/photos/1.0/panorama/'" + (as_elements ? "" : attributes) +
         ">" + (as_elements ? elements : "") + "</rdf:Description></rdf:RDF></x:xmpmeta>";
}

/// Inserts an XMP text into a JPEG, in a segment after its beginning.
inline std::vector<std::uint8_t> insert_xmp(std::vector<std::uint8_t> jpeg,
                                            const std::string& xmp) {
  const std::string content = "http://ns.adobe.com/xap/1.0/" + std::string(1, '\0') + xmp;
  const std::size_t size = content.size() + 2;
  std::vector<std::uint8_t> segment{0xFF, 0xE1, static_cast<std::uint8_t>(size >> 8U),
                                    static_cast<std::uint8_t>(size & 255U)};
  segment.insert(segment.end(), content.begin(), content.end());
  jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());
  return jpeg;
}

/// Returns the equirectangular picture of the whole sphere that a camera takes whose front looks to
/// the elevation `pitch_rad` and which is then rolled about its view, its right side downwards.
/// The world is smooth and differs in all directions; x points forward, y to the left, z upwards.
inline Image take_sphere(double pitch_rad, double roll_rad, int width = 512) {
  const auto world = [](double x, double y, double z) {
    return 0.5 + 0.2 * std::sin(3.0 * x + 1.0) * std::cos(2.0 * y) +
           0.2 * std::sin(4.0 * z + 2.0 * y - x);
  };
  Image picture(width, width / 2, 3);
  for (int v = 0; v < picture.height(); ++v) {
    const double elevation = std::numbers::pi * (0.5 - (v + 0.5) / picture.height());
    for (int u = 0; u < width; ++u) {
      const double azimuth = 2.0 * std::numbers::pi * (0.5 - (u + 0.5) / width);
      const double front = std::cos(elevation) * std::cos(azimuth);
      const double left = std::cos(elevation) * std::sin(azimuth);
      const double up = std::sin(elevation);
      // The axes of the camera in the world: its front is lifted, and its left side then rises.
      const double raised = up * std::cos(roll_rad) + left * std::sin(roll_rad);
      const double y = left * std::cos(roll_rad) - up * std::sin(roll_rad);
      const double x = front * std::cos(pitch_rad) - raised * std::sin(pitch_rad);
      const double z = front * std::sin(pitch_rad) + raised * std::cos(pitch_rad);
      const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * world(x, y, z)));
      for (int c = 0; c < 3; ++c) (&picture.at(u, v))[c] = grey;
    }
  }
  return picture;
}

}  // namespace panonav::testing
