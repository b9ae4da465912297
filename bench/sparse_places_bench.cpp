// Places far apart: how many views of a recording are found when each is left out and turned, by
// columns, by local features, and by ORB of OpenCV with mutual matches. One thread, from the
// panorama, which is made beforehand, to the best match.
//   sparse_places_bench FOLDER...

#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include <ctime>

#include "panonav/core/random.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"

#ifdef PANONAV_BENCH_ORB
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#endif

namespace panonav {
namespace {

constexpr std::uint64_t seeds = 3;

double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Recording {
  explicit Recording(const char* folder) : data(read_dataset(folder)) {
    std::vector<Observation> seen;
    for (const DatasetEntry& entry : data.entries) seen.push_back(read_observation(entry));
    Executor alone;
    const auto first = std::span(seen).first(std::min(seen.size(), Memoriser::scale_views));
    header = header_from_first(first, data.source, {}, {}, alone);
    const ViewEncoder encoder(header, data.source);
    for (const Observation& one : seen) views.push_back(encoder.panorama(one));
  }
  [[nodiscard]] double apart(std::size_t a, std::size_t b) const {
    const auto& from = data.entries[a].pose;
    const auto& to = data.entries[b].pose;
    return from && to ? distance(from->position(), to->position())
                      : std::abs(static_cast<double>(a) - static_cast<double>(b));
  }
  Dataset data;
  MemoryHeader header;
  std::vector<Panorama> views;
};

/// `best` gives the most similar view of all but one.
void measure(const char* name, const Recording& run, double bytes_a_view,
             const std::function<std::size_t(const Panorama&, std::size_t left_out)>& best) {
  std::printf("%-28s found", name);
  double spent_ms = 0.0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    int found = 0;
    for (std::size_t i = 0; i < run.views.size(); ++i) {
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < run.views.size(); ++j) {
        if (j != i) nearest = std::min(nearest, run.apart(i, j));
      }
      Random random(seed, i);
      const Panorama query = turn_columns(
          run.views[i],
          static_cast<int>(random.index(static_cast<std::uint64_t>(run.header.panorama_columns))));
      const double start_ms = processor_ms();
      const std::size_t match = best(query, i);
      spent_ms += processor_ms() - start_ms;
      found += run.apart(i, match) <= 1.5 * nearest ? 1 : 0;
    }
    std::printf(" %3d", found);
  }
  std::printf(" of %zu; %6.2f ms a query, %6.0f bytes a view\n", run.views.size(),
              spent_ms / static_cast<double>(seeds * run.views.size()), bytes_a_view);
}

void compare(const char* folder) {
  const Recording run(folder);
  std::printf("%s\n", folder);
  const ViewEncoder encoder(run.header, run.data.source);
  VisualMemory memory(run.header.shape, run.header.full_scale, run.header.elevations);
  std::vector<LocalFeatures> kept;
  double feature_bytes = 0.0;
  for (std::size_t i = 0; i < run.views.size(); ++i) {
    memory.append(encoder.packed(run.views[i]), {std::to_string(i), run.data.entries[i].pose, {}});
    kept.push_back(encoder.features(run.views[i]).value());
    feature_bytes += static_cast<double>(pack(kept.back()).size());
  }
  feature_bytes /= static_cast<double>(kept.size());
  const auto place = [&](ViewId view) {
    return static_cast<std::size_t>(std::ranges::lower_bound(memory.views(), view) -
                                    memory.views().begin());
  };
  Localiser localiser(memory);
  const auto ours = [&](const Panorama& query, std::size_t left_out) {
    const ViewId excluded = memory.views()[left_out];
    std::optional<LocalFeatures> features;
    if (localiser.ranks_by_features()) features = encoder.features(query);
    const auto found = localiser.localise(encoder.packed(query), {{&excluded, 1}, {}},
                                          features ? &*features : nullptr);
    return place(found.matches.at(0).view);
  };
  const auto signature_bytes = static_cast<double>(2 * run.header.shape.size());
  measure("columns", run, signature_bytes, ours);
  localiser.rank_by_features([&](ViewId view) { return std::optional(kept[place(view)]); });
  measure("local features", run, signature_bytes + feature_bytes, ours);

#ifdef PANONAV_BENCH_ORB
  cv::setNumThreads(1);
  const auto orb = cv::ORB::create(500);
  const auto described = [&](const Panorama& view) {
    const Image picture = to_picture(view);
    const cv::Mat grey(picture.height(), picture.width(), CV_8UC1,
                       const_cast<std::uint8_t*>(picture.pixels().data()));
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
    orb->detectAndCompute(grey, cv::noArray(), points, descriptors);
    return descriptors;
  };
  std::vector<cv::Mat> references;
  double orb_bytes = 0.0;
  for (const Panorama& view : run.views) {
    references.push_back(described(view));
    orb_bytes += 32.0 * references.back().rows;
  }
  const cv::BFMatcher matcher(cv::NORM_HAMMING, true);
  measure("ORB, mutual matches", run, orb_bytes / static_cast<double>(references.size()),
          [&](const Panorama& query, std::size_t left_out) {
            const cv::Mat asked = described(query);
            std::size_t best = left_out == 0 ? 1 : 0;
            std::size_t most = 0;
            for (std::size_t j = 0; j < references.size(); ++j) {
              if (j == left_out || references[j].empty() || asked.empty()) continue;
              std::vector<cv::DMatch> matches;
              matcher.match(asked, references[j], matches);
              const auto near = static_cast<std::size_t>(std::ranges::count_if(
                  matches, [](const cv::DMatch& match) { return match.distance <= 64.0F; }));
              if (near > most) {
                most = near;
                best = j;
              }
            }
            return best;
          });
#endif
}

}  // namespace
}  // namespace panonav

int main(int count, char** folders) {
  for (int i = 1; i < count; ++i) panonav::compare(folders[i]);
  return count > 1 ? 0 : 2;
}
