#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::testing {

/// A drawing of a page: "plan", "chart" or "run", and its data.
struct PagePanel {
  std::string name;
  nlohmann::json data;
};
inline std::vector<PagePanel> panels_of(const std::string& page) {
  std::vector<PagePanel> panels;
  const std::string begin = "><script type=\"application/json\">";
  for (std::size_t at = page.find("<pn-"); at != std::string::npos; at = page.find("<pn-", at)) {
    const std::size_t data = page.find(begin, at);
    const std::size_t end = page.find("</script>", data);
    if (end == std::string::npos) break;
    const std::size_t name_end = page.find_first_of(" >", at);
    panels.push_back(
        {page.substr(at + 4, name_end - at - 4),
         nlohmann::json::parse(page.substr(data + begin.size(), end - data - begin.size()))});
    at = end;
  }
  return panels;
}
/// The titles of its plots, in order.
inline std::vector<std::string> plots_of(const std::string& page) {
  std::vector<std::string> titles;
  for (const PagePanel& panel : panels_of(page)) {
    if (panel.data.contains("title")) titles.push_back(panel.data["title"]);
  }
  return titles;
}

/// The page without the pictures in it. Expects that it needs nothing but itself.
inline std::string text_of_page(const std::string& page) {
  std::string text;
  constexpr std::string_view begin = ";base64,";
  for (std::size_t at = 0; at < page.size();) {
    const std::size_t picture = page.find(begin, at);
    text += page.substr(at, picture == std::string::npos ? picture : picture + begin.size() - at);
    if (picture == std::string::npos) break;
    at = page.find_first_of("\"'", picture);
  }
  EXPECT_NE(text.find("</html>"), std::string::npos);
  EXPECT_EQ(text.find("http"), std::string::npos) << "the page needs the network";
  EXPECT_EQ(text.find("nan"), std::string::npos);
  for (std::size_t at = text.find(" src="); at != std::string::npos; at = text.find(" src=", at)) {
    EXPECT_EQ(text.substr(at, 16), " src=\"data:image") << "the page needs other files";
    at += 5;
  }
  return text;
}
/// Pictures that are no plots.
inline std::size_t pictures_of(const std::string& page) {
  std::size_t count = 0;
  for (std::size_t at = page.find("<img "); at != std::string::npos;
       at = page.find("<img ", at + 1)) {
    ++count;
  }
  return count;
}

/// Decodes "data:TYPE;base64,...".
inline std::vector<std::uint8_t> bytes_of_url(std::string_view url) {
  constexpr std::string_view letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : url.substr(url.find(',') + 1)) {
    const std::size_t value = letters.find(c);
    if (value == std::string_view::npos) break;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> static_cast<unsigned>(count)));
  }
  return bytes;
}

}  // namespace panonav::testing
