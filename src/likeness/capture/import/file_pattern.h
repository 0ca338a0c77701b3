// Files named by a pattern such as 'takes/{segment}/cam{camera}/{frame}.png', found on disk.

#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "likeness/capture/capture.h"

namespace likeness {

// What a pattern's parts were for one file. Parts that the pattern lacks are "".
struct PatternParts {
  std::string segment, camera, frame;
  auto operator<=>(const PatternParts&) const = default;
};

// Finds the files that a pattern names. {segment}, {camera} and {frame} each stand for one or more characters of a
// path's part, and for the same ones where they occur twice; of several ways to match, earlier parts are as short as
// can be. Throws Error for unknown words in braces, for no match, for two files with the same parts, and for parts that
// cannot be names in a capture.
std::map<PatternParts, std::filesystem::path> FindFiles(const std::string& pattern);

}  // namespace likeness
