// Places far apart: `reproduce elsewhere` on any recordings, with two rivals more, which need
// OpenCV: ORB with mutual matches, and ORB with a VLAD of 32 words. One thread.
//   sparse_places_bench FOLDER...

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "lab/elsewhere/experiments.hpp"

#ifdef PANONAV_BENCH_ORB
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#endif

namespace panonav {
namespace {

#ifdef PANONAV_BENCH_ORB

/// 500 features (the default of OpenCV) of the rows that the memory keeps, as fine as recorded.
cv::Mat described(const lab::RivalView& view) {
  const Image& picture = view.picture;
  const cv::Mat grey(picture.height(), picture.width(), CV_8UC1,
                     const_cast<std::uint8_t*>(picture.pixels().data()));
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  cv::ORB::create(500)->detectAndCompute(grey, cv::noArray(), points, descriptors);
  return descriptors;
}

/// The reference of the highest score, the first of equals.
template <class Score>
std::size_t best_of(std::size_t count, std::optional<std::size_t> left_out, const Score& score) {
  std::optional<std::size_t> best;
  double highest = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == left_out) continue;
    const double value = score(i);
    if (best && value <= highest) continue;
    highest = value;
    best = i;
  }
  return best.value();
}

class MutualOrb final : public lab::RivalRecogniser {
 public:
  [[nodiscard]] std::string name() const override { return "ORB, mutual matches"; }
  void memorise(const std::vector<lab::RivalView>& references) override {
    for (const lab::RivalView& view : references) references_.push_back(described(view));
  }
  [[nodiscard]] std::size_t nearest(const lab::RivalView& query,
                                    std::optional<std::size_t> left_out) const override {
    const cv::BFMatcher matcher(cv::NORM_HAMMING, true);
    const cv::Mat query_descriptors = described(query);
    return best_of(references_.size(), left_out, [&](std::size_t i) {
      if (references_[i].empty() || query_descriptors.empty()) return 0.0;
      std::vector<cv::DMatch> matches;
      matcher.match(query_descriptors, references_[i], matches);
      return static_cast<double>(std::ranges::count_if(
          matches, [](const cv::DMatch& match) { return match.distance <= 64.0F; }));
    });
  }
  [[nodiscard]] double bytes_per_view() const override {
    double bytes = 0.0;
    for (const cv::Mat& one : references_) bytes += 32.0 * one.rows;
    return bytes / static_cast<double>(references_.size());
  }

 private:
  std::vector<cv::Mat> references_;
};

/// Residuals of the descriptors' bits against the words of a vocabulary, which is learnt from the
/// references of the memory, summed for each word; signed roots, unit length [Jegou et al. 2010].
class OrbVlad final : public lab::RivalRecogniser {
 public:
  [[nodiscard]] std::string name() const override { return "ORB, VLAD of 32 words"; }
  void memorise(const std::vector<lab::RivalView>& references) override {
    std::vector<cv::Mat> bits;
    cv::Mat all;
    for (const lab::RivalView& view : references) {
      bits.push_back(bits_of(described(view)));
      all.push_back(bits.back());
    }
    cv::setRNGSeed(1);
    cv::Mat labels;
    cv::kmeans(all, words, labels, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3}, 3,
               cv::KMEANS_PP_CENTERS, words_);
    for (const cv::Mat& one : bits) references_.push_back(vlad(one));
  }
  [[nodiscard]] std::size_t nearest(const lab::RivalView& query,
                                    std::optional<std::size_t> left_out) const override {
    const cv::Mat query_descriptors = vlad(bits_of(described(query)));
    return best_of(references_.size(), left_out,
                   [&](std::size_t i) { return query_descriptors.dot(references_[i]); });
  }
  [[nodiscard]] double bytes_per_view() const override { return 4.0 * words * 256; }

 private:
  static constexpr int words = 32;

  static cv::Mat bits_of(const cv::Mat& descriptors) {
    cv::Mat bits(descriptors.rows, 256, CV_32F);
    for (int i = 0; i < descriptors.rows; ++i) {
      for (int j = 0; j < 256; ++j) {
        bits.at<float>(i, j) =
            static_cast<float>((descriptors.at<std::uint8_t>(i, j / 8) >> (j % 8)) & 1);
      }
    }
    return bits;
  }

  [[nodiscard]] cv::Mat vlad(const cv::Mat& bits) const {
    cv::Mat sums = cv::Mat::zeros(words, 256, CV_32F);
    for (int i = 0; i < bits.rows; ++i) {
      int nearest = 0;
      for (int w = 1; w < words; ++w) {
        if (cv::norm(bits.row(i), words_.row(w), cv::NORM_L2SQR) <
            cv::norm(bits.row(i), words_.row(nearest), cv::NORM_L2SQR)) {
          nearest = w;
        }
      }
      sums.row(nearest) += bits.row(i) - words_.row(nearest);
    }
    for (float& value : cv::Mat_<float>(sums)) {
      value = std::copysign(std::sqrt(std::abs(value)), value);
    }
    cv::normalize(sums, sums);
    return sums;
  }

  cv::Mat words_;
  std::vector<cv::Mat> references_;
};

#endif

void compare(const std::filesystem::path& folder) {
  const lab::ReproductionOptions options = lab::default_options("elsewhere");
  std::vector<std::unique_ptr<lab::RivalRecogniser>> rivals;
#ifdef PANONAV_BENCH_ORB
  cv::setNumThreads(1);
  rivals.push_back(std::make_unique<MutualOrb>());
  rivals.push_back(std::make_unique<OrbVlad>());
#endif
  Executor alone(1);
  lab::Reproduction result{.out = std::filesystem::temp_directory_path()};
  lab::ElsewhereExperiments{{options, alone, result}}.reproduce_leave_one_out(folder,
                                                                              std::move(rivals));
  for (const lab::ResultRow& row : result.rows) {
    std::printf("%s: %s%s%s\n", row.what.c_str(), lab::format_figure(row).c_str(),
                row.over.empty() ? "" : ", ", row.over.c_str());
  }
}

}  // namespace
}  // namespace panonav

int main(int count, char** folders) {
  for (int i = 1; i < count; ++i) panonav::compare(folders[i]);
  return count > 1 ? 0 : 2;
}
