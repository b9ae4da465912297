#include "panonav_recordings/internal/video_store.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"

namespace panonav::recordings {

Image VideoStore::read(std::size_t number) const {
  const std::lock_guard lock(mutex_);
  const std::int64_t stamp_to_find = chosen_.stamps.at(number);
  if (const auto kept = kept_pictures_.find(stamp_to_find); kept != kept_pictures_.end()) {
    Image picture = std::move(kept->second);
    kept_pictures_.erase(kept);
    return picture;
  }
  if (frames_ && stamp_to_find > last_) {
    if (auto picture = decode_up_to(stamp_to_find)) return std::move(*picture);
  }
  // Seeking can fail in cut files; the second pass decodes from the beginning.
  for (const bool sought : {true, false}) {
    if (!sought && number == 0) continue;
    start_decoding(number, sought);
    if (auto picture = decode_up_to(stamp_to_find)) return std::move(*picture);
  }
  const std::string why = frames_->last_error();
  frames_.reset();
  throw FileError(file_, "the image at " + format_number(seconds(stamp_to_find)) +
                             " s cannot be decoded" +
                             (why.empty() ? "" : ": " + to_readable_line(why)));
}

std::optional<Image> VideoStore::decode_up_to(std::int64_t stamp_to_find) const {
  while (auto frame = frames_->next()) {
    last_ = frame->stamp;
    if (frame->stamp == stamp_to_find) return std::move(frame->picture);
    if (frame->stamp > stamp_to_find) break;
    if (std::ranges::binary_search(chosen_.stamps, frame->stamp)) keep_for_later(std::move(*frame));
  }
  return std::nullopt;
}

void VideoStore::start_decoding(std::size_t number, bool sought) const {
  const double first_s = seconds(chosen_.stamps[number]);
  constexpr double rounding_s = 1e-4;
  std::string select_expression = "gte(t," + to_text(first_s - rounding_s) + ")";
  if (every_s_) {
    select_expression +=
        "*(isnan(prev_selected_t)+gte(t-prev_selected_t," + to_text(*every_s_ - rounding_s) + "))";
  }
  std::vector<std::string> input{"-copyts"};
  const bool has_right_file = !chosen_.right_file.empty();
  std::vector<std::string> files{file_};
  if (has_right_file) files.push_back(chosen_.right_file);
  for (const std::string& file : files) {
    if (sought && number > 0)
      input.insert(input.end(), {"-seek_timestamp", "1", "-ss", to_text(first_s - 0.5)});
    input.insert(input.end(), {"-protocol_whitelist", "file,pipe", "-i", "file:" + file});
  }
  kept_pictures_.clear();
  const DecodedTracks tracks{chosen_.track, chosen_.right_track, has_right_file ? 1 : 0,
                             chosen_.unit};
  frames_.emplace(input, select_expression, file_, limits_, tracks);
  last_ = std::numeric_limits<std::int64_t>::min();
}

void VideoStore::keep_for_later(DecodedFrame&& frame) const {
  constexpr std::size_t max_bytes = std::size_t{256} << 20;
  constexpr std::size_t max_pictures = 32;
  const std::size_t max_kept =
      std::clamp<std::size_t>(max_bytes / frame.picture.pixels().size(), 2, max_pictures);
  kept_pictures_.emplace(frame.stamp, std::move(frame.picture));
  while (kept_pictures_.size() > max_kept) kept_pictures_.erase(kept_pictures_.begin());
}

}  // namespace panonav::recordings
