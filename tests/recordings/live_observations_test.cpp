#include "panonav_recordings/live_observations.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <set>
#include <string>
#include <vector>

#include "support/picture_samples.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

// A memory refuses a name that it has. The first two pictures of a stream that is there already are
// taken in less than a microsecond now and then.
TEST(LiveObservations, PicturesThatComeAtOnceHaveNamesAndStampsOfTheirOwn) {
  const auto picture = make_jpeg(Image(8, 8), 90, false);
  const int standard_input = dup(STDIN_FILENO);
  for (int repetition = 0; repetition < 300; ++repetition) {
    std::array<int, 2> ends{};
    ASSERT_EQ(pipe(ends.data()), 0);
    std::vector<std::uint8_t> stream;
    for (int i = 0; i < 3; ++i) stream.insert(stream.end(), picture.begin(), picture.end());
    ASSERT_EQ(write(ends[1], stream.data(), stream.size()), static_cast<ssize_t>(stream.size()));
    close(ends[1]);
    dup2(ends[0], STDIN_FILENO);
    close(ends[0]);
    LiveObservations source("-", {});
    std::set<std::string> names;
    double before_s = 0.0;
    while (const auto seen = source.next()) {
      names.insert(seen->name);
      EXPECT_GT(seen->stamp_s, before_s);
      before_s = *seen->stamp_s;
    }
    ASSERT_EQ(names.size(), 3U);
  }
  dup2(standard_input, STDIN_FILENO);
  close(standard_input);
}

}  // namespace
}  // namespace panonav::recordings
