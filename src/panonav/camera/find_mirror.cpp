#include "panonav/camera/find_mirror.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>

#include "panonav/camera/internal/circle_search.hpp"
#include "panonav/camera/internal/edge_field.hpp"
#include "panonav/core/error.hpp"

namespace panonav {
namespace {

// All shares and counts below, and the default of `min_quality`, were chosen on the recordings
// listed in the README (docs/decisions.md).

/// Longest side, in px, of the middle field, on which candidate circles are improved by hill
/// climbing before they are fitted in the image.
constexpr int middle_field_side_px = 400;
/// Longest side, in px, of the coarse field, on which all centres and radii are tried; the cost
/// grows with its cube.
constexpr int coarse_field_side_px = 200;
/// Largest number of circles of the coarse field that are improved on the middle field, best first.
constexpr int max_climbed_circles = 48;
/// Largest number of circles of the middle field that are fitted in the image, best first.
constexpr int max_fitted_circles = 8;
/// Circles are duplicates if their centres and radii differ by less than this in total, in
/// pixels of the middle field.
constexpr double same_circle_px = 3.0;

/// Largest width of a plain ring around the mirror, as a share of its outer radius: a wider plain
/// band is sky or ceiling in the mirrored scene.
constexpr double max_ring_width = 0.2;
/// Largest structure of a plain ring, as a share of the structure of the scene that it encloses.
constexpr double max_ring_structure = 0.35;
/// Largest distance between the centres of circles of the same mirror, as a share of the radius.
constexpr double max_centre_distance = 0.04;
/// Smallest quality, relative to the clearest circle, with which another circle can replace it as
/// rim or as disc.
constexpr double min_relative_quality = 0.6;

/// Smallest and largest radius of the disc in the middle, as shares of the rim's.
constexpr double min_disc_radius = 0.04, max_disc_radius = 0.65;
/// Largest distance between the centres of disc and rim, as a share of the rim's radius: the lens
/// may be slightly off the mirror's axis.
constexpr double max_disc_offset = 0.02;
/// Smallest quality of the disc's circle. A plain disc needs less, because the scene around it is
/// often equally dark, which leaves gaps in its edge.
constexpr double min_disc_quality = 0.5, min_plain_disc_quality = 0.3;

/// Edge fields of one image, or averaged over several, at both resolutions of the search.
struct SearchFields {
  EdgeField middle;
  EdgeField coarse;
  int middle_reduction = 1;
  int coarse_reduction = 1;
};

int compute_reduction(int side_px, int target_px) {
  return std::max(1, (side_px + target_px - 1) / target_px);
}

EdgeField make_middle_field(const ImageView& image) {
  const int longest = std::max(image.width, image.height);
  return make_edge_field(
      make_smooth_planes(image, compute_reduction(longest, middle_field_side_px), 1.0));
}

SearchFields make_search_fields(EdgeField middle, const ImageSize& size) {
  SearchFields result;
  result.middle_reduction =
      compute_reduction(std::max(size.width, size.height), middle_field_side_px);
  result.coarse_reduction =
      compute_reduction(std::max(middle.width, middle.height), coarse_field_side_px);
  result.coarse = reduce(middle, result.coarse_reduction);
  result.middle = std::move(middle);
  return result;
}

double distance_px(const PixelPoint& a, const PixelPoint& b) {
  return std::hypot(a.u_px - b.u_px, a.v_px - b.v_px);
}

FieldCircle scale(const FieldCircle& circle, double factor) {
  return {circle.u * factor, circle.v * factor, circle.radius * factor};
}

CircleRange scale(const CircleRange& range, double factor) {
  return {range.min_radius * factor, range.max_radius * factor, range.visible_fraction,
          range.averaging};
}

/// Fits a circle of the middle field to the edges in the image's pixels.
std::optional<MirrorCircle::Circle> refine_circle(const SearchFields& search_fields,
                                                  std::span<const SmoothPlanes> planes,
                                                  const FieldCircle& on_middle) {
  const auto fit = fit_circle(planes, scale(on_middle, search_fields.middle_reduction));
  if (!fit) return std::nullopt;
  return MirrorCircle::Circle{
      {fit->circle.u, fit->circle.v}, fit->circle.radius, fit->support, fit->residual};
}

/// Measures the structure between two radii: the share of samples, along concentric circles, at
/// which the grey level changes by at least `slope_scale`.
double measure_structure(std::span<const SmoothPlanes> images, const PixelPoint& centre,
                         double from_px, double to_px) {
  std::size_t steep = 0;
  std::size_t count = 0;
  for (const SmoothPlanes& image : images) {
    for (double r = from_px; r <= to_px; r += std::max(1.0, (to_px - from_px) / 16)) {
      const int steps = std::max(48, static_cast<int>(2 * std::numbers::pi * r / 2));
      std::vector<float> last;
      for (int i = 0; i <= steps; ++i) {
        const double angle = 2 * std::numbers::pi * i / steps;
        const double u = centre.u_px + r * std::cos(angle);
        const double v = centre.v_px + r * std::sin(angle);
        if (u < 0 || v < 0 || u >= image.width || v >= image.height) {
          last.clear();
          continue;
        }
        const std::size_t at = image.index(static_cast<int>(u), static_cast<int>(v));
        std::vector<float> here;
        for (const std::vector<float>& plane : image.channels) here.push_back(plane[at]);
        if (!last.empty()) {
          float slope = 0;
          for (std::size_t c = 0; c < here.size(); ++c) {
            slope = std::max(slope, std::abs(here[c] - last[c]));
          }
          if (slope >= image.slope_scale) ++steep;
          ++count;
        }
        last = std::move(here);
      }
    }
  }
  return count == 0 ? 0.0 : static_cast<double>(steep) / static_cast<double>(count);
}

/// Chooses, from concentric circles in ascending order, the one at which the mirrored scene ends,
/// and returns its index.
std::size_t choose_rim(const std::vector<MirrorCircle::Circle>& circles,
                       std::span<const SmoothPlanes> planes) {
  std::size_t rim = circles.size() - 1;
  for (std::size_t inner = rim; inner-- > 0;) {
    const double outer_px = circles[rim].radius_px;
    const double inner_px = circles[inner].radius_px;
    if (inner_px < (1 - max_ring_width) * outer_px) break;
    // Excludes the blur of the two edges; less in a thin ring, where it would leave nothing.
    const double margin_px = std::min(std::max(2.0, 0.02 * outer_px), 0.35 * (outer_px - inner_px));
    const double ring =
        measure_structure(planes, circles[rim].centre, inner_px + margin_px, outer_px - margin_px);
    const double scene =
        measure_structure(planes, circles[inner].centre, 0.5 * inner_px, inner_px - margin_px);
    if (ring < max_ring_structure * scene) rim = inner;
  }
  return rim;
}

/// Finds the radius around the rim's centre that encloses the dark disc or the camera's reflection;
/// nullopt if there is no clear circle.
std::optional<double> find_disc_radius(const SearchFields& search_fields,
                                       std::span<const SmoothPlanes> planes,
                                       const MirrorCircle::Circle& rim) {
  const double rim_radius = rim.radius_px / search_fields.middle_reduction;
  CircleRange range;
  range.min_radius = std::max(3.0, min_disc_radius * rim_radius);
  range.max_radius = max_disc_radius * rim_radius;
  range.visible_fraction = 0.75;
  range.averaging = EdgeAveraging::mean;  // a dark disc has no edge next to a dark scene
  const double reach_px = std::max(2.0, max_disc_offset * rim.radius_px);
  const PixelPoint centre{rim.centre.u_px / search_fields.middle_reduction,
                          rim.centre.v_px / search_fields.middle_reduction};
  struct Disc {
    double quality;
    double radius_px;
  };
  std::vector<Disc> discs;
  double best_quality = 0;
  for (const FieldCircle& candidate :
       concentric_candidates(search_fields.middle, centre.u_px, centre.v_px,
                             reach_px / search_fields.middle_reduction, range, 1.0)) {
    const auto found = refine_circle(search_fields, planes,
                                     climb_to_maximum(search_fields.middle, candidate, range));
    if (!found || found->radius_px > max_disc_radius * rim.radius_px) continue;
    const double centre_offset_px = distance_px(found->centre, rim.centre);
    if (centre_offset_px > reach_px) continue;
    const double inside = measure_structure(planes, found->centre, 0.0, 0.9 * found->radius_px);
    const double outside =
        measure_structure(planes, rim.centre, 1.1 * found->radius_px, 0.95 * rim.radius_px);
    const double needed =
        inside < max_ring_structure * outside ? min_plain_disc_quality : min_disc_quality;
    if (found->quality < needed) continue;
    discs.push_back({found->quality, found->radius_px + centre_offset_px});
    best_quality = std::max(best_quality, found->quality);
  }
  // The camera's reflection has several circles (lens, body); the widest clear one encloses them
  // all.
  std::optional<double> radius_px;
  for (const Disc& disc : discs) {
    if (disc.quality >= min_relative_quality * best_quality &&
        disc.radius_px > radius_px.value_or(0.0)) {
      radius_px = disc.radius_px;
    }
  }
  return radius_px;
}

/// Finds the circles of the middle field with the strongest edges, without duplicates, best first.
std::vector<FieldCircle> find_best_circles(const SearchFields& search_fields,
                                           const CircleRange& range) {
  struct Scored {
    double merit;
    FieldCircle circle;
  };
  std::vector<Scored> climbed;
  for (const FieldCircle& candidate :
       circle_candidates(search_fields.coarse, scale(range, 1.0 / search_fields.coarse_reduction),
                         max_climbed_circles)) {
    const FieldCircle circle = climb_to_maximum(
        search_fields.middle, scale(candidate, search_fields.coarse_reduction), range);
    if (circle.radius < range.min_radius || circle.radius > range.max_radius) continue;
    const CircleScore found = score_circle(search_fields.middle, circle, range.averaging);
    if (found.visible < range.visible_fraction) continue;
    climbed.push_back({found.quality * std::sqrt(found.visible), circle});
  }
  std::ranges::stable_sort(climbed, std::greater<>(), &Scored::merit);
  std::vector<FieldCircle> result;
  for (const Scored& scored : climbed) {
    const bool known = std::ranges::any_of(result, [&](const FieldCircle& other) {
      return std::abs(other.u - scored.circle.u) + std::abs(other.v - scored.circle.v) +
                 std::abs(other.radius - scored.circle.radius) <
             same_circle_px;
    });
    if (known) continue;
    result.push_back(scored.circle);
    if (static_cast<int>(result.size()) == max_fitted_circles) break;
  }
  return result;
}

struct MirrorSearchResult {
  MirrorCircle::Circle rim;
  std::optional<double> inner_radius_px;
};

std::optional<MirrorSearchResult> search_mirror(const SearchFields& search_fields,
                                                std::span<const SmoothPlanes> planes,
                                                const ImageSize& size,
                                                const MirrorCircle::SearchOptions& options) {
  CircleRange range;
  range.min_radius =
      options.min_rim * std::min(size.width, size.height) / search_fields.middle_reduction;
  range.max_radius =
      options.max_rim * std::max(size.width, size.height) / search_fields.middle_reduction;
  range.visible_fraction = options.visible_fraction;

  std::optional<MirrorCircle::Circle> clearest;
  double clearest_merit = 0;
  FieldCircle start;
  for (const FieldCircle& circle : find_best_circles(search_fields, range)) {
    const auto found = refine_circle(search_fields, planes, circle);
    if (!found || found->quality < options.min_quality) continue;
    const double merit =
        found->quality *
        std::sqrt(score_circle(search_fields.middle, circle, range.averaging).visible);
    if (merit > clearest_merit) {
      clearest_merit = merit;
      clearest = found;
      start = circle;
    }
  }
  if (!clearest) return std::nullopt;

  std::vector<MirrorCircle::Circle> circles{*clearest};
  for (const FieldCircle& candidate :
       concentric_candidates(search_fields.middle, start.u, start.v,
                             max_centre_distance * start.radius, range, 2.0)) {
    const auto found = refine_circle(search_fields, planes,
                                     climb_to_maximum(search_fields.middle, candidate, range));
    if (!found || found->quality < min_relative_quality * clearest->quality ||
        (found->radius_px > clearest->radius_px && found->quality < options.min_quality) ||
        distance_px(found->centre, clearest->centre) > max_centre_distance * found->radius_px) {
      continue;
    }
    const bool known = std::ranges::any_of(circles, [&](const MirrorCircle::Circle& other) {
      return std::abs(other.radius_px - found->radius_px) < std::max(2.0, 0.01 * found->radius_px);
    });
    if (!known) circles.push_back(*found);
  }
  std::sort(circles.begin(), circles.end(),
            [](const MirrorCircle::Circle& a, const MirrorCircle::Circle& b) {
              return a.radius_px < b.radius_px;
            });
  MirrorSearchResult result;
  result.rim = circles[choose_rim(circles, planes)];

  result.inner_radius_px = find_disc_radius(search_fields, planes, result.rim);
  return result;
}

}  // namespace

void visit_options(MirrorCircle::SearchOptions& options, OptionVisitor& visitor) {
  using T = MirrorCircle::SearchOptions;
  constexpr OptionTable table{
      option<&T::min_rim>(
          "smallest radius of the mirror's rim, as a share of the image's shorter side", above(0),
          2),
      option<&T::max_rim>(
          "largest radius of the mirror's rim, as a share of the image's longer side", above(0), 2),
      option<&T::visible_fraction>("smallest share of the rim that must be inside the image", 0.25,
                                   1),
      option<&T::min_quality>(
          "lowest quality of the rim, from 0 (any circle) to 1 (a sharp edge on the whole circle)",
          above(0), 1),
  };
  table.visit(options, visitor);
}

std::optional<MirrorCircle> find_mirror(std::span<const ImageView> images,
                                        const MirrorCircle::SearchOptions& options) {
  validate(options);
  require(!images.empty(), "number of images", 0, "at least 1");
  const ImageSize size = images[0].size();
  require(std::min(size.width, size.height) >= 32, "image size", std::min(size.width, size.height),
          "sides of at least 32 px");
  for (const ImageView& image : images) {
    require(image.width == size.width, "image width", image.width,
            "that of the first image, " + to_text(size.width));
    require(image.height == size.height, "image height", image.height,
            "that of the first image, " + to_text(size.height));
  }
  std::vector<SmoothPlanes> planes;
  std::vector<EdgeField> fields;
  for (const ImageView& image : images) {
    planes.push_back(make_smooth_planes(image, 1, 1.0));
    fields.push_back(make_middle_field(image));
  }
  MirrorCircle mirror;
  mirror.image_size = size;
  const auto all =
      search_mirror(make_search_fields(average_fields(fields), size), planes, size, options);
  if (!all) return std::nullopt;
  if (images.size() == 1) {
    mirror.rim_per_image.emplace_back(all->rim);
  } else {
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto one = search_mirror(make_search_fields(fields[i], size),
                                     std::span(planes).subspan(i, 1), size, options);
      mirror.rim_per_image.push_back(one ? std::optional(one->rim) : std::nullopt);
    }
  }
  mirror.centre = all->rim.centre;
  mirror.rim_radius_px = all->rim.radius_px;
  mirror.inner_radius_px = all->inner_radius_px;
  mirror.quality = all->rim.quality;
  mirror.residual_px = all->rim.residual_px;
  return mirror;
}

std::optional<MirrorCircle::Agreement> agreement(const MirrorCircle& mirror) {
  std::vector<MirrorCircle::Circle> rims;
  for (const auto& rim : mirror.rim_per_image) {
    if (rim) rims.push_back(*rim);
  }
  if (rims.size() < 2) return std::nullopt;
  const auto deviation = [&](auto value) {
    const auto count = static_cast<double>(rims.size());
    double mean = 0;
    for (const MirrorCircle::Circle& rim : rims) mean += value(rim) / count;
    double squares = 0;
    for (const MirrorCircle::Circle& rim : rims)
      squares += (value(rim) - mean) * (value(rim) - mean);
    return std::sqrt(squares / (count - 1));
  };
  return MirrorCircle::Agreement{
      static_cast<int>(rims.size()),
      deviation([](const MirrorCircle::Circle& rim) { return rim.centre.u_px; }),
      deviation([](const MirrorCircle::Circle& rim) { return rim.centre.v_px; }),
      deviation([](const MirrorCircle::Circle& rim) { return rim.radius_px; })};
}

bool is_scattered(const MirrorCircle& mirror) {
  const auto spread = agreement(mirror);
  return spread && std::max({spread->centre_u_px, spread->centre_v_px, spread->rim_radius_px}) >
                       max_rim_scatter * mirror.rim_radius_px;
}

}  // namespace panonav
