// likeness bench simulate

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "likeness/app/benches.h"
#include "likeness/app/command.h"
#include "likeness/app/stopwatch.h"
#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/performance.h"
#include "likeness/simulate/renderer.h"
#include "likeness/simulate/rig.h"

namespace likeness {

int RunBenchSimulate(int argc, const char* const* argv) {
  std::string head = "human:7";
  std::filesystem::path head_data;
  RigOptions rig_options;
  rig_options.cameras = 40;
  ShadingOptions shading;
  int lights = 200, repeats = 9;
  bool json = false;
  Command command("bench simulate",
                  "Measures how fast a frame is simulated, on one thread: medians of several cameras, of which the "
                  "first warms up. Times are of the processor, which other programs disturb less.",
                  "likeness bench simulate --json");
  command.Option("head", &head, "as `simulate` takes it");
  command.Option("head-data", &head_data, "folder of the MakeHuman data, if not found by itself");
  command.Option("width", &rig_options.width, "pixels");
  command.Option("height", &rig_options.height, "pixels");
  command.Option("lens-mm", &rig_options.lens_mm, "as `simulate` takes it");
  command.Option("samples", &shading.samples, "rays a pixel");
  command.Option("lights", &lights, "lights around the head");
  command.Option("repeats", &repeats, "cameras");
  command.Option("json", &json, "write the result as JSON");
  if (!command.Parse(argc, argv)) return 0;
  if (repeats < 1 || repeats >= rig_options.cameras) throw Error("--repeats {}: expected 1 to 39", repeats);

  const OpenedHead opened = OpenHead(head, head_data);
  const LightRig light_rig = EvenLights(lights, 0.75f);
  const HeadRenderer renderer(*opened.head, light_rig, shading);
  std::array<float, kExpressionCount> weights = {};
  weights[static_cast<size_t>(ExpressionIndex("jawOpen"))] = 0.3f;
  const Rig rig = MakeRig(rig_options, opened.head->Pose(weights).tracked);
  SetThreadCount(1);

  Stopwatch pose, light, render, encode;
  PosedHead posed;
  LitHead lit;
  for (int i = 0; i < 3; ++i) {
    pose.Measure([&] { posed = opened.head->Pose(weights); });
    light.Measure([&] { lit = renderer.Light(posed, RigidTransform()); });
  }
  int64_t camera_rays = 0, head_pixels = 0;
  double render_ms = 0;
  for (int i = 0; i <= repeats; ++i) {
    // Spread over the rig, so that all sides of the head count.
    const Camera& camera = rig.cameras[static_cast<size_t>(i * rig_options.cameras / (repeats + 1))];
    HeadPicture picture;
    render.Measure([&] { picture = renderer.Render(lit, camera); });
    encode.Measure([&] { EncodePng(picture.rgb, 1), EncodePng(picture.mask, 1); });
    if (i == 0) continue;  // warms up
    render_ms += render.last_cpu_ms();
    camera_rays += picture.camera_rays;
    for (const uint8_t value : picture.mask.values()) head_pixels += value > 0 ? 1 : 0;
  }
  const double image_s = (render_ms / repeats + encode.cpu_ms()) / 1e3;
  const double frame_s = (pose.cpu_ms() + light.cpu_ms()) / 1e3 + rig_options.cameras * image_s;
  const nlohmann::ordered_json result = {
      {"head", head},
      {"width", rig_options.width},
      {"height", rig_options.height},
      {"samples", shading.samples},
      {"lights", lights},
      {"threads", 1},
      {"images", repeats},
      {"camera_rays_per_image", camera_rays / repeats},
      {"head_pixels_per_image", head_pixels / repeats},
      {"mrays_per_s", static_cast<double>(camera_rays) / render_ms / 1e3},
      {"shadow_rays_per_frame", lit.shadow_rays},
      {"shadow_mrays_per_s", static_cast<double>(lit.shadow_rays) / light.cpu_ms() / 1e3},
      {"pose_cpu_ms", pose.cpu_ms()},
      {"light_cpu_ms", light.cpu_ms()},
      {"render_cpu_ms", render_ms / repeats},
      {"encode_cpu_ms", encode.cpu_ms()},
      {"image_cpu_s", image_s},
      {"frame_of_40_cpu_s", frame_s},
  };
  if (json) {
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{}, {} x {} pixels, {} rays a pixel, {} lights, one thread\n", head, rig_options.width,
             rig_options.height, shading.samples, lights);
  const auto line = [](double value, const char* unit, const char* what) {
    fmt::print("{:8.2f} {:<7} {}\n", value, unit, what);
  };
  line(result["mrays_per_s"], "Mray/s", "camera rays in the head's bounding box, with shading");
  line(result["shadow_mrays_per_s"], "Mray/s", "shadow rays");
  line(result["pose_cpu_ms"], "ms", "posing the head, once a frame");
  line(result["light_cpu_ms"], "ms", "light and shadow, once a frame");
  line(result["render_cpu_ms"], "ms", "an image");
  line(result["encode_cpu_ms"], "ms", "an image and its mask as PNG");
  line(frame_s, "s", "a frame of 40 cameras");
  return 0;
}

}  // namespace likeness
