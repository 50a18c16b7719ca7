#pragma once
// Scalable Vector Graphics, written by hand: just what a scatter plot needs.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln::trade {

/// Text as it may stand between tags and in quoted attributes. Control characters, which XML forbids, are left out.
std::string escape_xml(std::string_view text);

using Attributes = std::vector<std::pair<std::string, std::string>>;

/// <name a="b">content</name>; content is markup already.
std::string element(const std::string& name, const Attributes&, const std::string& content = "");

/// A coordinate with two decimals at most.
std::string coordinate(double);

}  // namespace kiln::trade
