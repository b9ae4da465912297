#include "panonav/pipeline/view_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string_view>
#include <type_traits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/preprocessing.hpp"

namespace panonav {

namespace {

constexpr PanoramaShape default_shape{80, 512};  // [M04 section 2.1]

/// Crops resampled images to the memory's band; ready-made panoramas stay unchanged.
PictureSource crop_to_band(const MemoryHeader& header, PictureSource source) {
  if (source.kind != PictureKind::panorama) source.layout.kept_elevations = header.elevations;
  return source;
}

bool is_ready_made(const MemoryHeader& header, const PictureSource& source) {
  return source.kind == PictureKind::panorama && header.source.kind == PictureKind::panorama;
}

PanoramaShape choose_resampled_shape(const MemoryHeader& header, const PictureSource& source) {
  if (is_ready_made(header, source) && !header.picture_shape) return {};
  return {header.shape.rows, header.panorama_columns};
}

std::string format_band(const std::optional<ElevationBand>& band) {
  if (!band) return "unknown";
  return format_number(degrees(band->bottom_rad)) + " to " + format_number(degrees(band->top_rad)) +
         " degrees";
}

bool is_same_band(const std::optional<ElevationBand>& a, const std::optional<ElevationBand>& b) {
  if (!a || !b) return !a && !b;
  constexpr double tolerance_rad = 1e-6;
  return std::abs(a->bottom_rad - b->bottom_rad) < tolerance_rad &&
         std::abs(a->top_rad - b->top_rad) < tolerance_rad;
}

constexpr std::string_view as_remembered = ", as in the views of the memory";

/// Returns the number of columns (and rows) averaged to one pixel of the thumbnail.
int compute_thumbnail_step(int columns) {
  constexpr int max_columns = 256;
  return (columns + max_columns - 1) / max_columns;
}

std::string format_size(const PanoramaShape& shape) {
  return std::to_string(shape.columns) + " x " + std::to_string(shape.rows);
}

void require_same_size(const PanoramaShape& shape, const PanoramaShape& remembered) {
  if (shape == remembered) return;
  throw ContractError("size", format_size(shape),
                      format_size(remembered) + std::string(as_remembered) +
                          "; store images of another size in a memory of their own");
}

void require_panoramic(const Observation& observation) {
  if (!observation.narrow_source) return;
  throw ContractError("image", "a narrow one", "one that shows all azimuths");
}

}  // namespace

/// Pool of the encoding buffers, one for each thread that encodes at the moment.
class ViewEncoder::Workspaces {
 public:
  class Borrowed {
   public:
    explicit Borrowed(Workspaces& from) : from_(from), workspace_(from.borrow()) {}
    ~Borrowed() { from_.return_workspace(std::move(workspace_)); }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    SignatureExtractor::Workspace& operator*() { return *workspace_; }

   private:
    Workspaces& from_;
    std::unique_ptr<SignatureExtractor::Workspace> workspace_;
  };

 private:
  std::unique_ptr<SignatureExtractor::Workspace> borrow() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<SignatureExtractor::Workspace>();
    auto workspace = std::move(free_.back());
    free_.pop_back();
    return workspace;
  }
  void return_workspace(std::unique_ptr<SignatureExtractor::Workspace> workspace) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(workspace));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<SignatureExtractor::Workspace>> free_;
};

ViewEncoder::ViewEncoder(const MemoryHeader& header, const PictureSource& source)
    : header_(header),
      reader_(crop_to_band(header, source), choose_resampled_shape(header, source)),
      extractor_({header.shape.rows, header.panorama_columns}, header.shape.components,
                 header.preprocessing),
      workspaces_(std::make_unique<Workspaces>()) {
  if (is_ready_made(header, source)) picture_shape_ = header.picture_shape;
}
ViewEncoder::~ViewEncoder() = default;
ViewEncoder::ViewEncoder(ViewEncoder&&) noexcept = default;
ViewEncoder& ViewEncoder::operator=(ViewEncoder&&) noexcept = default;

Panorama ViewEncoder::panorama(ImageView picture, const Tilt& tilt) const {
  if (picture_shape_) require_same_size({picture.height, picture.width}, *picture_shape_);
  return check_panorama(reader_.convert(picture, tilt));
}

Panorama ViewEncoder::check_panorama(Panorama panorama) const {
  require_fit(panorama);
  return panorama;
}

void ViewEncoder::require_fit(const Panorama& panorama) const {
  require_same_size({panorama.rows(), panorama.columns()},
                    {header_.shape.rows, header_.panorama_columns});
  check_band(panorama.elevations());
}

void ViewEncoder::require_fit(const Observation& observation) const {
  rethrow_with_file_name(observation, [&] {
    if (const auto* const ready = std::get_if<Panorama>(&observation.picture)) {
      return require_fit(*ready);
    }
    const ImageSize size = std::get<Image>(observation.picture).size();
    const PictureSource& source = reader_.source();
    require_picture_size(source, size);
    if (is_ready_made(header_, source)) {
      require_same_size(
          {size.height, size.width},
          picture_shape_.value_or(PanoramaShape{header_.shape.rows, header_.panorama_columns}));
    }
    const Unwarper* const unwarper = reader_.unwarper();
    check_band(source.kind == PictureKind::panorama ? source.layout.elevations
               : unwarper != nullptr                ? unwarper->elevations()
                                                    : source.layout.kept_elevations);
  });
}

void ViewEncoder::check_band(const std::optional<ElevationBand>& band) const {
  if (is_same_band(band, header_.elevations)) return;
  throw ContractError(
      "elevation band", format_band(band),
      format_band(header_.elevations) + std::string(as_remembered) +
          (header_.elevations ? "; set the option elevation_deg to the band of these images, or "
                                "store them in a memory of their own"
                              : "; leave out the option elevation_deg, or store these images in a "
                                "memory of their own"));
}

Panorama ViewEncoder::panorama(const Observation& observation) const {
  return rethrow_with_file_name(observation, [&] {
    require_panoramic(observation);
    const Tilt tilt = observation.tilt.value_or(Tilt{});
    if (const auto* image = std::get_if<Image>(&observation.picture))
      return panorama(image->view(), tilt);
    return check_panorama(level_panorama(std::get<Panorama>(observation.picture), tilt));
  });
}

FourierSignature ViewEncoder::signature(const Observation& observation) const {
  if (observation.tilt.value_or(Tilt{}) != Tilt{}) return signature(panorama(observation));
  return rethrow_with_file_name(observation, [&] {
    require_panoramic(observation);
    return std::visit(
        [this](const auto& picture) {
          if constexpr (std::is_same_v<std::decay_t<decltype(picture)>, Image>) {
            return signature(picture.view());
          } else {
            return signature(picture);
          }
        },
        observation.picture);
  });
}

FourierSignature ViewEncoder::signature(ImageView picture) const {
  const Unwarper* const unwarper = reader_.unwarper();
  if (unwarper == nullptr) return signature(panorama(picture));
  check_band(unwarper->elevations());
  Workspaces::Borrowed workspace(*workspaces_);
  return extractor_.signature(*unwarper, picture, *workspace);
}

FourierSignature ViewEncoder::signature(const Panorama& panorama) const {
  require_fit(panorama);
  Workspaces::Borrowed workspace(*workspaces_);
  return extractor_.signature(panorama, *workspace);
}

PackedSignature ViewEncoder::packed(const Observation& observation) const {
  return pack(signature(observation), header_.full_scale);
}

PackedSignature ViewEncoder::packed(ImageView picture) const {
  return pack(signature(picture), header_.full_scale);
}

PackedSignature ViewEncoder::packed(const Panorama& panorama) const {
  return pack(signature(panorama), header_.full_scale);
}

std::optional<LocalFeatures> ViewEncoder::features(const Panorama& panorama) const {
  return extract_features(panorama, header_.preprocessing);
}

Panorama ViewEncoder::read(const DatasetEntry& entry) const {
  const Image picture = read_picture(entry);
  try {
    return panorama(picture.view(), entry.tilt.value_or(Tilt{}));
  } catch (const ContractError& error) {
    throw FileError(entry.path.string(), error.what());
  }
}

PanoramaShape choose_panorama_shape(const PictureSource& source, const SignatureOptions& options) {
  PanoramaShape shape{options.rows, options.columns};
  if (source.kind == PictureKind::panorama) return shape;
  if (shape.rows == 0) shape.rows = default_shape.rows;
  if (shape.columns == 0) shape.columns = default_shape.columns;
  return shape;
}

void visit_options(SignatureOptions& options, OptionVisitor& visitor) {
  using T = SignatureOptions;
  constexpr OptionTable table{
      option<&T::rows>("Rows of the panorama to which images are resampled; 0: as many rows as the "
                       "input panorama has; for other images: 80",
                       0, 4096),
      option<&T::columns>("Columns of the panorama to which images are resampled; 0: as many "
                          "columns as the input panorama has; for other images: 512",
                          0, 16384),
      option<&T::components>("Number of Fourier components of each image row, including the "
                             "constant component (k = 0)",
                             1, 1024),
  };
  table.visit(options, visitor);
}

float largest_nonconstant_magnitude(const FourierSignature& signature) {
  const auto structure = signature.magnitudes().subspan(static_cast<std::size_t>(signature.rows()));
  return structure.empty() ? signature.magnitudes().front()
                           : *std::max_element(structure.begin(), structure.end());
}

Image make_thumbnail(const Panorama& panorama) {
  Image picture = to_picture(panorama);
  const int step = compute_thumbnail_step(picture.width());
  if (step == 1) return picture;
  Image small(picture.width() / step, std::max(1, picture.height() / step));
  const int rows_averaged = std::min(step, picture.height());
  std::vector<int> sums(static_cast<std::size_t>(small.width()));
  for (int v = 0; v < small.height(); ++v) {
    std::ranges::fill(sums, 0);
    for (int y = 0; y < rows_averaged; ++y) {
      const std::uint8_t* from = picture.view().data + (v * step + y) * picture.width();
      for (int& sum : sums) {
        for (int x = 0; x < step; ++x) sum += *from++;
      }
    }
    for (int u = 0; u < small.width(); ++u) {
      small.at(u, v) =
          static_cast<std::uint8_t>(sums[static_cast<std::size_t>(u)] / (rows_averaged * step));
    }
  }
  return small;
}

std::vector<std::uint8_t> encode_thumbnail(const Panorama& panorama) {
  const Image thumbnail = make_thumbnail(panorama);
  const bool is_small = thumbnail.width() < panorama.columns();
  return is_small ? encode_jpeg(thumbnail.view()) : encode_png(thumbnail.view());
}

std::optional<Panorama> panorama_from_thumbnail(std::span<const std::uint8_t> thumbnail,
                                                const MemoryHeader& header) {
  const PanoramaShape shape{header.shape.rows, header.panorama_columns};
  const int step = compute_thumbnail_step(shape.columns);
  const int width = shape.columns / step;
  try {
    const Image picture = decode_image(thumbnail, "thumbnail", {.side_px = 4096});
    if (picture.width() != width || picture.height() != std::max(1, shape.rows / step)) return {};
    const double forward = picture_forward_column(shape.columns) * shape.columns / (step * width);
    return panorama_from_picture(
        picture.view(), {.forward_column = std::min(forward, 1.0), .elevations = header.elevations},
        shape);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<Panorama> panorama_from_thumbnail(const MemoryFile& file, ViewId view) {
  const auto thumbnail = file.thumbnail(view);
  return thumbnail ? panorama_from_thumbnail(*thumbnail, file.header()) : std::nullopt;
}

int thumbnail_columns(const MemoryHeader& header) noexcept {
  return header.panorama_columns / compute_thumbnail_step(header.panorama_columns);
}

void parallel_for(Executor& executor, std::size_t count,
                  const std::function<void(std::size_t)>& body) {
  executor.for_each_chunk(count, 1,
                          [&](std::size_t begin, std::size_t, std::size_t) { body(begin); });
}

}  // namespace panonav
