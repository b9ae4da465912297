#pragma once

#include "panonav/route/chain_pilot.hpp"

/// Flies until the robot has arrived or is lost, or its board is switched off.
panonav::ChainState fly_back();
