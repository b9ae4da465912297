#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// Bytes of rows, checksums and refusals, for memories in files and on servers.

/// Calls work(batch) for the rows in batches of at most `batch_size`, in order.
template <class Row, class Work>
void for_each_batch(const std::vector<Row>& rows, std::size_t batch_size, const Work& work) {
  for (std::size_t at = 0; at < rows.size(); at += batch_size) {
    work(std::span(rows).subspan(at, std::min(batch_size, rows.size() - at)));
  }
}

/// Replaces `bytes` by the magnitudes, followed by the phases.
void pack_signature(const PackedSignature& signature, std::vector<std::uint8_t>& bytes);
/// Sets `signature` from the bytes of `pack_signature`, 2 * shape.size() of them.
void unpack_signature(std::span<const std::uint8_t> bytes, SignatureShape shape,
                      PackedSignature& signature);

/// Computes the checksum over all fields of a view. `scratch` is a reused buffer, which saves an
/// allocation for each view.
[[nodiscard]] std::int64_t view_checksum(RecordBytes& scratch, ViewId id, const ReferenceInfo& info,
                                         std::span<const std::uint8_t> signature);
/// Computes the checksum of a thumbnail or of local features.
[[nodiscard]] std::int64_t attachment_checksum(ViewId view, std::span<const std::uint8_t> bytes);
[[nodiscard]] std::int64_t link_checksum(const Link& link);
[[nodiscard]] std::int64_t setting_checksum(std::string_view key, const SettingValue& value);
/// Computes the checksum of a change that can be undone and was made at `stamp_s`.
[[nodiscard]] std::int64_t undo_checksum(std::string_view what, double stamp_s,
                                         std::span<const std::uint8_t> changes);

/// Throws the ContractError for a view that is not in the memory.
[[noreturn]] void throw_unknown_view(ViewId view);

/// Throws the ContractError for a name that another `what` ("view", "route") of the memory already
/// has.
[[noreturn]] void throw_used_name(std::string_view what, std::string_view name,
                                  const std::filesystem::path& file);

/// Throws ContractError if a new name is empty, too long or has control characters.
void check_new_name(std::string_view what, std::string_view name);

/// Largest size of a change kept for undo, in bytes; SQLite's fields have at most 256 MiB.
inline constexpr std::int64_t max_undo_bytes = 200 << 20;

/// Throws FileError if a change would need more than `max_undo_bytes`.
void require_undo_bytes(const std::filesystem::path& file, std::int64_t bytes);

/// Throws FileError: the change `what` cannot be undone, since rows of `table` have changed since.
[[noreturn]] void throw_undo_conflict(const std::filesystem::path& file, std::string_view what,
                                      std::string_view table);

}  // namespace panonav
