#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.hpp"
#include "panonav/localisation/memory_update.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "runs/live_run.hpp"
#include "runs/recording.hpp"
#include "runs/run_record.hpp"

namespace panonav::command {

/// The arguments of `localise`.
struct LocaliseArguments {
  std::string memory;
  std::vector<std::string> inputs;
  PictureArguments pictures;
  LocaliserOptions localiser;
  LocalisationAccuracy accuracy;
  std::optional<std::uint64_t> turn_seed;
  bool exclude_same_file = false;
  bool areas = false;
  std::optional<std::string> out;
  std::optional<std::string> report;
  bool add = false;     ///< add views of places that are not in the memory
  bool update = false;  ///< update views of places that are in the memory
  std::optional<double> add_interval_s;
  std::optional<std::string> route;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
  MemoryUpdateOptions update_options;
  RunRecordArguments record;
  LiveArguments live;
};

/// Throws ContractError if more components are requested than the memory has, or explicitly 0.
void require_components(const Arguments& declared, const LocaliseArguments& arguments,
                        const MemoryHeader& header);

/// Opens a recording, or several single images; some of these may be missing.
[[nodiscard]] Dataset open_queries(const LocaliseArguments& arguments,
                                   const std::optional<PictureSource>& remembered,
                                   Session& session);

/// Localises images one after the other. Used for live sources and for runs that are recorded,
/// shown, added to the memory or followed along a route.
ExitCode localise_in_order(const Arguments& declared, const LocaliseArguments& arguments,
                           Session& session);

}  // namespace panonav::command
