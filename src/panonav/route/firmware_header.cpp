#include "panonav/route/firmware_header.hpp"

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <vector>

namespace panonav {

namespace {

// Appends an array with as many values a line as 80 characters hold.
template <class Value>
void append_array(std::string& text, std::string_view name, std::span<const Value> values) {
  static_assert(std::is_unsigned_v<Value>);
  constexpr std::size_t per_line = sizeof(Value) == 1 ? 15 : 11;
  text += "static const uint" + std::to_string(8 * sizeof(Value)) + "_t ";
  text += name;
  text += "[" + std::to_string(values.size()) + "] = {";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += i % per_line == 0 ? "\n    " : " ";
    text += std::to_string(values[i]) + ",";
  }
  text += "\n};\n";
}

}  // namespace

std::string format_firmware_header(const SnapshotChain& chain,
                                   std::span<const std::uint16_t> sampler_pixels) {
  const std::vector<std::uint8_t> packed = chain.pack();
  std::string text =
      "/* A chain of snapshots for panonav::read_chain, written by panonav export. */\n"
      "#pragma once\n\n#include <stdint.h>\n\n";
  append_array(text, "panonav_chain", std::span<const std::uint8_t>(packed));
  if (!sampler_pixels.empty()) {
    text += "\n/* The pixels of panonav::SnapshotSampler. */\n";
    append_array(text, "panonav_sampler", sampler_pixels);
  }
  return text;
}

}  // namespace panonav
