#include "lab/baselines/rivals.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::lab {

namespace {

void require_references(const std::vector<RivalView>& references) {
  require(!references.empty(), "number of reference views", 0.0, ">= 1");
  for (const auto& view : references) {
    const Panorama& first = references[0].panorama;
    const Panorama& here = view.panorama;
    require(here.rows() == first.rows() && here.columns() == first.columns(),
            "columns of a reference view", here.columns(), "the shape of the first reference view");
  }
}

// Returns the index of the smallest value of `distance(i)`, without `left_out`; the first one of
// equal values.
template <class Distance>
std::size_t argmin(std::size_t count, std::optional<std::size_t> left_out,
                   const Distance& distance) {
  require(count >= (left_out ? 2U : 1U), "number of reference views", static_cast<double>(count),
          ">= 1 beside the one left out");
  std::optional<std::size_t> best;
  double smallest = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == left_out) continue;
    const double value = distance(i);
    if (best && !(value < smallest)) continue;
    smallest = value;
    best = i;
  }
  return *best;
}

// Recognises a place by one descriptor per view: the nearest reference is the one with the smallest
// difference of descriptors.
template <class Descriptor>
class DescriptorRecogniser final : public RivalRecogniser {
 public:
  struct Method {
    std::string name;
    std::function<Descriptor(const RivalView& view)> describe;
    std::function<double(const Descriptor& a, const Descriptor& b)> difference;
    std::function<double(const Descriptor& reference)> bytes;
  };
  explicit DescriptorRecogniser(Method method) : method_(std::move(method)) {}
  [[nodiscard]] std::string name() const override { return method_.name; }
  void memorise(const std::vector<RivalView>& references) override {
    require_references(references);
    references_.clear();
    for (const auto& view : references) references_.push_back(method_.describe(view));
  }
  [[nodiscard]] std::size_t nearest(const RivalView& query,
                                    std::optional<std::size_t> left_out) const override {
    const Descriptor descriptor = method_.describe(query);
    return argmin(references_.size(), left_out,
                  [&](std::size_t i) { return method_.difference(descriptor, references_[i]); });
  }
  [[nodiscard]] double bytes_per_view() const override {
    return references_.empty() ? 0.0 : method_.bytes(references_.front());
  }

 private:
  Method method_;
  std::vector<Descriptor> references_;
};

template <class Descriptor>
std::unique_ptr<RivalRecogniser> make_recogniser(
    typename DescriptorRecogniser<Descriptor>::Method method) {
  return std::make_unique<DescriptorRecogniser<Descriptor>>(std::move(method));
}

using PixelValues = std::vector<float>;

double l1(const PixelValues& a, const PixelValues& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum;
}

PixelValues grey_histogram(const Panorama& view, int bins) {
  PixelValues counts(static_cast<std::size_t>(bins));
  for (const float value : view.values()) {
    const int bin = static_cast<int>(std::floor(value * static_cast<float>(bins)));
    counts[static_cast<std::size_t>(std::clamp(bin, 0, bins - 1))] += 1.0F;
  }
  for (auto& count : counts) count /= static_cast<float>(view.values().size());
  return counts;
}

PixelValues colour_histogram(const Image& view, int bins) {
  require(view.channels() == 3, "channels of a view", view.channels(), "3");
  PixelValues counts(static_cast<std::size_t>(bins) * bins * bins);
  const auto pixels = view.pixels();
  const float share = 3.0F / static_cast<float>(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); i += 3) {
    const auto bin = [&](std::size_t c) { return pixels[i + c] * bins / 256; };
    counts[static_cast<std::size_t>((bin(0) * bins + bin(1)) * bins + bin(2))] += share;
  }
  return counts;
}

// Returns the zero-phase representation [Pajdla and Hlavac 1999]: the view is rotated so that the
// phase of its first harmonic, summed over rows, becomes zero.
Panorama rotate_to_zero_phase(const Panorama& view) {
  std::complex<double> first{0.0, 0.0};
  for (int c = 0; c < view.columns(); ++c) {
    double column = 0.0;
    for (int y = 0; y < view.rows(); ++y) column += view.at(y, c);
    first += column * std::polar(1.0, -view.azimuth_rad(c));
  }
  // I(phi) ~ cos(phi + psi) has its maximum at phi = -psi; the rotation brings it to column 0.
  const double columns_per_radian = view.columns() / (2.0 * std::numbers::pi);
  return rotate_columns(view, static_cast<int>(std::lround(-std::arg(first) * columns_per_radian)));
}

// Compares principal components of views rotated to zero phase. Eigenimages depend on the
// heading, so the papers that use them rotate the views to a canonical heading first.
class EigenimageRecogniser final : public RivalRecogniser {
 public:
  explicit EigenimageRecogniser(int dimensions) : dimensions_(dimensions) {
    require(dimensions >= 1, "eigenimages", dimensions, ">= 1");
  }
  [[nodiscard]] std::string name() const override { return "eigenimages"; }
  void memorise(const std::vector<RivalView>& references) override {
    require_references(references);
    const auto count = static_cast<Eigen::Index>(references.size());
    const auto pixels = static_cast<Eigen::Index>(references[0].panorama.values().size());
    Eigen::MatrixXf views(pixels, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      views.col(i) = column(references[static_cast<std::size_t>(i)].panorama);
    }
    mean_ = views.rowwise().mean();
    views.colwise() -= mean_;
    // With fewer views than pixels, the small matrix of inner products gives the same eigenvectors
    // at lower cost.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(views.transpose() * views);
    const Eigen::Index component_count = std::min<Eigen::Index>(dimensions_, count);
    basis_ = views * solver.eigenvectors().rightCols(component_count);
    for (Eigen::Index k = 0; k < component_count; ++k) {
      const float length = basis_.col(k).norm();
      if (length > 0.0F) basis_.col(k) /= length;
    }
    coefficients_ = basis_.transpose() * views;
  }
  [[nodiscard]] std::size_t nearest(const RivalView& query,
                                    std::optional<std::size_t> left_out) const override {
    const Eigen::VectorXf coefficients = basis_.transpose() * (column(query.panorama) - mean_);
    return argmin(static_cast<std::size_t>(coefficients_.cols()), left_out, [&](std::size_t i) {
      return (coefficients_.col(static_cast<Eigen::Index>(i)) - coefficients).squaredNorm();
    });
  }
  /// Returns the bytes of the coefficients of one view, plus the eigenimages divided by the
  /// number of views.
  [[nodiscard]] double bytes_per_view() const override {
    if (coefficients_.cols() == 0) return 0.0;
    return 4.0 * static_cast<double>(coefficients_.rows()) +
           static_cast<double>(basis_.size()) / static_cast<double>(coefficients_.cols());
  }

 private:
  static Eigen::VectorXf column(const Panorama& view) {
    const Panorama turned = rotate_to_zero_phase(view);
    return Eigen::Map<const Eigen::VectorXf>(turned.values().data(),
                                             static_cast<Eigen::Index>(turned.values().size()));
  }
  int dimensions_;
  Eigen::VectorXf mean_;
  Eigen::MatrixXf basis_;
  Eigen::MatrixXf coefficients_;
};

// Compares all pixels at all rotations by whole columns. The sums of squared differences for all
// rotations come from the spectra, which takes seconds; pixel by pixel it would take hours.
class RotationSpectra {
 public:
  struct Spectrum {
    Eigen::MatrixXcf rows;  // rows x frequencies 0 .. columns / 2
    double energy = 0.0;
    std::size_t pixels = 0;
  };

  [[nodiscard]] Spectrum spectrum(const Panorama& view) {
    if (matrix_.size() == 0) matrix_ = transform_matrix(view.columns());
    require(view.columns() == matrix_.rows(), "columns of a view", view.columns(),
            "those of the reference views");
    using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const RowMajor> values(view.values().data(), view.rows(), view.columns());
    return {values.cast<std::complex<float>>() * matrix_, values.cast<double>().squaredNorm(),
            view.values().size()};
  }

  // Returns the minimum over rotations of the sum of squared differences = |a|^2 + |b|^2 - 2 max
  // correlation.
  [[nodiscard]] double distance(const Spectrum& a, const Spectrum& b) const {
    const Eigen::VectorXcf cross =
        (a.rows.array() * b.rows.array().conjugate()).colwise().sum().transpose();
    Eigen::VectorXcf weighted = cross;
    const Eigen::Index columns = matrix_.rows();
    const Eigen::Index last = weighted.size() - 1;
    for (Eigen::Index k = 1; k <= last; ++k) {
      if (!(k == last && columns % 2 == 0)) weighted(k) *= 2.0F;
    }
    // Correlation at turn c: (1/N) Re sum_k w_k cross_k exp(+j 2 pi k c / N).
    const Eigen::VectorXf correlation = (matrix_.conjugate() * weighted).real();
    return a.energy + b.energy -
           2.0 * static_cast<double>(correlation.maxCoeff()) / static_cast<double>(columns);
  }

 private:
  static Eigen::MatrixXcf transform_matrix(int columns) {
    Eigen::MatrixXcf matrix(columns, columns / 2 + 1);
    for (int c = 0; c < columns; ++c) {
      for (int k = 0; k <= columns / 2; ++k) {
        const int step = static_cast<int>((static_cast<long long>(c) * k) % columns);
        matrix(c, k) = std::polar(1.0F, -2.0F * std::numbers::pi_v<float> *
                                            static_cast<float>(step) / static_cast<float>(columns));
      }
    }
    return matrix;
  }

  Eigen::MatrixXcf matrix_;  // columns x frequencies
};

// Size of the shrunk view and half the patch size in pixels: SeqSLAM uses 64 x 32 and patches of 8
// x 8, but a panorama is wider.
constexpr int small_columns = 128;
constexpr int small_rows = 32;
constexpr int half_patch = 4;

Panorama shrink(const Panorama& view) {
  const int rows = std::min(view.rows(), small_rows);
  const int columns = std::min(view.columns(), small_columns);
  Panorama small(rows, columns, std::nullopt);
  for (int y = 0; y < rows; ++y) {
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      int count = 0;
      for (int v = y * view.rows() / rows; v < (y + 1) * view.rows() / rows; ++v) {
        for (int u = c * view.columns() / columns; u < (c + 1) * view.columns() / columns; ++u) {
          sum += view.at(v, u);
          ++count;
        }
      }
      small.at(y, c) = static_cast<float>(sum / count);
    }
  }
  return small;
}

Panorama normalise_patches(const Panorama& view) {
  const Panorama small = shrink(view);
  Panorama result = small;
  for (int y = 0; y < small.rows(); ++y) {
    for (int c = 0; c < small.columns(); ++c) {
      double sum = 0.0;
      double squares = 0.0;
      int count = 0;
      for (int v = std::max(0, y - half_patch); v < std::min(small.rows(), y + half_patch); ++v) {
        for (int u = c - half_patch; u < c + half_patch; ++u) {
          const double value = small.at(v, (u + small.columns()) % small.columns());
          sum += value;
          squares += value * value;
          ++count;
        }
      }
      const double mean = sum / count;
      const double deviation = std::sqrt(std::max(0.0, squares / count - mean * mean));
      // A patch without contrast is set to 0: dividing by its deviation would amplify noise.
      result.at(y, c) =
          deviation > 1e-3 ? static_cast<float>((small.at(y, c) - mean) / deviation) : 0.0F;
    }
  }
  return result;
}

double difference(const Panorama& a, const Panorama& b) {
  double min_difference = std::numeric_limits<double>::infinity();
  const auto columns = static_cast<std::size_t>(a.columns());
  for (std::size_t turn = 0; turn < columns; ++turn) {
    float sum = 0.0F;
    for (int y = 0; y < a.rows(); ++y) {
      const float* const row_a = a.values().data() + static_cast<std::size_t>(y) * columns;
      const float* const row_b = b.values().data() + static_cast<std::size_t>(y) * columns;
      for (std::size_t c = 0; c + turn < columns; ++c) {
        sum += std::abs(row_a[c + turn] - row_b[c]);
      }
      for (std::size_t c = columns - turn; c < columns; ++c) {
        sum += std::abs(row_a[c + turn - columns] - row_b[c]);
      }
    }
    min_difference = std::min(min_difference, static_cast<double>(sum));
  }
  return min_difference;
}

}  // namespace

std::unique_ptr<RivalRecogniser> make_fourier_signature_recogniser(int components) {
  return make_recogniser<FourierSignature>(
      {"Fourier signature",
       [=](const RivalView& view) { return compute_signature(view.panorama, components); },
       [](const auto& a, const auto& b) { return dissimilarity_l1(a, b); },
       [](const auto& signature) { return 2.0 * static_cast<double>(signature.shape().size()); }});
}

// Compares one grey histogram of the whole view; Ulrich and Nourbakhsh use colour histograms.
std::unique_ptr<RivalRecogniser> make_grey_histogram_recogniser(int bins) {
  require(bins >= 2 && bins <= 256, "histogram bins", bins, "2 .. 256");
  return make_recogniser<PixelValues>(
      {"grey histogram", [=](const RivalView& view) { return grey_histogram(view.panorama, bins); },
       l1,
       [](const PixelValues& histogram) { return 2.0 * static_cast<double>(histogram.size()); }});
}

// Compares colour histograms, which need no phases and no unwarping and do not depend on the
// heading.
std::unique_ptr<RivalRecogniser> make_colour_histogram_recogniser(int bins_per_channel) {
  require(bins_per_channel >= 2 && bins_per_channel <= 32, "histogram bins per channel",
          bins_per_channel, "2 .. 32");
  return make_recogniser<PixelValues>(
      {"colour histogram",
       [=](const RivalView& view) { return colour_histogram(view.picture, bins_per_channel); }, l1,
       [](const PixelValues& histogram) { return 2.0 * static_cast<double>(histogram.size()); }});
}

std::unique_ptr<RivalRecogniser> make_eigenimage_recogniser(int dimensions) {
  return std::make_unique<EigenimageRecogniser>(dimensions);
}

std::unique_ptr<RivalRecogniser> make_zero_phase_recogniser() {
  return make_recogniser<PixelValues>(
      {"zero-phase representation",
       [](const RivalView& view) {
         const Panorama turned = rotate_to_zero_phase(view.panorama);
         return PixelValues(turned.values().begin(), turned.values().end());
       },
       l1, [](const PixelValues& pixels) { return static_cast<double>(pixels.size()); }});
}

std::unique_ptr<RivalRecogniser> make_pixels_over_all_rotations_recogniser() {
  const auto spectra = std::make_shared<RotationSpectra>();
  return make_recogniser<RotationSpectra::Spectrum>(
      {"pixels over all turns",
       [=](const RivalView& view) { return spectra->spectrum(view.panorama); },
       [=](const auto& a, const auto& b) { return spectra->distance(a, b); },
       [](const auto& spectrum) { return static_cast<double>(spectrum.pixels); }});
}

std::unique_ptr<RivalRecogniser> make_patch_normalised_recogniser() {
  return make_recogniser<Panorama>(
      {"patch-normalised pixels",
       [](const RivalView& view) { return normalise_patches(view.panorama); }, difference,
       [](const Panorama& view) { return static_cast<double>(view.values().size()); }});
}

}  // namespace panonav::lab
