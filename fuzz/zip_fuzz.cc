// Zips of numbered files, as Ava-256 packs what it has for every frame.

#include "fuzz.h"
#include "likeness/capture/ava256/packed_folder.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  constexpr uint64_t kMostBytes = 1 << 16;
  const auto folder = Parsed([&] { return PackedFolder::FromZipBytes(kPath, bytes, {".txt"}); });
  if (!folder) return;
  for (const int64_t number : folder->Numbers()) {
    LIKENESS_CHECK(folder->Has(number) && folder->NameOf(number).string().starts_with(kPath));
    const auto file = Parsed([&] { return folder->Read(number, kMostBytes); });
    LIKENESS_CHECK(!file || file->size() <= kMostBytes);
  }
}

}  // namespace likeness
