#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

namespace panonav {

/// Finds rows by their unique names. Holds no names but 8 bytes a slot: an open hash table of row
/// numbers and hashes, which reads a name only if its hash is equal. `NameOf` returns the name of a
/// row.
class NameIndex {
 public:
  using Row = std::uint32_t;

  /// Starts to load the slot of a name, which is found soon.
  void prefetch(std::string_view name) const noexcept {
    if (!slots_.empty()) __builtin_prefetch(&slots_[hash_name(name) & (slots_.size() - 1)]);
  }
  template <class NameOf>
  [[nodiscard]] std::optional<Row> find(std::string_view name, const NameOf& name_of) const {
    if (slots_.empty()) return std::nullopt;
    const Slot& slot = slots_[find_slot(name, name_of)];
    if (slot.row == no_row) return std::nullopt;
    return slot.row;
  }
  /// Adds a row. The caller guarantees that no row has its name.
  void insert(std::string_view name, Row row) {
    if (2 * (rows_ + 1) > slots_.size()) grow();
    ++rows_;
    place({hash_name(name), row});
  }
  /// Removes the row of that name, which exists.
  template <class NameOf>
  void erase(std::string_view name, const NameOf& name_of) {
    std::size_t hole = find_slot(name, name_of);
    --rows_;
    // Moves later rows of the same chain forward, so that no search ends at the hole.
    for (std::size_t next = successor(hole); slots_[next].row != no_row; next = successor(next)) {
      const std::size_t home = slots_[next].hash & (slots_.size() - 1);
      const bool stays = hole <= next ? hole < home && home <= next : hole < home || home <= next;
      if (stays) continue;
      slots_[hole] = slots_[next];
      hole = next;
    }
    slots_[hole] = {};
  }

 private:
  static constexpr Row no_row = 0xFFFFFFFF;
  struct Slot {
    std::uint32_t hash = 0;
    Row row = no_row;
  };

  static std::uint32_t hash_name(std::string_view name) noexcept {
    return static_cast<std::uint32_t>(std::hash<std::string_view>{}(name));
  }
  [[nodiscard]] std::size_t successor(std::size_t slot) const noexcept {
    return (slot + 1) & (slots_.size() - 1);
  }
  /// Returns the slot of the name, or the free one at the end of its chain.
  template <class NameOf>
  [[nodiscard]] std::size_t find_slot(std::string_view name, const NameOf& name_of) const {
    const std::uint32_t hash = hash_name(name);
    std::size_t slot = hash & (slots_.size() - 1);
    while (slots_[slot].row != no_row &&
           (slots_[slot].hash != hash || name_of(slots_[slot].row) != name)) {
      slot = successor(slot);
    }
    return slot;
  }
  void place(Slot added) {
    std::size_t slot = added.hash & (slots_.size() - 1);
    while (slots_[slot].row != no_row) slot = successor(slot);
    slots_[slot] = added;
  }
  void grow() {
    constexpr std::size_t min_slots = 16;
    std::vector<Slot> before(slots_.empty() ? min_slots : 2 * slots_.size());
    before.swap(slots_);
    for (const Slot& slot : before) {
      if (slot.row != no_row) place(slot);
    }
  }

  std::vector<Slot> slots_;  // a power of two of them, at least twice as many as rows; or none
  std::size_t rows_ = 0;
};

}  // namespace panonav
