// Declares the functions of a board that the firmware of a small robot calls; tests/firmware has a
// board for QEMU.
#pragma once

#include <cstdint>
#include <span>

#include "panonav/motion/velocity.hpp"

namespace board {

constexpr int width = 160;   // width of a picture in pixels
constexpr int height = 120;  // height of a picture in pixels

std::span<const std::uint8_t> chain();              // in flash memory: panonav export --firmware
std::span<const std::uint16_t> sampler();           // the same, with --camera
bool capture(std::span<std::uint8_t> grey);         // waits for a picture; false: switched off
panonav::Pose2 odometry();                          // at that picture
void set_velocity(const panonav::Velocity& drive);  // until the next one

}  // namespace board
