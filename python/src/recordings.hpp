#pragma once

#include <filesystem>

#include "bindings.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::python {

/// A data set, or a folder of pictures, a picture, a video or a recording of topics that lies as
/// `source` says. Throws FileError.
[[nodiscard]] Dataset open_dataset(const std::filesystem::path& path,
                                   const std::optional<PictureSource>& source);
/// A `Dataset`, or the path of what `open_dataset` reads.
[[nodiscard]] Dataset dataset_from(const py::handle& recording,
                                   const std::optional<PictureSource>& source);

/// `make(i)` for 0 .. count - 1 on all threads, some at a time, and `use(i, made)` in order.
template <class Make, class Use>
void in_order(std::size_t count, Executor& executor, const Make& make, const Use& use) {
  const std::size_t batch = 8 * static_cast<std::size_t>(executor.threads());
  for (std::size_t begin = 0; begin < count; begin += batch) {
    std::vector<std::optional<decltype(make(begin))>> made(std::min(batch, count - begin));
    executor.for_chunks(made.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      made[i].emplace(make(begin + i));
    });
    for (std::size_t i = 0; i < made.size(); ++i) {
      use(begin + i, std::move(*made[i]));
      check_signals();
    }
  }
}

}  // namespace panonav::python
