// Lists of frames of Ava-256, and of Goliath: there the segments follow behind a zero byte.

#include "fuzz.h"
#include "likeness/capture/ava256/tables.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  Parsed([&] { return ParseFrameListCsv(kPath, bytes); });
  const size_t end = std::min(bytes.find('\0'), bytes.size());
  const std::string_view segments = bytes.substr(std::min(end + 1, bytes.size()));
  Parsed([&] { return ParseFrameSplitsCsv(kPath, bytes.substr(0, end), kPath, segments); });
}

}  // namespace likeness
