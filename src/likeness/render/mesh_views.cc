#include "likeness/render/mesh_views.h"

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/image/resize.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

constexpr uint8_t kGround = 40;
constexpr float kClay = 205;

const char* LabelOf(double azimuth_deg) {
  return azimuth_deg == 0 ? "front" : azimuth_deg < 0 ? "subject's right side" : "subject's left side";
}

}  // namespace

ImageU8 DrawShadedMesh(const Vertices& vertices_in_head, const MeshTopology& topology, const Camera& camera) {
  constexpr int kSupersample = 2;
  const Camera fine = camera.Resized(camera.width * kSupersample, camera.height * kSupersample);
  const FragmentImage fragments = Rasterize(vertices_in_head, topology.triangles, fine, {});
  const Vertices normals = VertexNormals(vertices_in_head, topology.triangles);
  // Right, up and towards the camera, in its own axes.
  const Eigen::Vector3d to_light_in_cam = Eigen::Vector3d(0.35, -0.4, -1).normalized();
  const Eigen::Vector3f to_light = (camera.cam_from_world.rotation.transpose() * to_light_in_cam).cast<float>();
  ImageU8 picture(fine.width, fine.height, 3, kGround);
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const Fragment& fragment = fragments.at(x, y);
      if (fragment.triangle < 0) continue;
      const Eigen::Vector3i& corners = topology.triangles[static_cast<size_t>(fragment.triangle)];
      const Eigen::Vector3f normal = ((1 - fragment.b1 - fragment.b2) * normals.row(corners[0]) +
                                      fragment.b1 * normals.row(corners[1]) + fragment.b2 * normals.row(corners[2]))
                                         .transpose()
                                         .normalized();
      const float light = 0.15f + 0.85f * std::max(0.0f, normal.dot(to_light));
      std::fill_n(picture.at(x, y), 3, static_cast<uint8_t>(kClay * light + 0.5f));
    }
  }
  return ResizeArea(picture, camera.width, camera.height);
}

std::vector<Panel> MeshViews(const Vertices& vertices_in_head, const MeshTopology& topology, const ImageU8* texture,
                             int height) {
  LIKENESS_CHECK(height >= 64 && height <= 4096);
  const ImageF texels = texture != nullptr ? ToFloat(*texture) : ImageF();
  std::vector<Panel> panels;
  for (const double azimuth : kViewAzimuthsDeg) {
    PortraitOptions view;
    view.azimuth_deg = azimuth;
    view.width = height * 3 / 4;
    view.height = height;
    const Camera camera = PortraitCamera(vertices_in_head, topology, view);
    DrawOptions draw;
    draw.background.fill(kGround);
    panels.push_back({texture != nullptr ? DrawMesh(vertices_in_head, topology, texels, camera, {}, draw).colour
                                         : DrawShadedMesh(vertices_in_head, topology, camera),
                      LabelOf(azimuth)});
  }
  return panels;
}

}  // namespace likeness
