#pragma once

#include <cstdint>
#include <span>
#include <string>

struct ddsi_serdata;
struct ddsi_sertype;

namespace panonav::ros2 {

/// Makes a keyless DDS type of this name whose samples are opaque CDR bytes, because `ros_messages`
/// encodes and decodes them as for files. A sample passed to `dds_write` is a `std::span<const
/// std::uint8_t>`. The topic made from the type owns it.
[[nodiscard]] ddsi_sertype* make_raw_type(const std::string& name);

/// Returns the bytes of a sample as received, with their encapsulation header.
[[nodiscard]] std::span<const std::uint8_t> bytes_of(const ddsi_serdata& sample);

}  // namespace panonav::ros2
