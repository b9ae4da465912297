#include "memory_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "session.hpp"

namespace panonav::command {

namespace {

constexpr PanoramaShape default_shape{80, 512};  // [M04 section 2.1]

/// Pictures that are resampled anyway are cut to the memory's band; ready-made panoramas stay as
/// they are.
PictureSource cut_to(const MemoryHeader& header, PictureSource source) {
  if (source.kind != PictureKind::panorama) source.layout.kept_elevations = header.elevations;
  return source;
}

bool both_ready_made(const MemoryHeader& header, const PictureSource& source) {
  return source.kind == PictureKind::panorama && header.source.kind == PictureKind::panorama;
}

PanoramaShape shape_for(const MemoryHeader& header, const PictureSource& source) {
  if (both_ready_made(header, source) && !header.picture_shape) return {};
  return {header.shape.rows, header.panorama_columns};
}

std::string band_text(const std::optional<ElevationBand>& band) {
  if (!band) return "unknown";
  return short_number(degrees(band->bottom_rad)) + " to " + short_number(degrees(band->top_rad)) +
         " degrees";
}

bool same_band(const std::optional<ElevationBand>& a, const std::optional<ElevationBand>& b) {
  if (!a || !b) return !a && !b;
  constexpr double tolerance_rad = 1e-6;
  return std::abs(a->bottom_rad - b->bottom_rad) < tolerance_rad &&
         std::abs(a->top_rad - b->top_rad) < tolerance_rad;
}

}  // namespace

MemoryPipeline::MemoryPipeline(const MemoryHeader& header, const PictureSource& source)
    : header_(header), reader_(cut_to(header, source), shape_for(header, source)) {
  if (both_ready_made(header, source)) picture_shape_ = header.picture_shape;
}

Panorama MemoryPipeline::read(const DatasetEntry& entry) const {
  const auto refuse = [&](const std::string& field, const std::string& value,
                          const std::string& wanted) {
    throw FileError(entry.path.string(), field + " is " + value + "; allowed: " + wanted +
                                             ", as in the views of the memory");
  };
  if (picture_shape_) {
    const auto [width, height] = read_image_size(entry.path);
    if (height != picture_shape_->rows) {
      refuse("rows", std::to_string(height), std::to_string(picture_shape_->rows));
    }
    if (width != picture_shape_->columns) {
      refuse("columns", std::to_string(width), std::to_string(picture_shape_->columns));
    }
  }
  Panorama panorama = reader_.read(entry.path);
  if (panorama.rows() != header_.shape.rows) {
    refuse("rows", std::to_string(panorama.rows()), std::to_string(header_.shape.rows));
  }
  if (panorama.columns() != header_.panorama_columns) {
    refuse("columns", std::to_string(panorama.columns()), std::to_string(header_.panorama_columns));
  }
  if (!same_band(panorama.elevations(), header_.elevations)) {
    refuse("elevation band", band_text(panorama.elevations()), band_text(header_.elevations));
  }
  return panorama;
}

FourierSignature MemoryPipeline::signature(const Panorama& panorama) const {
  return compute_signature(preprocess(panorama, header_.preprocessing), header_.shape.components);
}

PackedSignature MemoryPipeline::packed(const Panorama& panorama) const {
  return pack(signature(panorama), header_.full_scale);
}

PanoramaShape wanted_shape(const Dataset& recording, const SignatureOptions& options) {
  PanoramaShape shape{options.rows, options.columns};
  if (recording.source.kind == PictureKind::panorama) return shape;
  if (shape.rows == 0) shape.rows = default_shape.rows;
  if (shape.columns == 0) shape.columns = default_shape.columns;
  return shape;
}

float largest_structure(const FourierSignature& signature) {
  const auto structure = signature.magnitudes().subspan(static_cast<std::size_t>(signature.rows()));
  return structure.empty() ? signature.magnitudes().front()
                           : *std::max_element(structure.begin(), structure.end());
}

std::vector<std::uint8_t> thumbnail_png(const Panorama& panorama) {
  constexpr int largest_columns = 256;
  const Image picture = to_picture(panorama);
  const int step = (picture.width() + largest_columns - 1) / largest_columns;
  if (step == 1) return encode_png(picture.view());
  Image small(picture.width() / step, std::max(1, picture.height() / step));
  const int rows_averaged = std::min(step, picture.height());
  for (int v = 0; v < small.height(); ++v) {
    for (int u = 0; u < small.width(); ++u) {
      int sum = 0;
      for (int y = 0; y < rows_averaged; ++y) {
        for (int x = 0; x < step; ++x) sum += picture.at(u * step + x, v * step + y);
      }
      small.at(u, v) = static_cast<std::uint8_t>(sum / (rows_averaged * step));
    }
  }
  return encode_png(small.view());
}

void for_each_entry(Executor& executor, std::size_t count,
                    const std::function<void(std::size_t)>& body) {
  executor.for_chunks(count, 1, [&](std::size_t begin, std::size_t, std::size_t) { body(begin); });
}

}  // namespace panonav::command
