#pragma once

#include <cstdint>
#include <span>
#include <string>

struct ddsi_serdata;
struct ddsi_sertype;

namespace panonav::ros2 {

/// A type of this name without a key, whose samples are opaque bytes of CDR: the readers and
/// writers of `ros_messages` serve files and the wire. A sample that is written with `dds_write` is
/// a `std::span<const std::uint8_t>`. Belongs to the topic that is made of it.
[[nodiscard]] ddsi_sertype* make_raw_type(const std::string& name);

/// Returns the bytes with their encapsulation header, as received.
[[nodiscard]] std::span<const std::uint8_t> bytes_of(const ddsi_serdata& sample);

}  // namespace panonav::ros2
