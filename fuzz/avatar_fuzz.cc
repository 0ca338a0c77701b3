// Avatar files whose header is any text and whose data are zeros: weights would be most of the bytes, and no branch
// depends on them.

#include <charconv>
#include <cstring>

#include "fuzz.h"
#include "likeness/avatar/avatar.h"

namespace likeness {
namespace {

// The largest number in the header, up to four million: where the last tensor's data end.
size_t DataBytes(std::string_view header) {
  constexpr size_t kMost = 4'000'000;
  size_t largest = 0;
  for (const char *at = header.data(), *end = at + header.size(); at < end; ++at) {
    size_t number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error == std::errc() && number <= kMost) largest = std::max(largest, number);
    if (next > at) at = next;
  }
  return largest;
}

}  // namespace

void fuzz::Run(std::string_view bytes) {
  const uint64_t length = bytes.size();
  std::string file(reinterpret_cast<const char *>(&length), sizeof(length));
  file += bytes;
  file.resize(file.size() + DataBytes(bytes));
  const auto avatar = Parsed([&] { return AvatarFrom(SafetensorsFile(kPath, std::move(file))); });
  if (avatar) avatar->Check(kPath);
}

}  // namespace likeness
