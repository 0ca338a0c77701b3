// likeness bench unwrap [CAPTURE]

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "likeness/app/benches.h"
#include "likeness/app/capture_flags.h"
#include "likeness/app/command.h"
#include "likeness/app/stopwatch.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/unwrap.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// A folder in the machine's temporary one, removed at the end.
struct TemporaryFolder {
  const fs::path path = fs::temp_directory_path() / fmt::format("likeness-bench-{}", getpid());
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

// A capture of one frame and one camera at the size of published ones: 14,790 triangles' worth of a lobed ball whose
// chart fills nine tenths of the atlas, 1334 x 2048 pixels, a noisy surface that fills two thirds of the picture's
// width, black background.
void WriteBenchCapture(const fs::path& root) {
  constexpr int kAround = 86, kDown = 86;
  MeshTopology topology;
  Vertices vertices(kAround * (kDown + 1), 3);
  for (int j = 0; j <= kDown; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const double phi = 2 * std::numbers::pi * i / kAround, theta = std::numbers::pi * (j + 0.02) / (kDown + 0.04);
      const double radius = 95 + 8 * std::sin(theta) * std::cos(5 * phi) * std::cos(4 * theta);
      vertices.row(j * kAround + i) =
          Eigen::RowVector3d(radius * std::sin(theta) * std::sin(phi), 1.3 * radius * std::cos(theta),
                             radius * std::sin(theta) * std::cos(phi))
              .cast<float>();
    }
    for (int i = 0; i <= kAround; ++i) {
      topology.uvs.emplace_back(0.025f + 0.95f * static_cast<float>(i) / kAround,
                                0.975f - 0.95f * static_cast<float>(j) / kDown);
    }
  }
  topology.vertex_count = static_cast<int>(vertices.rows());
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround, uv = j * (kAround + 1) + i;
      topology.triangles.emplace_back(a, a + kAround, b + kAround);
      topology.triangles.emplace_back(a, b + kAround, b);
      topology.triangle_uvs.emplace_back(uv, uv + kAround + 1, uv + kAround + 2);
      topology.triangle_uvs.emplace_back(uv, uv + kAround + 2, uv + 1);
    }
  }
  Camera camera = LookAt({150, 60, 1080}, {0, 0, 0}, {0, 1, 0}, 7700, 1334, 2048);
  camera.name = "400000";
  ImageU8 image(camera.width, camera.height, 3), mask(camera.width, camera.height, 1);
  RayScene scene;
  scene.Add(vertices, topology.triangles);
  scene.Build();
  const Eigen::Vector3d centre = camera.CentreInWorld();
  constexpr double kNoise = 1.6;  // makes a file as large as published ones, 2.9 MB, and so as slow to read
  ParallelFor(camera.height, [&](int64_t y) {
    Random random(1, static_cast<uint64_t>(y));
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d direction = camera.RayInWorld({x + 0.5, static_cast<double>(y) + 0.5});
      Ray ray;
      ray.origin = centre.cast<float>();
      ray.direction = direction.cast<float>();
      const RayHit hit = scene.Intersect(ray);
      if (hit.mesh < 0) continue;
      const Eigen::Vector3d p = centre + hit.t * direction;
      const double light = 0.6 + 0.4 * p.z() / 110 + 0.05 * std::sin(p.x()) * std::sin(1.3 * p.y());
      const double colours[3] = {150 * light, 110 * light, 90 * light};
      for (int c = 0; c < 3; ++c) {
        image.at(x, static_cast<int>(y))[c] =
            static_cast<uint8_t>(std::clamp(colours[c] + kNoise * random.Normal(), 1.0, 255.0));
      }
      *mask.at(x, static_cast<int>(y)) = 255;
    }
  });
  const CaptureWriter writer(root);
  const FrameId frame = {"bench", "000000"};
  writer.WriteCalibration({camera});
  writer.WriteFrameList({frame});
  writer.WriteObj(frame, vertices, topology);
  writer.WriteTracked(frame, {vertices, {}});
  writer.WriteImage(frame, camera.name, image);
  writer.WriteHeadMask(frame, camera.name, mask);
}

}  // namespace

int RunBenchUnwrap(int argc, const char* const* argv) {
  fs::path root;
  CaptureOptions capture_options;
  UnwrapOptions options;
  int repeats = 15;
  bool json = false;
  Command command("bench unwrap",
                  "Measures one camera image to one texture on one thread: medians of several runs, of which the first "
                  "warms up.",
                  "likeness bench unwrap --json");
  command.Positional("CAPTURE", &root, "folder of a capture (default: one of published size that is made and removed)",
                     false);
  command.Option("size", &options.size, "texels a side");
  command.Option("repeats", &repeats, "runs");
  command.Option("json", &json, "write the result as JSON");
  AddCaptureFlags(&command, &capture_options);
  if (!command.Parse(argc, argv)) return 0;
  options.Check();
  if (repeats < 1) throw Error("--repeats {}: expected 1 or more", repeats);

  const TemporaryFolder temporary;
  if (root.empty()) {
    root = temporary.path / "capture";
    WriteBenchCapture(root);
  }
  const auto capture = OpenCapture(root, capture_options);
  const FrameId frame = capture->frames().front();
  std::vector<Camera> cameras;
  for (const Camera& camera : capture->cameras()) {
    if (capture->HasCameraImage(frame, camera)) cameras.push_back(camera);
  }
  if (cameras.empty()) throw Error("{}: no image of frame {} {}", root.string(), frame.segment, frame.frame);
  SetThreadCount(1);

  const TrackedFrame tracked = capture->ReadTracked(frame);
  const TexelMap texels = MapTexels(capture->topology(), options.size);
  std::optional<FrameUnwrapper> unwrapper;
  Stopwatch frame_time, visibility, unwrap, read, write;
  for (int i = 0; i < 3; ++i) {
    frame_time.Measure([&] { unwrapper.emplace(capture->topology(), texels, tracked.vertices_in_head, options); });
  }
  int64_t seen = 0;
  for (int i = 0; i <= repeats; ++i) {
    const Camera& camera = cameras[static_cast<size_t>(i) % cameras.size()];
    const Eigen::Vector3d centre = tracked.world_from_head.Inverse() * camera.CentreInWorld();
    ImageU8 visible, image;
    std::optional<ImageU8> mask;
    UnwrappedView view;
    visibility.Measure([&] { visible = unwrapper->Visibility(centre); });
    read.Measure([&] {
      image = capture->ReadCameraImage(frame, camera);
      mask = capture->ReadHeadMask(frame, camera);
    });
    unwrap.Measure([&] { view = unwrapper->Unwrap(camera, tracked.world_from_head, image, mask ? &*mask : nullptr); });
    write.Measure([&] {
      WriteFile(temporary.path / "texture.png", EncodePng(view.texture, 1), Sync::kNo);
      WriteFile(temporary.path / "mask.png", EncodePng(view.mask, 1), Sync::kNo);
    });
    seen += std::count(view.mask.values().begin(), view.mask.values().end(), 255);
  }
  const Stopwatch total = {&read, &unwrap, &write};
  if (json) {
    const auto covered =
        std::count_if(texels.texels.begin(), texels.texels.end(), [](const auto& t) { return t.triangle >= 0; });
    nlohmann::ordered_json result = {{"texture_size", options.size},
                                     {"image_width", cameras.front().width},
                                     {"image_height", cameras.front().height},
                                     {"head_masks", capture->ReadHeadMask(frame, cameras.front()).has_value()},
                                     {"triangles", capture->topology().triangles.size()},
                                     {"covered_texels", covered},
                                     {"seen_texels", seen / (repeats + 1)},
                                     {"threads", 1},
                                     {"repeats", repeats}};
    const auto add = [&](const std::string& name, const Stopwatch& time) {
      result[name + "_ms"] = time.wall_ms();
      result[name + "_cpu_ms"] = time.cpu_ms();
    };
    add("visibility", visibility);
    add("total", total);
    add("read", read);
    add("unwrap", unwrap);
    add("write", write);
    add("frame", frame_time);
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("a {0} x {0} texture of {1} triangles from a {2} x {3} image, one thread\n", options.size,
             capture->topology().triangles.size(), cameras.front().width, cameras.front().height);
  const auto line = [](const Stopwatch& time, const char* what) {
    fmt::print("{:8.1f} ms ({:5.1f} of the processor)  {}\n", time.wall_ms(), time.cpu_ms(), what);
  };
  line(visibility, "visibility of all texels, without images");
  line(total, "reading the image, unwrapping, writing the texture; of these:");
  line(read, "  reading the image and its head mask");
  line(unwrap, "  visibility and sampling");
  line(write, "  writing the texture and its mask");
  line(frame_time, "once a frame, for all cameras: surface points and ray hierarchy");
  return 0;
}

}  // namespace likeness
