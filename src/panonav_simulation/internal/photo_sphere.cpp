#include "panonav_simulation/internal/photo_sphere.hpp"

#include <array>
#include <cmath>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::simulation {

namespace {

std::string make_photo_sphere_data(ImageSize size, const Pose2& pose, const Tilt& tilt) {
  const std::string width = std::to_string(size.width);
  const std::string height = std::to_string(size.height);
  std::string text =
      "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF "
      "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" "
      "xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\"";
  const auto add = [&](const char* name, const std::string& value) {
    text += std::string(" GPano:") + name + "=\"" + value + "\"";
  };
  add("UsePanoramaViewer", "True");
  add("ProjectionType", "equirectangular");
  add("FullPanoWidthPixels", width);
  add("FullPanoHeightPixels", height);
  add("CroppedAreaImageWidthPixels", width);
  add("CroppedAreaImageHeightPixels", height);
  add("CroppedAreaLeftPixels", "0");
  add("CroppedAreaTopPixels", "0");
  const double heading_deg = degrees(pose.heading_rad);
  add("PoseHeadingDegrees", to_text(heading_deg > 90.0 ? 450.0 - heading_deg : 90.0 - heading_deg));
  if (tilt != Tilt{}) {
    add("PosePitchDegrees", to_text(-degrees(tilt.pitch_rad)));
    add("PoseRollDegrees", to_text(degrees(tilt.roll_rad)));
  }
  return "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>" + text +
         "/></rdf:RDF></x:xmpmeta><?xpacket end=\"w\"?>";
}

}  // namespace

std::vector<std::uint8_t> encode_photo_sphere(ImageView image, const Pose2& pose,
                                              const Tilt& tilt) {
  constexpr int quality = 95;  // chosen: blocks are not seen
  std::vector<std::uint8_t> jpeg = encode_jpeg(image, quality);
  std::string content("http://ns.adobe.com/xap/1.0/");
  content += '\0';
  content += make_photo_sphere_data(image.size(), pose, tilt);
  const std::size_t length = content.size() + 2;  // of the segment, without its marker
  const std::array<std::uint8_t, 4> head{0xFF, 0xE1, static_cast<std::uint8_t>(length >> 8U),
                                         static_cast<std::uint8_t>(length & 0xFFU)};
  // After the start of the image and the JFIF segment, which has to be the first one.
  std::size_t at = 2;
  if (jpeg.size() > 6 && jpeg[2] == 0xFF && jpeg[3] == 0xE0)
    at += 2 + (static_cast<std::size_t>(jpeg[4]) << 8U) + jpeg[5];
  std::vector<std::uint8_t> segment(head.begin(), head.end());
  segment.insert(segment.end(), content.begin(), content.end());
  jpeg.insert(jpeg.begin() + static_cast<std::ptrdiff_t>(at), segment.begin(), segment.end());
  return jpeg;
}

}  // namespace panonav::simulation
