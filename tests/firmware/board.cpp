// A board for QEMU's mps2-an500 (Cortex-M7): pictures and odometry of a recorded flight come from
// the host by semihosting, velocities go to its console. A call of the heap ends the program.
#include "board.hpp"

#include <array>
#include <cstddef>
#include <cstring>

#include "drone.hpp"

extern "C" {
extern std::uint32_t stack_bottom;
extern std::uint32_t stack_top;
extern std::uint32_t data_begin;
extern std::uint32_t data_end;
extern std::uint32_t data_in_flash;
extern std::uint32_t bss_begin;
extern std::uint32_t bss_end;
extern void (*init_array_begin[])();
extern void (*init_array_end[])();
void start();
}

namespace {

constexpr int sys_open = 0x01;
constexpr int sys_write0 = 0x04;
constexpr int sys_read = 0x06;
constexpr int sys_exit_extended = 0x20;
constexpr std::uint32_t unused_stack = 0xA5A5A5A5;

int call_host(int operation, const void* argument) {
  register int r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

[[noreturn]] void exit_with(std::uint32_t code) {
  const std::uint32_t block[2] = {0x20026, code};  // ADP_Stopped_ApplicationExit
  for (;;) call_host(sys_exit_extended, block);
}

void print(const char* text) {
  call_host(sys_write0, text);
}

void print_hex(std::uint64_t value, int digits) {
  char text[18] = {};
  for (int i = 0; i < digits; ++i) {
    text[i] = "0123456789abcdef"[value >> (4 * (digits - 1 - i)) & 15U];
  }
  text[digits] = ' ';
  print(text);
}

void print_number(const char* name, std::uint32_t value) {
  char text[12] = {};
  int at = 10;
  do {
    text[--at] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value > 0);
  print(name);
  print(text + at);
  print("\n");
}

int flight = -1;  // the file of the flight

bool read_exactly(void* to, std::size_t bytes) {
  const std::uint32_t block[3] = {static_cast<std::uint32_t>(flight),
                                  reinterpret_cast<std::uint32_t>(to),
                                  static_cast<std::uint32_t>(bytes)};
  return call_host(sys_read, block) == 0;  // number of bytes that are missing
}

// Cycles of SysTick, which counts 25 MHz of the virtual clock: with -icount shift=0 an instruction
// takes a nanosecond.
volatile std::uint32_t* const systick = reinterpret_cast<volatile std::uint32_t*>(0xE000E010);
constexpr std::uint32_t systick_range = 0x1000000;
constexpr std::uint32_t instructions_per_tick = 40;

std::array<std::uint8_t, 4096> chain_bytes;
std::array<std::uint16_t, 3072> sampler_pixels;
std::size_t chain_size = 0;
std::size_t sampler_size = 0;
panonav::Pose2 pose;
std::uint32_t started_at = 0;
std::uint32_t max_ticks = 0;

void open_flight() {
  static const char name[] = "flight.bin";
  const std::uint32_t block[3] = {reinterpret_cast<std::uint32_t>(name), 1, sizeof(name) - 1};
  flight = call_host(sys_open, block);  // mode 1: "rb"
  std::uint32_t sizes[2] = {};
  if (flight < 0 || !read_exactly(sizes, sizeof(sizes)) || sizes[0] > chain_bytes.size() ||
      sizes[1] > sampler_pixels.size()) {
    print("there is no flight.bin of this version\n");
    exit_with(2);
  }
  chain_size = sizes[0];
  sampler_size = sizes[1];
  if (!read_exactly(chain_bytes.data(), chain_size) ||
      !read_exactly(sampler_pixels.data(), 2 * sampler_size)) {
    exit_with(2);
  }
}

}  // namespace

namespace board {

std::span<const std::uint8_t> chain() {
  return std::span(chain_bytes).first(chain_size);
}
std::span<const std::uint16_t> sampler() {
  return std::span(sampler_pixels).first(sampler_size);
}

bool capture(std::span<std::uint8_t> grey) {
  double numbers[3] = {};
  if (!read_exactly(numbers, sizeof(numbers)) || !read_exactly(grey.data(), grey.size())) {
    return false;
  }
  pose = {numbers[0], numbers[1], numbers[2]};
  started_at = systick[2];
  return true;
}

panonav::Pose2 odometry() {
  return pose;
}

void set_velocity(const panonav::Velocity& drive) {
  const std::uint32_t ticks = (started_at - systick[2]) % systick_range;  // counts down
  if (ticks > max_ticks) max_ticks = ticks;
  for (const double value : {drive.forward_m_s, drive.left_m_s, drive.turn_rad_s}) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    print_hex(bits, 16);
  }
  print("\n");
}

}  // namespace board

// The firmware has no heap and nothing that is destroyed at its end.
void* operator new(std::size_t) {
  print("the heap was used\n");
  exit_with(3);
}
void* operator new[](std::size_t) {
  print("the heap was used\n");
  exit_with(3);
}
void operator delete(void*) noexcept {}
void operator delete[](void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}
void operator delete[](void*, std::size_t) noexcept {}
extern "C" int __aeabi_atexit(void*, void (*)(void*), void*) {
  return 0;
}
extern "C" [[noreturn]] void abort() {
  print("abort\n");
  exit_with(4);
}
extern "C" void start() {
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xFU << 20U;  // enables the FPU
  asm volatile("dsb\nisb");
  const auto words = [](std::uint32_t& from, std::uint32_t& to) {
    return static_cast<std::size_t>(&to - &from);
  };
  std::memcpy(&data_begin, &data_in_flash, 4 * words(data_begin, data_end));
  std::memset(&bss_begin, 0, 4 * words(bss_begin, bss_end));
  auto* const here = static_cast<std::uint32_t*>(__builtin_frame_address(0)) - 64;
  for (std::uint32_t* word = &stack_bottom; word < here; ++word) *word = unused_stack;
  for (void (**function)() = init_array_begin; function < init_array_end; ++function) (*function)();
  systick[1] = systick_range - 1;
  systick[2] = 0;
  systick[0] = 5;  // on, by the processor's clock
  open_flight();
  const panonav::ChainState state = fly_back();
  const std::uint32_t* word = &stack_bottom;
  while (word < &stack_top && *word == unused_stack) ++word;
  print_number("state ", static_cast<std::uint32_t>(state));
  print_number("stack ", 4 * static_cast<std::uint32_t>(&stack_top - word));
  print_number("instructions ", instructions_per_tick * max_ticks);
  exit_with(0);
}

[[noreturn]] static void stop_on_fault() {
  print("fault\n");
  exit_with(5);
}

extern "C" {
__attribute__((section(".vectors"), used)) void* const vectors[] = {
    &stack_top,
    reinterpret_cast<void*>(start),
    reinterpret_cast<void*>(stop_on_fault),
    reinterpret_cast<void*>(stop_on_fault),
    reinterpret_cast<void*>(stop_on_fault),
    reinterpret_cast<void*>(stop_on_fault),
    reinterpret_cast<void*>(stop_on_fault),
};
}
