#include "fuzz.h"
#include "likeness/geometry/obj.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto obj = Parsed([&] { return ParseObj(kPath, bytes); });
  if (!obj) return;
  const auto topology = Parsed([&] { return TopologyFromObj(*obj, kPath); });
  if (!topology) return;
  topology->Check(kPath);
  LIKENESS_CHECK(MapTexels(*topology, 8).texels.size() == 64);
  LIKENESS_CHECK(VertexNormals(obj->vertices, topology->triangles).rows() == obj->vertices.rows());

  const ObjFile again = ParseObj(kPath, ObjText(obj->vertices, *topology));
  LIKENESS_CHECK(again.vertices == obj->vertices && again.uvs == obj->uvs);
  LIKENESS_CHECK(TopologyFromObj(again, kPath).triangles == topology->triangles);
}

}  // namespace likeness
