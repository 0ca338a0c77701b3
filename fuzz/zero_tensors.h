// safetensors files from any header: the data are zeros, since weights would be most of the bytes and no branch depends
// on them.

#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

namespace likeness::fuzz {

// The header's length, the header, and as many zeros as the largest number in it says, up to four million: that is
// where the last tensor's data end.
inline std::string WithZeroTensors(std::string_view header) {
  constexpr size_t kMost = 4'000'000;
  size_t largest = 0;
  for (const char *at = header.data(), *end = at + header.size(); at < end; ++at) {
    size_t number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error == std::errc() && number <= kMost) largest = std::max(largest, number);
    if (next > at) at = next;
  }
  const uint64_t length = header.size();
  std::string file(reinterpret_cast<const char *>(&length), sizeof(length));
  file += header;
  file.resize(file.size() + largest);
  return file;
}

}  // namespace likeness::fuzz
