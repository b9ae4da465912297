#include "panonav/kernels/column_match.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

namespace {

constexpr auto query_size = static_cast<std::size_t>(matched_query_columns * matched_bands);
constexpr auto reference_size = static_cast<std::size_t>(matched_reference_columns * matched_bands);

}  // namespace

int match_columns(std::span<const std::uint8_t> query, std::span<const std::uint8_t> reference,
                  std::span<std::uint16_t> costs, Instructions instructions) {
  require(query.size() == query_size, "bytes of the query's columns",
          static_cast<double>(query.size()), "512");
  require(reference.size() == reference_size, "bytes of the reference's columns",
          static_cast<double>(reference.size()), "2048");
  require(costs.size() == static_cast<std::size_t>(matched_reference_columns), "turns",
          static_cast<double>(costs.size()), "128");
  return with_body<ColumnMatchBody>(instructions, [&](auto body) {
    return body.match_columns(query.data(), reference.data(), costs.data());
  });
}

void column_sums_near_turn(std::span<const std::uint8_t> query,
                           std::span<const std::uint8_t> reference, int turn,
                           std::span<std::uint16_t> sums, Instructions instructions) {
  require(query.size() == reference_size, "bytes of the query's columns",
          static_cast<double>(query.size()), "2048");
  require(reference.size() == reference_size, "bytes of the reference's columns",
          static_cast<double>(reference.size()), "2048");
  require(sums.size() == static_cast<std::size_t>(matched_query_columns), "sums",
          static_cast<double>(sums.size()), "32");
  require(turn >= 0 && turn < matched_reference_columns, "turn", turn, "0 to 127");
  with_body<ColumnMatchBody>(instructions, [&](auto body) {
    body.column_sums_near_turn(query.data(), reference.data(), turn, sums.data());
  });
}

}  // namespace panonav::kernels
