#include "likeness/validate/overlay.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "likeness/image/panels.h"
#include "likeness/image/resize.h"
#include "likeness/render/rasterizer.h"
#include "likeness/validate/hypothesis.h"

namespace likeness {

ImageU8 DrawMeshOver(const View& view, const Placement& placement, const Vertices& vertices,
                     const MeshTopology& topology, const std::array<uint8_t, 3>& tint) {
  constexpr int kEnlarged = 2;
  ImageU8 picture = ResizeBilinear(view.colour, kEnlarged * view.colour.width(), kEnlarged * view.colour.height());
  const Camera camera = placement.camera.Resized(picture.width(), picture.height());
  const Vertices mapped = vertices * placement.mesh_from_file.cast<float>().transpose();
  RasterOptions options;
  options.cull_back_faces = false;
  const FragmentImage drawn = Rasterize(mapped, topology.triangles, camera, placement.world_from_head, options);
  const RigidTransform cam_from_head = camera.cam_from_world * placement.world_from_head;
  const auto covered = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < drawn.width && y < drawn.height && drawn.at(x, y).triangle >= 0;
  };
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (!covered(x, y)) continue;
      const bool edge = !covered(x - 1, y) || !covered(x + 1, y) || !covered(x, y - 1) || !covered(x, y + 1);
      const Eigen::Vector3i& t = topology.triangles[static_cast<size_t>(drawn.at(x, y).triangle)];
      const Eigen::Vector3f a = mapped.row(t[0]), b = mapped.row(t[1]), c = mapped.row(t[2]);
      const Eigen::Vector3d normal = cam_from_head.rotation * (b - a).cross(c - a).cast<double>().normalized();
      // From the upper left of the camera, so that nose, lips and sockets show.
      const double lit = std::abs(normal.dot(Eigen::Vector3d(-0.3, -0.4, -0.87)));
      const double share = edge ? 0.9 : 0.5;
      for (int k = 0; k < 3; ++k) {
        const double shade = edge ? tint[static_cast<size_t>(k)] : tint[static_cast<size_t>(k)] * std::pow(lit, 3);
        uint8_t& value = picture.at(x, y)[k];
        value = static_cast<uint8_t>(std::lround((1 - share) * value + share * shade));
      }
    }
  }
  return picture;
}

std::function<ImageU8()> DrawLooks(const Examination& e, std::vector<Look> looks, const Hypothesis& hypothesis,
                                   const std::string& before, const std::string& after) {
  constexpr size_t kPictures = 4;
  if (looks.size() > kPictures) {
    std::vector<Look> chosen;
    for (size_t i = 0; i < kPictures; ++i) chosen.push_back(looks[i * (looks.size() - 1) / (kPictures - 1)]);
    looks = std::move(chosen);
  }
  std::vector<Placement> as_files, corrected;
  for (const Look& look : looks) {
    as_files.push_back(e.Place(e.frames[look.frame], look.camera));
    corrected.push_back(hypothesis.Apply(as_files.back()));
  }
  return [&e, looks, as_files, corrected, before, after] {
    std::vector<ImageU8> rows;
    for (const bool is_after : {false, true}) {
      std::vector<Panel> panels;
      for (size_t i = 0; i < looks.size(); ++i) {
        const ExaminedFrame& frame = e.frames[looks[i].frame];
        const std::array<uint8_t, 3> tint =
            is_after ? std::array<uint8_t, 3>{90, 255, 120} : std::array<uint8_t, 3>{255, 90, 80};
        panels.push_back(
            {DrawMeshOver(*looks[i].view, is_after ? corrected[i] : as_files[i], frame.vertices, e.topology, tint),
             e.cameras[looks[i].camera].name + " " + frame.id.frame});
      }
      panels[0].label = (is_after ? after : before) + ": " + panels[0].label;
      rows.push_back(SideBySide(panels));
    }
    return Stacked(rows);
  };
}

}  // namespace likeness
