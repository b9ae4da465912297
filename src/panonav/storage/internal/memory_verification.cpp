#include "panonav/storage/internal/memory_verification.hpp"

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/route_tables.hpp"

namespace panonav {

namespace {

// Runs parts of a check and collects their errors, so that no fault hides another.
class MemoryVerification {
 public:
  MemoryVerification(MemoryTables& tables, const MemoryHeader& header)
      : tables_(tables), header_(header) {}

  std::vector<MemoryFile::Fault> run() {
    const auto reading = tables_.transaction(MemoryTables::Kind::reading);
    const MemoryTables::Check check_part = [this](const auto& part) { check(part); };
    views_ = tables_.verify_structure(check_part);
    check([&] { static_cast<void>(to_header(tables_.settings())); });
    verify_views();
    for (const ViewAttachment table : {ViewAttachment::thumbnails, ViewAttachment::features}) {
      check([&] { verify_bytes(table); });
    }
    verify_links_and_maps(check_part);
    check([&] { verify_routes(tables_, check_part); });
    check([&] { static_cast<void>(tables_.history()); });
    // Adds the rows of a server that the functions above left out.
    for (const MemoryFile::Fault& fault : tables_.left_out()) {
      if (std::ranges::find(faults_, fault) == faults_.end()) faults_.push_back(fault);
    }
    return std::move(faults_);
  }

  std::vector<MemoryFile::Fault> run_for_links_and_maps() {
    const std::vector<ViewId> all = tables_.views();
    views_.insert(all.begin(), all.end());
    verify_links_and_maps([this](const auto& part) { check(part); });
    return std::move(faults_);
  }

 private:
  void verify_links_and_maps(const MemoryTables::Check& check_part) {
    check([&] { verify_links(); });
    const auto is_known = [&](ViewId view) { return views_.contains(view); };
    check([&] { verify_maps(tables_, is_known, check_part); });
  }

  void check(const std::function<void()>& part, std::optional<ViewId> view = std::nullopt) {
    try {
      part();
    } catch (const Error& error) {
      faults_.push_back({view, tables_.shorten_message(error.what())});
    }
  }

  void verify_views() {
    RecordBytes scratch;
    const auto verify_row = [&](const ViewRow& row) {
      tables_.check_row(row, header_.shape, scratch);
    };
    for (const ViewId view : views_) {
      check([&] { tables_.read_views(std::span(&view, 1), verify_row); }, view);
    }
  }

  void verify_bytes(ViewAttachment table) {
    const auto verify_entry = [&](ViewId view) {
      if (!views_.contains(view)) {
        tables_.fail_damaged(std::string("an entry of ") +
                             (table == ViewAttachment::thumbnails ? "thumbnails" : "features") +
                             " without a view");
      }
      static_cast<void>(tables_.read_checked_bytes(table, view));
    };
    for (const ViewId view : tables_.views_with_attachment(table)) {
      check([&] { verify_entry(view); }, view);
    }
  }

  void verify_links() {
    std::pair<ViewId, ViewId> before{};
    tables_.read_links([&](const LinkRow& row) {
      const std::pair ends(row.a, row.b);
      if (ends <= std::exchange(before, ends)) tables_.fail_damaged("links are out of order");
      check([&] {
        const Link link = tables_.check_row(row);
        if (!views_.contains(link.a) || !views_.contains(link.b))
          tables_.fail_link_without_view(link);
      });
    });
  }

  MemoryTables& tables_;
  const MemoryHeader& header_;
  std::set<ViewId> views_;
  std::vector<MemoryFile::Fault> faults_;
};

}  // namespace

std::vector<MemoryFile::Fault> verify_links_and_maps(MemoryTables& tables,
                                                     const MemoryHeader& header) {
  return MemoryVerification(tables, header).run_for_links_and_maps();
}

std::vector<MemoryFile::Fault> verify_memory(MemoryTables& tables, const MemoryHeader& header) {
  return MemoryVerification(tables, header).run();
}

void undo_newest_change(MemoryTables& tables, const MemoryHeader& header) {
  const auto kept = tables.history();
  if (kept.empty() || !kept.front().undoable) {
    throw ContractError("undo", "not possible", "after a change that was kept for it");
  }
  const auto faults = verify_links_and_maps(tables, header);
  tables.undo();
  for (const MemoryFile::Fault& fault : verify_links_and_maps(tables, header)) {
    if (std::ranges::find(faults, fault) != faults.end()) continue;
    throw FileError(tables.path().string(), "cannot undo \"" + kept.front().what +
                                                "\": the memory would be damaged: " + fault.what);
  }
}

}  // namespace panonav
