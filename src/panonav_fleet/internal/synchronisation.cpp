#include "panonav_fleet/internal/synchronisation.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav::fleet {

namespace {

void require_comparable(const MemoryHeader& file, const MemoryHeader& server,
                        const std::filesystem::path& path) {
  const auto require_same = [&](const char* what, bool same) {
    if (same) return;
    throw ContractError(std::string(what) + " of the file", "another",
                        "that of " + path.string() +
                            ", because views that were made with other settings cannot be "
                            "compared; a file that is made by synchronising has it");
  };
  require_same("rows and components", file.shape == server.shape);
  require_same("full scale", file.full_scale == server.full_scale);
  require_same("elevations of the rows", file.elevations == server.elevations);
  require_same("number of columns", file.panorama_columns == server.panorama_columns);
  require_same("preprocessing", file.preprocessing == server.preprocessing);
}

}  // namespace

Synchronisation::Synchronisation(SqliteTables& file, MemoryHeader header, ServerExchange& server,
                                 const SynchronisationOptions& options,
                                 const std::function<void(std::size_t)>& advance)
    : file_(file), header_(std::move(header)), server_(server), advance_(advance) {
  if (!options.areas) return;
  const std::set<MemoryArea> areas(options.areas->begin(), options.areas->end());
  for (const MemoryArea& area : areas) {
    constexpr double largest = 1e15;  // whole numbers below it are exact
    for (const double value : {area.column, area.row}) {
      require(std::abs(value) <= largest && value == std::floor(value), "column or row of an area",
              value, "whole numbers up to 1e15");
    }
  }
  areas_.emplace(areas.begin(), areas.end());
}

SynchronisationReport Synchronisation::run() {
  match_with_server();
  constexpr int max_rounds = 2;  // the second uploads what a restored server had lost
  for (int round = 0; round < max_rounds; ++round) {
    needs_reupload_ = false;
    load_file_state();
    resolve_unacknowledged_uploads();
    prepare_upload();
    if (server_.can_add()) {
      upload_views();
      upload_changes();
      upload_removals();
      upload_links();
    }
    download();
    if (!needs_reupload_ || !server_.can_add()) break;
  }
  return report_;
}

void Synchronisation::match_with_server() {
  stored_state_ = state_ = read_synchronised_state(file_);
  const ServerExchange::State there = server_.read_state();
  if (state_.memory.empty()) {
    const auto reading = server_.tables().transaction(Kind::reading);
    require_comparable(header_, to_header(server_.tables().settings()), server_.tables().path());
  } else if (state_.memory != there.identity) {
    throw FileError(file_.path().string(),
                    "was synchronised with a memory other than " +
                        server_.tables().path().string() +
                        " is now; allowed: the same memory, or a copy of the file (panonav copy), "
                        "which is not yet synchronised");
  }
  if (state_.file.empty()) state_.file = make_random_identity(file_);
  state_.memory = there.identity;
  upload_number_ = make_random_number(file_);
  is_server_older_ = there.last_view < state_.last_view;
}

void Synchronisation::load_file_state() {
  const auto reading = file_.transaction(Kind::reading);
  synchronised_ = read_synchronised_views(file_);
  stored_links_ = links_ = read_synchronised_links(file_);
  local_checksums_ = read_view_checksums(file_);
  local_by_server_id_.clear();
  for (const auto& [view, row] : synchronised_) {
    if (row.server_view) local_by_server_id_[*row.server_view] = view;
  }
  unsaved_.clear();
}

void Synchronisation::set_row(ViewId view, const SynchronisedView& row) {
  synchronised_[view] = row;
  if (row.server_view) local_by_server_id_[*row.server_view] = view;
  unsaved_.insert(view);
}

void Synchronisation::drop_row(ViewId view) {
  const auto found = synchronised_.find(view);
  if (found == synchronised_.end()) return;
  if (found->second.server_view) local_by_server_id_.erase(*found->second.server_view);
  synchronised_.erase(found);
  unsaved_.insert(view);
}

bool Synchronisation::is_stored() const {
  return unsaved_.empty() && links_ == stored_links_ && state_ == stored_state_;
}

void Synchronisation::store_and_commit(MemoryTables::Transaction& writing) {
  state_.number = make_random_number(file_);
  write_synchronised_state(file_, state_);
  for (const ViewId view : std::exchange(unsaved_, {})) {
    const auto found = synchronised_.find(view);
    if (found == synchronised_.end()) {
      erase_synchronised_view(file_, view);
    } else {
      write_synchronised_view(file_, view, found->second);
    }
  }
  for (const auto& [ends, kind] : links_) {
    const auto stored = stored_links_.find(ends);
    if (stored != stored_links_.end() && stored->second == kind) continue;
    write_synchronised_link(file_, {ends.first, ends.second, kind});
  }
  for (const auto& [ends, kind] : stored_links_) {
    if (!links_.contains(ends)) erase_synchronised_link(file_, ends.first, ends.second);
  }
  writing.commit();
  stored_links_ = links_;
  stored_state_ = state_;
}

std::unique_ptr<MemoryTables::Transaction> Synchronisation::begin_file_change() {
  auto writing = file_.transaction(Kind::writing);
  if (read_synchronised_state(file_).number != stored_state_.number) {
    throw FileError(file_.path().string(), "is being synchronised by another program, too");
  }
  local_checksums_ = read_view_checksums(file_);
  return writing;
}

std::optional<Synchronisation::LocalRow> Synchronisation::read_local_row(ViewId view) {
  if (!local_checksums_.contains(view)) return std::nullopt;
  LocalRow read;
  file_.read_views(std::span(&view, 1), [&](const ViewRow& found) {
    const ViewRow& row = file_.check_row(found, header_.shape, scratch_);
    read = {row.info, row.checksum, Bytes(row.signature.begin(), row.signature.end())};
  });
  return read;
}

void Synchronisation::write_local_info(ViewId view, const ReferenceInfo& info,
                                       const Bytes& signature) {
  const std::int64_t checksum = view_checksum(scratch_, view, info, signature);
  file_.write_info(view, info, checksum);
  local_checksums_[view] = checksum;
}

void Synchronisation::clear_recordings() {
  const std::string key = "parameter." + std::string(recordings_parameter);
  const Settings settings = file_.settings();
  if (settings.contains(key)) file_.write_setting(key, std::string());
}

std::string Synchronisation::robot_prefixed_name(const std::string& name, int count) const {
  return add_prefix_on_floor(server_.robot() + "/", name) +
         (count == 1 ? std::string() : " (" + std::to_string(count) + ")");
}

std::uint32_t Synchronisation::read_last_view_id() {
  const ServerExchange::State there = server_.read_state();
  if (there.identity != state_.memory) {
    throw FileError(server_.tables().path().string(),
                    "was replaced by another memory in the meantime");
  }
  if (there.last_view < 0 || there.last_view >= std::int64_t{UINT32_MAX}) {
    server_.tables().fail_damaged("the last view id is out of range");
  }
  return static_cast<std::uint32_t>(there.last_view);
}

SynchronisedLinks Synchronisation::read_local_links() {
  SynchronisedLinks links;
  file_.read_links([&](const LinkRow& row) {
    const Link link = file_.check_row(row);
    const auto a = synchronised_.find(link.a);
    const auto b = synchronised_.find(link.b);
    if (a == synchronised_.end() || b == synchronised_.end()) return;
    if (!a->second.server_view || !b->second.server_view) return;
    links[std::minmax(*a->second.server_view, *b->second.server_view)] = link.kind;
  });
  return links;
}

bool Synchronisation::is_in_file(ViewId server_view) const {
  const auto found = local_by_server_id_.find(server_view);
  return found != local_by_server_id_.end() && local_checksums_.contains(found->second);
}

void Synchronisation::forget_server_view(ViewId server_view) {
  drop_row(local_by_server_id_.at(server_view));
  std::erase_if(links_, [&](const auto& link) {
    return link.first.first == server_view || link.first.second == server_view;
  });
}

}  // namespace panonav::fleet
