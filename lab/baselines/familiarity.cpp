// Rivals that move in the most familiar heading: perfect memory, Infomax network, mushroom body.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "lab/baselines/route_rivals.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::lab {

namespace {

constexpr int pixels = HeadingScan::rows * HeadingScan::columns;
constexpr std::size_t kept_every = 3;

using Views = Eigen::Map<const Eigen::MatrixXf>;

// All headings of a scan as columns.
Views as_columns(const HeadingScan& scan) {
  return {scan.view(0).data(), pixels, HeadingScan::headings};
}

class PerfectMemory final : public RouteMethod {
 public:
  [[nodiscard]] std::string name() const override { return "perfect memory"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    const auto count = static_cast<Eigen::Index>((pictures.size() + kept_every - 1) / kept_every);
    views_.resize(count, pixels);
    for (Eigen::Index i = 0; i < count; ++i) {
      const HeadingScan scan(pictures[static_cast<std::size_t>(i) * kept_every].panorama);
      views_.row(i) = as_columns(scan).col(HeadingScan::ahead).transpose();
    }
    squares_ = views_.rowwise().squaredNorm();
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const HeadingScan scan(picture.panorama);
    const Views seen = as_columns(scan);
    // |a - b|^2 without the square of the view, which all headings share.
    const Eigen::MatrixXf difference = (-2.0F * views_ * seen).colwise() + squares_;
    Eigen::Index view = 0;
    Eigen::Index heading = 0;
    difference.minCoeff(&view, &heading);
    return {.turn_rad = HeadingScan::turn_rad(static_cast<int>(heading)),
            .place = static_cast<std::size_t>(view) * kept_every};
  }

  [[nodiscard]] double bytes() const override { return static_cast<double>(views_.size()); }

 private:
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> views_;
  Eigen::VectorXf squares_;
};

// Views with mean 0 and length 1, so that light does not decide and units begin with deviation 1.
Eigen::MatrixXf standardise(const HeadingScan& scan) {
  Eigen::MatrixXf views = as_columns(scan);
  views.rowwise() -= views.colwise().mean();
  views.colwise().normalize();
  return views;
}

class InfomaxNetwork final : public RouteMethod {
 public:
  [[nodiscard]] std::string name() const override { return "Infomax network"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    Random random(1);
    weights_.resize(pixels, pixels);
    for (Eigen::Index i = 0; i < weights_.size(); ++i) {
      weights_.data()[i] = static_cast<float>(random.uniform(-0.5, 0.5));
    }
    // Weights of each unit have mean 0 and deviation 1.
    for (Eigen::Index i = 0; i < pixels; ++i) {
      weights_.row(i).array() -= weights_.row(i).mean();
      weights_.row(i) *= std::sqrt(static_cast<float>(pixels)) / weights_.row(i).norm();
    }
    // Ten times the published rate, with which a picture seen once hardly changes the weights.
    constexpr float learning_rate = 0.1F;
    for (std::size_t i = 0; i < pictures.size(); i += kept_every) {
      const Eigen::VectorXf x =
          standardise(HeadingScan(pictures[i].panorama)).col(HeadingScan::ahead);
      const Eigen::VectorXf h = weights_ * x;
      const Eigen::VectorXf sum = h.array().tanh().matrix() + h;
      const Eigen::RowVectorXf back = h.transpose() * weights_;
      constexpr float step = learning_rate / pixels;
      weights_ = (1.0F + step) * weights_ - step * sum * back;
    }
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const Eigen::MatrixXf h = weights_ * standardise(HeadingScan(picture.panorama));
    Eigen::Index heading = 0;
    h.cwiseAbs().colwise().sum().minCoeff(&heading);
    return {.turn_rad = HeadingScan::turn_rad(static_cast<int>(heading))};
  }

  [[nodiscard]] double bytes() const override {
    return static_cast<double>(sizeof(float)) * static_cast<double>(weights_.size());
  }

 private:
  Eigen::MatrixXf weights_;
};

class MushroomBody final : public RouteMethod {
 public:
  MushroomBody() : inputs_(cells), depressed_(cells, 0) {
    Random random(1);
    for (auto& cell : inputs_) {
      for (std::uint16_t& input : cell) input = static_cast<std::uint16_t>(random.index(neurons));
    }
  }

  [[nodiscard]] std::string name() const override { return "mushroom body"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    std::ranges::fill(depressed_, 0);
    for (std::size_t i = 0; i < pictures.size(); i += kept_every) {
      const HeadingScan scan(pictures[i].panorama);
      for (const std::size_t cell : find_active_cells(scan.view(HeadingScan::ahead))) {
        depressed_[cell] = 1;
      }
    }
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const HeadingScan scan(picture.panorama);
    int best = HeadingScan::ahead;
    int min_output = static_cast<int>(active_cells) + 1;
    // From straight ahead to the sides, so that of equal outputs the smallest turn is taken.
    for (int i = 0; i < HeadingScan::headings; ++i) {
      const int heading = HeadingScan::ahead + (i % 2 == 0 ? i / 2 : -(i + 1) / 2);
      int output = 0;
      for (const std::size_t cell : find_active_cells(scan.view(heading))) {
        output += depressed_[cell] == 0 ? 1 : 0;
      }
      if (output >= min_output) continue;
      min_output = output;
      best = heading;
    }
    return {.turn_rad = HeadingScan::turn_rad(best)};
  }

  // One bit a synapse; the wiring follows from a seed.
  [[nodiscard]] double bytes() const override { return cells / 8.0; }

 private:
  static constexpr std::size_t cells = 20'000;
  static constexpr std::size_t active_cells = cells / 100;
  static constexpr int neurons = pixels / 2;  // 36 x 10
  static constexpr int inputs_per_cell = 10;

  // Ranks of the pixels of a view, two columns together: inverted histogram equalisation.
  static std::array<std::uint16_t, neurons> equalise(std::span<const float> view) {
    std::array<float, neurons> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = view[2 * i] + view[2 * i + 1];
    std::array<std::uint16_t, neurons> order{};
    std::iota(order.begin(), order.end(), std::uint16_t{0});
    std::ranges::stable_sort(order, [&](auto a, auto b) { return values[a] > values[b]; });
    std::array<std::uint16_t, neurons> ranks{};
    for (std::size_t i = 0; i < order.size(); ++i) ranks[order[i]] = static_cast<std::uint16_t>(i);
    return ranks;
  }

  // Returns the cells with the largest inputs.
  [[nodiscard]] std::vector<std::size_t> find_active_cells(std::span<const float> view) const {
    const auto ranks = equalise(view);
    std::array<std::size_t, inputs_per_cell * neurons> histogram{};
    std::vector<std::uint16_t> sums(cells);
    for (std::size_t cell = 0; cell < cells; ++cell) {
      int sum = 0;
      for (const std::uint16_t input : inputs_[cell]) sum += ranks[input];
      sums[cell] = static_cast<std::uint16_t>(sum);
      ++histogram[static_cast<std::size_t>(sum)];
    }
    std::size_t threshold = histogram.size();
    std::size_t above = 0;
    while (threshold > 0 && above + histogram[threshold - 1] <= active_cells) {
      above += histogram[--threshold];
    }
    std::vector<std::size_t> active;
    for (std::size_t cell = 0; cell < cells; ++cell) {
      if (sums[cell] >= threshold) active.push_back(cell);
    }
    return active;
  }

  std::vector<std::array<std::uint16_t, inputs_per_cell>> inputs_;
  std::vector<std::uint8_t> depressed_;
};

}  // namespace

void require_route(std::span<const RoutePicture> pictures) {
  require(pictures.size() >= 2, "pictures of a route", static_cast<double>(pictures.size()),
          ">= 2");
}

Panorama shrink_panorama(const Panorama& panorama, int rows, int columns) {
  require(rows >= 1 && rows <= panorama.rows(), "rows", rows, "1 to those of the panorama");
  require(columns >= 4 && columns <= panorama.columns(), "columns", columns,
          "4 to those of the panorama");
  Panorama small(rows, columns, panorama.elevations());
  for (int y = 0; y < rows; ++y) {
    for (int c = 0; c < columns; ++c) {
      float sum = 0.0F;
      int count = 0;
      for (int v = y * panorama.rows() / rows; v < (y + 1) * panorama.rows() / rows; ++v) {
        for (int u = c * panorama.columns() / columns; u < (c + 1) * panorama.columns() / columns;
             ++u, ++count) {
          sum += panorama.at(v, u);
        }
      }
      small.at(y, c) = sum / static_cast<float>(count);
    }
  }
  return small;
}

HeadingScan::HeadingScan(const Panorama& panorama) {
  const Panorama small = shrink_panorama(panorama, rows, columns);
  values_.reserve(static_cast<std::size_t>(headings) * rows * columns);
  for (int heading = 0; heading < headings; ++heading) {
    const Panorama turned = rotate_columns(small, heading - ahead);
    values_.insert(values_.end(), turned.values().begin(), turned.values().end());
  }
}

double HeadingScan::turn_rad(int heading) {
  return radians(360.0 / columns) * (heading - ahead);
}

std::unique_ptr<RouteMethod> make_perfect_memory() {
  return std::make_unique<PerfectMemory>();
}
std::unique_ptr<RouteMethod> make_infomax_network() {
  return std::make_unique<InfomaxNetwork>();
}
std::unique_ptr<RouteMethod> make_mushroom_body() {
  return std::make_unique<MushroomBody>();
}

}  // namespace panonav::lab
