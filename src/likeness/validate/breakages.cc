#include "likeness/validate/breakages.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "likeness/base/file.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"
#include "likeness/texture/texture_set.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3d;

using Change = std::function<void(Patient*)>;

// One camera, or all.
constexpr int kAll = -1;
Change Cameras(int which, const std::function<void(Camera*)>& change) {
  return [=](Patient* p) {
    std::vector<Camera> cameras = p->good.cameras();
    for (size_t c = 0; c < cameras.size(); ++c) {
      if (which == kAll || which == static_cast<int>(c)) change(&cameras[c]);
    }
    p->files.WriteCalibration(cameras);
  };
}

Change Extrinsics(int which, const std::function<RigidTransform(const RigidTransform&)>& change) {
  return Cameras(which, [=](Camera* camera) { camera->cam_from_world = change(camera->cam_from_world); });
}

Change Pixels(int which, double scale_x, double scale_y, double right, double down) {
  return Cameras(which, [=](Camera* camera) {
    camera->intrinsics.row(0) *= scale_x;
    camera->intrinsics.row(1) *= scale_y;
    camera->intrinsics(0, 2) += right;
    camera->intrinsics(1, 2) += down;
  });
}

// Of one frame, or all.
Change Tracked(int which, const std::function<void(TrackedFrame*)>& change) {
  return [=](Patient* p) {
    for (size_t f = 0; f < p->good.frames().size(); ++f) {
      if (which != kAll && which != static_cast<int>(f)) continue;
      TrackedFrame tracked = p->good.ReadTracked(p->frame(f));
      change(&tracked);
      p->files.WriteTracked(p->frame(f), tracked);
    }
  };
}

Change Mesh(int which, const Matrix3d& map) {
  return Tracked(which, [=](TrackedFrame* t) {
    t->vertices_in_head = (t->vertices_in_head * map.cast<float>().transpose()).eval();
  });
}

Change Topology(const std::function<void(MeshTopology*, Vertices*)>& change) {
  return [=](Patient* p) {
    MeshTopology topology = p->good.topology();
    Vertices vertices = p->good.ReadTracked(p->frame(0)).vertices_in_head;
    change(&topology, &vertices);
    for (const FrameId& frame : p->good.frames()) p->files.WriteObj(frame, vertices, topology);
  };
}

// Images (and masks, if asked for) of one camera, or all.
Change Images(int which, const std::function<ImageU8(const ImageU8&)>& change, bool masks = false) {
  return [=](Patient* p) {
    for (size_t c = 0; c < p->good.cameras().size(); ++c) {
      if (which != kAll && which != static_cast<int>(c)) continue;
      const Camera& camera = p->good.cameras()[c];
      for (const FrameId& frame : p->good.frames()) {
        p->files.WriteImage(frame, camera.name, change(p->good.ReadCameraImage(frame, camera)));
        if (masks) p->files.WriteHeadMask(frame, camera.name, change(*p->good.ReadHeadMask(frame, camera)));
      }
    }
  };
}

ImageU8 FlipImage(const ImageU8& image, bool across, bool down) {
  ImageU8 flipped(image.width(), image.height(), image.channels());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      std::copy_n(image.at(across ? image.width() - 1 - x : x, down ? image.height() - 1 - y : y), image.channels(),
                  flipped.at(x, y));
    }
  }
  return flipped;
}

ImageU8 SwapColours(const ImageU8& image) {
  ImageU8 swapped = image;
  for (size_t i = 0; i + 2 < swapped.values().size(); i += 3) std::swap(swapped.values()[i], swapped.values()[i + 2]);
  return swapped;
}

ImageU8 Brightened(const ImageU8& image, double factor) {
  ImageU8 bright = image;
  for (uint8_t& value : bright.values()) value = static_cast<uint8_t>(std::min(255.0, factor * value));
  return bright;
}

// Half a texel to the left: each texel becomes the mean of itself and its right neighbour, where both are seen.
ImageU8 HalfTexel(const ImageU8& texture) {
  ImageU8 moved(texture.width(), texture.height(), 3);
  for (int y = 0; y < texture.height(); ++y) {
    for (int x = 0; x + 1 < texture.width(); ++x) {
      const uint8_t *a = texture.at(x, y), *b = texture.at(x + 1, y);
      if ((a[0] | a[1] | a[2]) == 0 || (b[0] | b[1] | b[2]) == 0) continue;
      for (int c = 0; c < 3; ++c) moved.at(x, y)[c] = static_cast<uint8_t>((a[c] + b[c] + 1) / 2);
    }
  }
  return moved;
}

// The images of frame i take the name of frame i - by in each segment; the rest of the segment loses its images.
Change Delay(int which, int by) {
  return [=](Patient* p) {
    const auto& frames = p->good.frames();
    for (size_t c = 0; c < p->good.cameras().size(); ++c) {
      if (which != kAll && which != static_cast<int>(c)) continue;
      const std::string& name = p->good.cameras()[c].name;
      const CaptureLayout good(p->good.root());
      for (size_t f = 0; f < frames.size(); ++f) {
        const auto from = static_cast<std::ptrdiff_t>(f) + by;
        const bool exists = from >= 0 && from < static_cast<std::ptrdiff_t>(frames.size()) &&
                            frames[static_cast<size_t>(from)].segment == frames[f].segment;
        const size_t segment = static_cast<size_t>(std::count_if(
            frames.begin(), frames.end(), [&](const FrameId& id) { return id.segment == frames[f].segment; }));
        if (segment < 3) continue;
        for (const bool mask : {false, true}) {
          const fs::path to = mask ? p->layout().HeadMask(frames[f], name) : p->layout().Image(frames[f], name);
          fs::remove(to);
          if (!exists) continue;
          const FrameId& source = frames[static_cast<size_t>(from)];
          fs::copy_file(mask ? good.HeadMask(source, name) : good.Image(source, name), to);
        }
      }
    }
  };
}

Change Textures(const std::function<ImageU8(const ImageU8&)>& change, bool views, bool averages) {
  return [=](Patient* p) {
    const CaptureLayout good(p->good.root());
    const int size = TextureSizes(p->good.root()).front();
    for (const FrameId& frame : p->good.frames()) {
      if (averages)
        WritePng(p->layout().AverageTexture(frame, size), change(ReadImage(good.AverageTexture(frame, size))));
      for (const Camera& camera : p->good.cameras()) {
        if (views)
          WritePng(p->layout().Texture(frame, camera.name, size),
                   change(ReadImage(good.Texture(frame, camera.name, size))));
      }
    }
  };
}

Matrix3d Diagonal(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

// y up to z up: (x, y, z) -> (x, -z, y)
Matrix3d ZUp() {
  Matrix3d m;
  m << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return m;
}

RigidTransform Turned(const Matrix3d& m, const RigidTransform& t) { return {m * t.rotation, m * t.translation}; }

std::string CalibrationText(const Patient& p) { return ReadFile(CaptureLayout(p.good.root()).Calibration()); }

Change ReplaceCalibration(const std::function<std::string(std::string)>& change) {
  return [=](Patient* p) { WriteFile(p->layout().Calibration(), change(CalibrationText(*p))); };
}

std::vector<Breakage> OfCalibration() {
  const auto inverse = [](const RigidTransform& t) { return t.Inverse(); };
  const auto opengl = [](const RigidTransform& t) { return Turned(Diagonal(1, -1, -1), t); };
  return {
      {"no calibration",
       "calibration-missing",
       [](Patient* p) { fs::remove(p->layout().Calibration()); },
       {},
       "",
       false},
      {"a number of the calibration is nan",
       "calibration-unreadable",
       ReplaceCalibration([](std::string text) { return text.replace(text.find(" 0 ") + 1, 1, "nan"); }),
       {},
       "",
       false},
      {"lens distortion",
       "lens-distortion",
       ReplaceCalibration([](std::string text) { return text.replace(text.find("0 0 0 0 0"), 9, "0.1 -0.02 0 0 0"); }),
       {},
       "",
       false},
      {"K transposed",
       "intrinsics-transposed",
       Cameras(kAll, [](Camera* c) { c->intrinsics.transposeInPlace(); }),
       {},
       "",
       false},
      {"K of one camera transposed",
       "intrinsics-transposed",
       Cameras(2, [](Camera* c) { c->intrinsics.transposeInPlace(); }),
       {},
       "cam02",
       false},
      {"R transposed",
       "rotation-transposed",
       Extrinsics(kAll,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation.transpose(), t.translation};
                  }),
       {},
       "all cameras",
       true},
      {"R of one camera transposed",
       "rotation-transposed",
       Extrinsics(1,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation.transpose(), t.translation};
                  }),
       {},
       "cam01",
       false},
      {"camera to world for world to camera",
       "extrinsics-inverted",
       Extrinsics(kAll, inverse),
       {},
       "all cameras",
       true},
      {"camera to world for one camera", "extrinsics-inverted", Extrinsics(4, inverse), {}, "cam04", false},
      {"camera space of OpenGL", "camera-axes-opengl", Extrinsics(kAll, opengl), {}, "all cameras", true},
      {"camera to world in OpenGL's axes",
       "extrinsics-inverted-opengl",
       Extrinsics(kAll, [=](const RigidTransform& t) { return opengl(t).Inverse(); }),
       {},
       "all cameras",
       false},
      {"camera centre for t",
       "translation-is-centre",
       Extrinsics(kAll,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation, t.Inverse().translation};
                  }),
       {},
       "all cameras",
       false},
      {"left-handed cameras",
       "rotation-mirrors",
       Extrinsics(kAll, [](const RigidTransform& t) { return Turned(Diagonal(1, -1, 1), t); }),
       {},
       "",
       false},
      {"calibration in metres",
       "units-calibration",
       Extrinsics(kAll,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation, t.translation / 1000};
                  }),
       {},
       "all cameras",
       false},
      {"calibration in centimetres",
       "units-calibration",
       Extrinsics(kAll,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation, t.translation / 10};
                  }),
       {},
       "all cameras",
       false},
      {"calibration with z up",
       "world-axes",
       Extrinsics(kAll,
                  [](const RigidTransform& t) -> RigidTransform {
                    return {t.rotation * ZUp().transpose(), t.translation};
                  }),
       {"mesh-axes"},
       "",
       true},
      {"K of images twice as large", "intrinsics-resolution", Pixels(kAll, 2, 2, 0, 0), {}, "all cameras", false},
      {"K of images a quarter as large",
       "intrinsics-resolution",
       Pixels(kAll, 0.25, 0.25, 0, 0),
       {},
       "all cameras",
       false},
      {"K of images 1.536 times as large",
       "intrinsics-resolution",
       Pixels(kAll, 1.536, 1.536, 0, 0),
       {},
       "all cameras",
       true},
      {"K of one camera at half the size", "intrinsics-resolution", Pixels(3, 0.5, 0.5, 0, 0), {}, "cam03", true},
      {"images cropped after calibration", "principal-point", Pixels(kAll, 1, 1, 20, 26), {}, "all cameras", false},
      {"two cameras exchanged",
       "cameras-exchanged",
       [](Patient* p) {
         std::vector<Camera> cameras = p->good.cameras();
         std::swap(cameras[1].name, cameras[4].name);
         p->files.WriteCalibration(cameras);
       },
       {},
       "cam01 and cam04",
       true},
      {"two neighbours exchanged",
       "cameras-exchanged",
       [](Patient* p) {
         std::vector<Camera> cameras = p->good.cameras();
         std::swap(cameras[2].name, cameras[3].name);
         p->files.WriteCalibration(cameras);
       },
       {},
       "cam02 and cam03",
       true},
  };
}

std::vector<Breakage> OfMeshes() {
  const auto scaled = [](double s) { return Diagonal(s, s, s); };
  return {
      {"meshes in metres", "units-mesh", Mesh(kAll, scaled(1e-3)), {}, "", false},
      {"meshes in inches", "units-mesh", Mesh(kAll, scaled(1 / 25.4)), {}, "", false},
      {"everything in centimetres",
       "units-capture",
       [=](Patient* p) {
         Extrinsics(kAll, [](const RigidTransform& t) -> RigidTransform {
           return {t.rotation, t.translation / 10};
         })(p);
         Tracked(kAll, [](TrackedFrame* t) { t->vertices_in_head /= 10, t->world_from_head.translation /= 10; })(p);
       },
       {},
       "",
       false},
      {"meshes with z up", "mesh-axes", Mesh(kAll, ZUp()), {"world-axes"}, "", true},
      {"meshes mirrored", "mesh-mirrored", Mesh(kAll, Diagonal(-1, 1, 1)), {}, "", true},
      {"head space with z up, and poses to match",
       "head-axes",
       Tracked(kAll,
               [](TrackedFrame* t) {
                 t->vertices_in_head = (t->vertices_in_head * ZUp().cast<float>().transpose()).eval();
                 t->world_from_head.rotation = t->world_from_head.rotation * ZUp().transpose();
               }),
       {},
       "",
       false},
      {"triangles clockwise",
       "mesh-inside-out",
       Topology([](MeshTopology* t, Vertices*) {
         for (size_t i = 0; i < t->triangles.size(); ++i)
           std::swap(t->triangles[i][0], t->triangles[i][1]), std::swap(t->triangle_uvs[i][0], t->triangle_uvs[i][1]);
       }),
       {},
       "",
       false},
      {"a mesh with nan",
       "mesh-not-finite",
       [](Patient* p) {
         Vertices v = p->good.ReadTracked(p->frame(3)).vertices_in_head;
         v(17, 1) = std::numeric_limits<float>::quiet_NaN();
         WriteFloats(p->layout().MeshBinary(p->frame(3)), {v.data(), static_cast<size_t>(v.size())});
       },
       {},
       "",
       false},
      {"a mesh of another vertex count",
       "mesh-vertex-count",
       [](Patient* p) {
         const Vertices v = p->good.ReadTracked(p->frame(3)).vertices_in_head;
         WriteFloats(p->layout().MeshBinary(p->frame(3)), {v.data(), static_cast<size_t>(v.size()) - 30});
       },
       {},
       "",
       false},
      {"one mesh twice as large", "mesh-outlier", Mesh(2, scaled(2)), {}, "", false},
      {"one mesh off the head",
       "head-pose-wrong",
       Tracked(5, [](TrackedFrame* t) { t->vertices_in_head.col(0).array() += 35; }),
       {},
       "",
       true},
      {"topology of another mesh",
       "topology-vertex-count",
       Topology([](MeshTopology* t, Vertices* v) {
         v->conservativeResize(v->rows() + 5, 3), v->bottomRows(5).setZero(), t->vertex_count += 5;
       }),
       {},
       "",
       false},
      {"texture coordinates upside down",
       "uv-upside-down",
       Topology([](MeshTopology* t, Vertices*) {
         for (Eigen::Vector2f& uv : t->uvs) uv.y() = 1 - uv.y();
       }),
       {},
       "",
       false},
      {"texture coordinates in texels",
       "uv-outside",
       Topology([](MeshTopology* t, Vertices*) {
         for (Eigen::Vector2f& uv : t->uvs) uv *= 1024;
       }),
       {},
       "",
       false},
      {"head poses inverted",
       "head-pose-inverted",
       Tracked(kAll, [](TrackedFrame* t) { t->world_from_head = t->world_from_head.Inverse(); }),
       {},
       "all frames",
       true},
      {"head poses absent",
       "head-pose-absent",
       Tracked(kAll, [](TrackedFrame* t) { t->world_from_head = {}; }),
       {},
       "all frames",
       true},
      {"head pose of another frame",
       "head-pose-of-another-frame",
       [](Patient* p) {
         TrackedFrame tracked = p->good.ReadTracked(p->frame(6));
         tracked.world_from_head = p->good.ReadTracked(p->frame(4)).world_from_head;
         p->files.WriteTracked(p->frame(6), tracked);
       },
       {"head-pose-wrong", "head-pose-inverted", "head-pose-transposed"},
       "",
       true},
      {"head pose that is no rotation",
       "head-pose-not-rigid",
       Tracked(2, [](TrackedFrame* t) { t->world_from_head.rotation *= 1.2; }),
       {},
       "",
       false},
      {"meshes in world space",
       "head-pose-twice",
       Tracked(kAll,
               [](TrackedFrame* t) {
                 for (Eigen::Index i = 0; i < t->vertices_in_head.rows(); ++i) {
                   const Eigen::Vector3d point = t->vertices_in_head.row(i).transpose().cast<double>();
                   t->vertices_in_head.row(i) = (t->world_from_head * point).transpose().cast<float>();
                 }
               }),
       {},
       "all frames",
       true},
  };
}

std::vector<Breakage> OfImages() {
  const auto mirrored = [](const ImageU8& image) { return FlipImage(image, true, false); };
  const auto tumbled = [](const ImageU8& image) { return FlipImage(image, false, true); };
  return {
      {"images mirrored", "images-mirrored", Images(kAll, mirrored, true), {}, "images", true},
      {"images of one camera mirrored", "images-mirrored", Images(1, mirrored, true), {}, "cam01", true},
      {"images upside down", "images-upside-down", Images(kAll, tumbled, true), {}, "images", false},
      {"images a frame early", "images-out-of-sync", Delay(kAll, 1), {"image-absent"}, "all cameras", true},
      {"one camera a frame early", "camera-out-of-sync", Delay(2, 1), {"image-absent"}, "cam02", true},
      {"one camera a frame late", "camera-out-of-sync", Delay(3, -1), {"image-absent"}, "cam03", false},
      {"a black camera",
       "image-black",
       Images(2, [](const ImageU8& i) { return Brightened(i, 0); }),
       {},
       "cam02",
       false},
      {"an overexposed camera",
       "image-overexposed",
       Images(2, [](const ImageU8& i) { return Brightened(i, 6); }),
       {},
       "cam02",
       false},
      {"red and blue exchanged in a camera", "camera-colours-swapped", Images(3, SwapColours), {}, "cam03", true},
      {"a frozen camera",
       "camera-frozen",
       [](Patient* p) {
         const Camera& camera = p->good.cameras()[2];
         for (const FrameId& frame : p->good.frames())
           p->files.WriteImage(frame, camera.name, p->good.ReadCameraImage(p->frame(0), camera));
       },
       {},
       "cam02",
       false},
      {"a frame's images under two numbers",
       "frame-duplicated",
       [](Patient* p) {
         for (const Camera& camera : p->good.cameras())
           p->files.WriteImage(p->frame(1), camera.name, p->good.ReadCameraImage(p->frame(0), camera));
       },
       {"mask-mismatch"},
       "",
       false},
      {"an image of another size",
       "image-size",
       [](Patient* p) {
         const ImageU8 image = p->good.ReadCameraImage(p->frame(2), p->good.cameras()[1]);
         p->files.WriteImage(p->frame(2), p->good.cameras()[1].name,
                             ResizeArea(image, image.width() / 2, image.height() / 2));
       },
       {},
       "cam01",
       false},
      {"a truncated image",
       "image-unreadable",
       [](Patient* p) {
         const fs::path path = p->layout().Image(p->frame(2), p->good.cameras()[1].name);
         const std::string bytes = ReadFile(path);
         WriteFile(path, bytes.substr(0, bytes.size() * 2 / 3));
       },
       {},
       "cam01",
       false},
      {"an image absent",
       "image-absent",
       [](Patient* p) { fs::remove(p->layout().Image(p->frame(2), p->good.cameras()[1].name)); },
       {},
       "cam01",
       false},
      {"a frame listed but absent",
       "frame-absent",
       [](Patient* p) { fs::remove(p->layout().MeshBinary(p->frame(2))); },
       {"image-not-listed"},
       "",
       false},
      {"a frame absent from the list",
       "frame-not-listed",
       [](Patient* p) {
         std::vector<FrameId> frames = p->good.frames();
         frames.erase(frames.begin() + 2);
         p->files.WriteFrameList(frames);
       },
       {"image-not-listed"},
       "",
       false},
      {"masks inverted",
       "mask-inverted",
       [](Patient* p) {
         for (const FrameId& frame : p->good.frames()) {
           for (const Camera& camera : p->good.cameras()) {
             ImageU8 mask = *p->good.ReadHeadMask(frame, camera);
             for (uint8_t& value : mask.values()) value = static_cast<uint8_t>(255 - value);
             p->files.WriteHeadMask(frame, camera.name, mask);
           }
         }
       },
       {},
       "",
       false},
      {"masks of another size",
       "mask-size",
       [](Patient* p) {
         const Camera& camera = p->good.cameras()[1];
         for (const FrameId& frame : p->good.frames())
           p->files.WriteHeadMask(frame, camera.name, ImageU8(camera.width / 2, camera.height / 2, 1, 255));
       },
       {},
       "cam01",
       false},
      {"a split of other cameras",
       "split-unknown-camera",
       [](Patient* p) {
         Split split;
         split.training_cameras = {"400002", "400004"};
         p->files.WriteSplit(split);
       },
       {},
       "split.json",
       false},
  };
}

std::vector<Breakage> OfTextures() {
  const auto tumbled = [](const ImageU8& image) { return FlipImage(image, false, true); };
  const auto mirrored = [](const ImageU8& image) { return FlipImage(image, true, false); };
  return {
      {"textures upside down", "texture-flipped", Textures(tumbled, true, true), {}, "", true},
      {"textures mirrored", "texture-flipped", Textures(mirrored, true, true), {}, "", true},
      {"textures shifted by half a texel", "texture-shifted", Textures(HalfTexel, true, true), {}, "", true},
      {"red and blue exchanged in textures",
       "texture-colours-swapped",
       Textures(SwapColours, true, true),
       {},
       "",
       false},
      {"average textures upside down", "average-flipped", Textures(tumbled, false, true), {}, "average", false},
      {"mean texture upside down",
       "mean-flipped",
       [=](Patient* p) {
         WritePng(p->layout().TextureMean(), tumbled(ReadImage(CaptureLayout(p->good.root()).TextureMean())));
       },
       {},
       "tex_mean",
       false},
      {"standard deviation for variance",
       "variance-is-deviation",
       [](Patient* p) {
         const double variance = std::stod(ReadFile(CaptureLayout(p->good.root()).TextureVariance()));
         WriteFile(p->layout().TextureVariance(), fmt::format("{}\n", std::sqrt(variance)));
       },
       {},
       "tex_var",
       false},
      {"topology with v flipped after unwrapping",
       "uv-upside-down",
       Topology([](MeshTopology* t, Vertices*) {
         for (Eigen::Vector2f& uv : t->uvs) uv.y() = 1 - uv.y();
       }),
       {},
       "",
       false},
  };
}

}  // namespace

std::vector<Breakage> AllBreakages(bool has_textures) {
  if (has_textures) return OfTextures();
  std::vector<Breakage> all;
  for (std::vector<Breakage> list : {OfCalibration(), OfMeshes(), OfImages()})
    std::move(list.begin(), list.end(), std::back_inserter(all));
  return all;
}

}  // namespace likeness
