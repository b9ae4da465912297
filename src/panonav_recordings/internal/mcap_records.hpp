#pragma once

#include <cstdint>

namespace panonav::recordings {

/// The kinds of records of an MCAP file.
enum class McapRecord : std::uint8_t {
  header = 0x01,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};

}  // namespace panonav::recordings
