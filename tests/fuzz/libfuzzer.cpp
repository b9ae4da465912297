// The program that libFuzzer drives, for the target that PANONAV_FUZZ_TARGET names.
#include <cstddef>
#include <cstdlib>

#include "fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto& target : panonav::testing::fuzz_targets()) {
    if (target.name != PANONAV_FUZZ_TARGET) continue;
    target.read({data, size});
    return 0;
  }
  std::abort();
}
