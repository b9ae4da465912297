#pragma once

// Parts of the standard library that emscripten 3.1's libc++ lacks, included before each source
// (preset `web`): algorithms of std::ranges, texts of floating-point numbers, renameat2.

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}
template <class Numbers>
unique_ptr<Numbers> make_unique_for_overwrite(size_t count) {
  return unique_ptr<Numbers>(new remove_extent_t<Numbers>[count]);
}

namespace ranges {

template <class Part>
concept Whole = requires(Part& part) {
  std::begin(part);
};

template <class Order, class Key>
auto by(Order& order, Key& key) {
  return [&](auto&& a, auto&& b) -> bool {
    return std::invoke(order, std::invoke(key, a), std::invoke(key, b));
  };
}
template <class Test, class Key>
auto of(Test& test, Key& key) {
  return [&](auto&& a) -> bool { return std::invoke(test, std::invoke(key, a)); };
}

// Each algorithm for a range and for two iterators: with an order, with a test, with a value.
#define PANONAV_ORDERED(name)                                                \
  template <Whole R, class O = std::less<>, class K = std::identity>         \
  auto name(R&& range, O order = {}, K key = {}) {                           \
    return std::name(std::begin(range), std::end(range), by(order, key));    \
  }                                                                          \
  template <class I, class O = std::less<>, class K = std::identity>         \
  requires(!Whole<I>) auto name(I first, I last, O order = {}, K key = {}) { \
    return std::name(first, last, by(order, key));                           \
  }
#define PANONAV_ORDERED_TO(name)                                                       \
  template <Whole R, class I, class O = std::less<>, class K = std::identity>          \
  void name(R&& range, I middle, O order = {}, K key = {}) {                           \
    std::name(std::begin(range), middle, std::end(range), by(order, key));             \
  }                                                                                    \
  template <class I, class O = std::less<>, class K = std::identity>                   \
  requires(!Whole<I>) void name(I first, I middle, I last, O order = {}, K key = {}) { \
    std::name(first, middle, last, by(order, key));                                    \
  }
#define PANONAV_TESTED(name)                                             \
  template <Whole R, class T, class K = std::identity>                   \
  auto name(R&& range, T test, K key = {}) {                             \
    return std::name(std::begin(range), std::end(range), of(test, key)); \
  }                                                                      \
  template <class I, class T, class K = std::identity>                   \
  requires(!Whole<I>) auto name(I first, I last, T test, K key = {}) {   \
    return std::name(first, last, of(test, key));                        \
  }
// clang-format off
PANONAV_ORDERED(sort) PANONAV_ORDERED(stable_sort) PANONAV_ORDERED(max_element) PANONAV_ORDERED(min_element)
PANONAV_ORDERED(push_heap) PANONAV_ORDERED(pop_heap) PANONAV_ORDERED(sort_heap)
PANONAV_ORDERED_TO(nth_element) PANONAV_ORDERED_TO(partial_sort)
PANONAV_TESTED(any_of) PANONAV_TESTED(all_of) PANONAV_TESTED(none_of) PANONAV_TESTED(count_if) PANONAV_TESTED(find_if)
    // clang-format on

    template <Whole R, class V, class K = std::identity>
    auto find(R&& range, const V& value, K key = {}) {
  return std::find_if(std::begin(range), std::end(range),
                      [&](auto&& a) -> bool { return std::invoke(key, a) == value; });
}
template <class I, class V, class K = std::identity>
requires(!Whole<I>) auto find(I first, I last, const V& value, K key = {}) {
  return std::find_if(first, last, [&](auto&& a) -> bool { return std::invoke(key, a) == value; });
}
template <Whole R, class V, class K = std::identity>
auto count(R&& range, const V& value, K key = {}) {
  return std::count_if(std::begin(range), std::end(range),
                       [&](auto&& a) -> bool { return std::invoke(key, a) == value; });
}
template <Whole R, class V, class O = std::less<>, class K = std::identity>
auto lower_bound(R&& range, const V& value, O order = {}, K key = {}) {
  return std::lower_bound(
      std::begin(range), std::end(range), value,
      [&](auto&& a, auto&& v) -> bool { return std::invoke(order, std::invoke(key, a), v); });
}
template <class I, class V, class O = std::less<>, class K = std::identity>
requires(!Whole<I>) auto lower_bound(I first, I last, const V& value, O order = {}, K key = {}) {
  return std::lower_bound(first, last, value, [&](auto&& a, auto&& v) -> bool {
    return std::invoke(order, std::invoke(key, a), v);
  });
}
template <Whole R, class V, class O = std::less<>, class K = std::identity>
auto upper_bound(R&& range, const V& value, O order = {}, K key = {}) {
  return std::upper_bound(
      std::begin(range), std::end(range), value,
      [&](auto&& v, auto&& a) -> bool { return std::invoke(order, v, std::invoke(key, a)); });
}
template <class I, class V, class O = std::less<>, class K = std::identity>
requires(!Whole<I>) auto upper_bound(I first, I last, const V& value, O order = {}, K key = {}) {
  return std::upper_bound(first, last, value, [&](auto&& v, auto&& a) -> bool {
    return std::invoke(order, v, std::invoke(key, a));
  });
}
template <Whole R, class V, class O = std::less<>, class K = std::identity>
bool binary_search(R&& range, const V& value, O order = {}, K key = {}) {
  const auto at = ranges::lower_bound(range, value, order, key);
  return at != std::end(range) && !std::invoke(order, value, std::invoke(key, *at));
}
template <Whole R, class E = std::equal_to<>, class K = std::identity>
auto adjacent_find(R&& range, E equal = {}, K key = {}) {
  return std::adjacent_find(std::begin(range), std::end(range), by(equal, key));
}
template <Whole R, class O = std::less<>, class K = std::identity>
auto max(R&& range, O order = {}, K key = {}) {
  return *ranges::max_element(range, order, key);
}
template <Whole R, class O = std::less<>, class K = std::identity>
auto min(R&& range, O order = {}, K key = {}) {
  return *ranges::min_element(range, order, key);
}
template <Whole R>
auto minmax(R&& range) {
  return std::pair(ranges::min(range), ranges::max(range));
}
template <Whole A, Whole B, class E = std::equal_to<>>
bool equal(A&& a, B&& b, E equal = {}) {
  return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b), equal);
}
template <class Out>
struct Written {
  Out out;
};
template <Whole R, class Out>
Written<Out> copy(R&& range, Out out) {
  return {std::copy(std::begin(range), std::end(range), out)};
}
template <class I, class Out>
requires(!Whole<I>) Written<Out> copy(I first, I last, Out out) {
  return {std::copy(first, last, out)};
}
template <Whole R, class Out, class T>
void copy_if(R&& range, Out out, T test) {
  std::copy_if(std::begin(range), std::end(range), out,
               [&](auto&& a) -> bool { return std::invoke(test, a); });
}
template <Whole R, class Out>
void move(R&& range, Out out) {
  std::move(std::begin(range), std::end(range), out);
}
template <Whole R, class Out, class F>
void transform(R&& range, Out out, F function) {
  std::transform(std::begin(range), std::end(range), out,
                 [&](auto&& a) { return std::invoke(function, a); });
}
template <Whole R, class V>
void fill(R&& range, const V& value) {
  std::fill(std::begin(range), std::end(range), value);
}
template <Whole R, class V>
void replace(R&& range, const V& from, const V& to) {
  std::replace(std::begin(range), std::end(range), from, to);
}
template <Whole R>
void reverse(R&& range) {
  std::reverse(std::begin(range), std::end(range));
}
#define PANONAV_OF_SETS(name)                                               \
  template <Whole A, Whole B, class Out>                                    \
  void name(A&& a, B&& b, Out out) {                                        \
    std::name(std::begin(a), std::end(a), std::begin(b), std::end(b), out); \
  }
PANONAV_OF_SETS(set_union)
PANONAV_OF_SETS(set_intersection)
PANONAV_OF_SETS(set_difference)

}  // namespace ranges

// Texts of `double`; the C library's numbers are exact, too.
inline to_chars_result write_text(char* first, char* last, const std::string& text) {
  if (last - first < static_cast<std::ptrdiff_t>(text.size())) return {last, errc::value_too_large};
  return {std::copy(text.begin(), text.end(), first), errc()};
}
inline std::string print_number(const char* form, int precision, double value) {
  char text[1200];
  return {text, static_cast<std::size_t>(std::snprintf(text, sizeof text, form, precision, value))};
}
inline to_chars_result to_chars(char* first, char* last, double value, chars_format form,
                                int precision) {
  return write_text(first, last,
                    print_number(form == chars_format::fixed ? "%.*f" : "%.*g", precision, value));
}
/// Hexadecimal; no other form is used without a precision.
inline to_chars_result to_chars(char* first, char* last, double value, chars_format /*hex*/) {
  char text[40];
  std::snprintf(text, sizeof text, "%a", value);
  return write_text(first, last, value - value == 0.0 ? text + 2 : text);
}
/// The shortest text that is read as the same number; of equal ones that without an exponent.
inline to_chars_result to_chars(char* first, char* last, double value) {
  std::string text = print_number("%.*g", 17, value);
  for (int digits = 0; value - value == 0.0 && digits < 17; ++digits) {
    const std::string scientific = print_number("%.*e", digits, value);
    if (std::strtod(scientific.c_str(), nullptr) != value) continue;
    const int exponent = std::atoi(scientific.c_str() + scientific.find('e') + 1);
    text = print_number("%.*f", std::max(0, digits - exponent), value);
    if (scientific.size() < text.size()) text = scientific;
    break;
  }
  return write_text(first, last, text);
}
inline from_chars_result from_chars(const char* first, const char* last, double& value,
                                    chars_format form = chars_format::general) {
  if (first == last || *first == '+' || std::isspace(static_cast<unsigned char>(*first)) != 0) {
    return {first, errc::invalid_argument};
  }
  const bool is_hex = form == chars_format::hex;
  std::string text(first, last);
  if (is_hex) text.insert(0, "0x");
  text.resize(std::min(text.size(), text.find_first_of(is_hex ? "sS" : "xX")));
  char* end = nullptr;
  const double read = std::strtod(text.c_str(), &end);
  const auto length = end - text.c_str() - (is_hex ? 2 : 0);
  if (length <= 0) return {first, errc::invalid_argument};
  if (std::abs(read) == HUGE_VAL && text.find_first_of("iI") == text.npos) {
    return {first + length, errc::result_out_of_range};
  }
  value = read;
  return {first + length, errc()};
}

}  // namespace std

// Renames without replacing, in the file system of one program.
#define RENAME_NOREPLACE 1
inline int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                     unsigned /*flags*/) {
  if (::faccessat(to_folder, to, F_OK, 0) == 0) {
    errno = EEXIST;
    return -1;
  }
  return ::renameat(from_folder, from, to_folder, to);
}
