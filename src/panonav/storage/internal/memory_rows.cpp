#include "panonav/storage/internal/memory_rows.hpp"

#include <algorithm>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/memory/reference_validation.hpp"

namespace panonav {

void pack_signature(const PackedSignature& signature, std::vector<std::uint8_t>& bytes) {
  bytes.assign(signature.magnitudes.begin(), signature.magnitudes.end());
  bytes.insert(bytes.end(), signature.phases.begin(), signature.phases.end());
}

void unpack_signature(std::span<const std::uint8_t> bytes, SignatureShape shape,
                      PackedSignature& signature) {
  const auto half = static_cast<std::ptrdiff_t>(shape.size());
  signature.shape = shape;
  signature.magnitudes.assign(bytes.begin(), bytes.begin() + half);
  signature.phases.assign(bytes.begin() + half, bytes.end());
}

// The short fields are hashed first, and their hash is the seed for the signature, which needs no
// copy.
std::int64_t view_checksum(RecordBytes& scratch, ViewId id, const ReferenceInfo& info,
                           std::span<const std::uint8_t> signature) {
  scratch.clear();
  scratch.add(std::int64_t{id.value});
  scratch.add(std::string_view(info.name));
  if (info.pose) {
    scratch.add(info.pose->x_m);
    scratch.add(info.pose->y_m);
    scratch.add(info.pose->heading_rad);
  } else {
    for (int i = 0; i < 3; ++i) scratch.add_null();
  }
  scratch.add(info.stamp_s);
  return static_cast<std::int64_t>(checksum(signature, checksum(scratch.bytes())));
}

std::int64_t attachment_checksum(ViewId view, std::span<const std::uint8_t> bytes) {
  RecordBytes record;
  record.add(std::int64_t{view.value});
  return static_cast<std::int64_t>(checksum(bytes, checksum(record.bytes())));
}

std::int64_t link_checksum(const Link& link) {
  RecordBytes record;
  record.add(std::int64_t{link.a.value});
  record.add(std::int64_t{link.b.value});
  record.add(std::int64_t{static_cast<int>(link.kind)});
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

std::int64_t setting_checksum(std::string_view key, const SettingValue& value) {
  RecordBytes record;
  record.add(key);
  std::visit([&](const auto& typed) { record.add(typed); }, value);
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

std::int64_t undo_checksum(std::string_view what, double stamp_s,
                           std::span<const std::uint8_t> changes) {
  RecordBytes record;
  record.add(what);
  record.add(stamp_s);
  return static_cast<std::int64_t>(checksum(changes, checksum(record.bytes())));
}

void throw_unknown_view(ViewId view) {
  throw ContractError("view", std::to_string(view.value), "a view of the memory file");
}

void throw_used_name(std::string_view what, std::string_view name,
                     const std::filesystem::path& file) {
  throw ContractError(std::string(what) + " name",
                      "\"" + std::string(name) + "\", which " + file.string() + " already contains",
                      "a name that is unique");
}

void check_new_name(std::string_view what, std::string_view name) {
  const bool control = std::ranges::any_of(
      name, [](char c) { return static_cast<unsigned char>(c) < 0x20U || c == 0x7F; });
  if (!name.empty() && !control && name.size() <= max_name_bytes) return;
  throw ContractError(std::string(what) + " name",
                      name.empty() ? "empty"
                      : control    ? "a text with control characters"
                                   : std::to_string(name.size()) + " bytes long",
                      "1 to " + std::to_string(max_name_bytes) + " bytes, no control characters");
}

void require_undo_bytes(const std::filesystem::path& file, std::int64_t bytes) {
  if (bytes <= max_undo_bytes) return;
  throw FileError(file.string(),
                  "would keep " + std::to_string(bytes) + " bytes to undo this; allowed: up to " +
                      std::to_string(max_undo_bytes) + "; remove fewer views at a time");
}

void throw_undo_conflict(const std::filesystem::path& file, std::string_view what,
                         std::string_view table) {
  std::string changed = std::string(table);  // a table whose name is a word for people
  if (table == "links") changed = "links between views";
  if (table == "maps") changed = "map";
  if (table.starts_with("route")) changed = "route";
  const std::string next =
      what.starts_with("scale ")
          ? "to correct the scale, run panonav scale again with the right length"
          : "first revert that later change; a newer view of a former name gets another by panonav "
            "rename";
  throw FileError(file.native(), "cannot undo \"" + std::string(what) +
                                     "\": a later change altered the same " + changed + "; " +
                                     next);
}

}  // namespace panonav
