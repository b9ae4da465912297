#include "panonav_simulation/internal/xml.hpp"

#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "support/text.hpp"

namespace panonav::simulation {
using namespace testing;
namespace {

TEST(Xml, ReadsElementsAttributesAndText) {
  const pugi::xml_document document = parse_xml(
      "\xEF\xBB\xBF\n<?xml version='1.0'?><!DOCTYPE a [<!ENTITY x 'y'>]><!-- a -- b --->"
      "<a one='1' two=\"&lt;&#65;&#x20AC;&amp; &no; &\"> x <b/><![CDATA[<y>]]><b n='2'>z</b> </a> "
      "rest");
  const pugi::xml_node root = document.document_element();
  EXPECT_STREQ(root.name(), "a");
  EXPECT_STREQ(root.attribute("two").value(), "<A\xE2\x82\xAC& &no; &");
  EXPECT_STREQ(root.attribute("three").value(), "");
  EXPECT_EQ(element_text(root), "x <y>");
  EXPECT_EQ(child_text(root, "one"), "1");
  EXPECT_EQ(child_text(root, "three"), "");
  EXPECT_EQ(child_text(root, "b"), "");
  const pugi::xml_node last = root.last_child().previous_sibling("b");
  EXPECT_EQ(element_text(root.last_child()), "z");
  EXPECT_EQ(child_text(root.last_child(), "n"), "2");
  EXPECT_EQ(last, root.child("b"));
}

TEST(Xml, WhatIsNoXmlIsRefusedWithItsLine) {
  std::string deep;
  for (int i = 0; i < 201; ++i) deep += "<a>";
  for (int i = 0; i < 201; ++i) deep += "</a>";
  std::string many = "<a>";
  for (int i = 0; i < 1000000; ++i) many += "<b/>";
  many += "</a>";
  const std::string mismatch = "Start-end tags mismatch";
  for (const auto& [text, message] :
       {std::pair<std::string, std::string>{"", "line 1: No document element found"},
        {"words", "No document element found"},
        {"\n\n<a>", "line 3: " + mismatch},
        {"<a></b>", mismatch},
        {"</a>", mismatch},
        {"<a b></a>", "Error parsing element attribute"},
        {"<a b=1></a>", "Error parsing element attribute"},
        {"<a b='1></a>", "Error parsing element attribute"},
        {"<a <b></b></a>", "Error parsing"},
        {"<a><!-- </a>", "Error parsing comment"},
        {"<>", "tag"},
        {"<", "tag"},
        {deep, "more than 200 deep"},
        {many, "more than 1000000 elements"}}) {
    EXPECT_TRUE(
        contains(message_of<Error>([&, &words = text] { (void)parse_xml(words); }), message))
        << text.substr(0, 40);
  }
}

TEST(Xml, NumbersAreFiniteAndAlone) {
  EXPECT_EQ(parse_numbers(" 1\t-2.5\n+3e1 "), (std::vector{1.0, -2.5, 30.0}));
  EXPECT_EQ(parse_numbers(""), std::vector<double>{});
  for (const char* text : {"nan", "1 inf", "1,2", "1 x", "+", "1e999", "0x10"})
    EXPECT_EQ(parse_numbers(text), std::nullopt) << text;
}

}  // namespace
}  // namespace panonav::simulation
