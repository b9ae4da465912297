#include "panonav/storage/internal/memory_tables.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/reference_validation.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

ViewId MemoryTables::to_view_id(std::int64_t number) const {
  if (number < 1 || number > std::int64_t{UINT32_MAX}) fail_damaged("a view id is out of range");
  return {static_cast<std::uint32_t>(number)};
}

Link MemoryTables::check_row(const LinkRow& row) const {
  Link link{row.a, row.b, Link::Kind::sequence};
  if (row.kind < 0 || row.kind > static_cast<int>(Link::Kind::closure)) {
    fail_damaged("a link of unknown kind");
  }
  if (link.b <= link.a) {
    fail_damaged("a link of views " + std::to_string(link.a.value) + " and " +
                 std::to_string(link.b.value) + "; allowed: the smaller id first");
  }
  link.kind = static_cast<Link::Kind>(row.kind);
  if (row.checksum != link_checksum(link)) {
    fail_damaged("the link of views " + std::to_string(link.a.value) + " and " +
                 std::to_string(link.b.value) + " does not match its checksum");
  }
  return link;
}

const ViewRow& MemoryTables::check_row(const ViewRow& row, SignatureShape shape,
                                       RecordBytes& scratch) const {
  if (row.signature.size() != 2 * shape.size() ||
      row.checksum != view_checksum(scratch, row.id, row.info, row.signature)) {
    fail_damaged("view " + std::to_string(row.id.value) + " does not match its checksum");
  }
  check_info(row.id, row.info);
  return row;
}

void MemoryTables::check_info(ViewId view, const ReferenceInfo& info) const {
  try {
    validate(info);
  } catch (const ContractError& error) {
    fail_damaged("view " + std::to_string(view.value) + ": " + error.what());
  }
}

void MemoryTables::fail_damaged(std::string_view what) const {
  throw DamageError(message_path().string(), "is damaged: " + std::string(what));
}

void MemoryTables::fail_link_without_view(const Link& link) const {
  fail_damaged("a link of views " + std::to_string(link.a.value) + " and " +
               std::to_string(link.b.value) + ", of which one is missing");
}

std::string MemoryTables::shorten_message(std::string_view message) const {
  std::string what(message);
  for (const std::string& prefix : {message_path().string() + ": ", std::string("is damaged: ")}) {
    if (what.starts_with(prefix)) what.erase(0, prefix.size());
  }
  return what;
}

void MemoryTables::record_skipped_row(std::optional<ViewId> view, std::string_view what) {
  constexpr std::size_t max_reported = 10;  // chosen: one screen, however many rows are bad
  MemoryFile::Fault fault{view, shorten_message(what)};
  if (std::ranges::find(left_out_, fault) != left_out_.end()) return;
  if (view) left_out_views_.insert(*view);
  if (left_out_.size() < max_reported) {
    report_skipped_row(message_path(), fault);
  } else if (left_out_.size() == max_reported) {
    report_skipped_row(message_path(),
                       {std::nullopt, "there are more bad rows (`panonav verify` lists them)"});
  }
  if (left_out_.size() < max_left_out) left_out_.push_back(std::move(fault));
}

std::optional<std::vector<std::uint8_t>> MemoryTables::read_checked_bytes(ViewAttachment table,
                                                                          ViewId view) {
  require_views(std::span(&view, 1));
  auto stored = bytes(table, view);
  if (!stored) return std::nullopt;
  check_attachment(table, view, *stored);
  return std::move(stored->bytes);
}

void MemoryTables::check_attachment(ViewAttachment table, ViewId view,
                                    const StoredBytes& stored) const {
  if (stored.checksum == attachment_checksum(view, stored.bytes)) return;
  fail_damaged(table == ViewAttachment::thumbnails
                   ? "the thumbnail of view " + std::to_string(view.value) +
                         " does not match its checksum"
                   : "the local features of view " + std::to_string(view.value) +
                         " do not match their checksum");
}

MemoryFile::Counts MemoryTables::counts() {
  const MemoryFile::Info all = info();
  return {all.views, all.views_with_position, all.views_with_heading, all.file_bytes};
}

}  // namespace panonav
