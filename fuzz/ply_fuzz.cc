#include "fuzz.h"
#include "likeness/geometry/ply.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto ply = Parsed([&] { return ParsePly(kPath, bytes); });
  if (!ply) return;
  LIKENESS_CHECK(ply->vertices.allFinite());
  for (const PlyEncoding encoding : {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian}) {
    const PlyFile again = ParsePly(kPath, EncodePly(ply->vertices, ply->triangles, encoding));
    LIKENESS_CHECK(again.vertices == ply->vertices && again.triangles == ply->triangles);
  }
}

}  // namespace likeness
