#include "fuzz.h"
#include "likeness/texture/unwrap_record.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParseUnwrapRecord(kPath, text); }, UnwrapRecordText);
}

}  // namespace likeness
