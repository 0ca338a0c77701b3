// likeness bench frame [AVATAR]

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "likeness/app/bench_decode.h"
#include "likeness/app/benches.h"
#include "likeness/app/command.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/quantile.h"
#include "likeness/base/random.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/render/frame_renderer.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"
#include "likeness/render/stereo.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kFrameMs = 1000.0 / 90;
constexpr double kEyeDistanceMm = 63;
constexpr double kDistanceMm = 1000;

struct Arguments {
  fs::path avatar;
  int frames = 1000;
  int width = 1440;
  int height = 1600;
  double share = 0.5;
  bool anti_alias = false;
  bool json = false;
};

// Random weights in the Multiface preset, which move the vertices of a procedural head by a tenth of a millimetre.
Avatar RandomHead(int texture_size) {
  const auto head = MakeProceduralHead();
  const std::array<float, kExpressionCount> rest = {};
  Architecture a;
  a.preset = "multiface";
  a.layout = Layout::kMultiface;
  a.latent = 256;
  a.untied_bias = UntiedBias::kDecoderAndChannel;
  a.texture_size = texture_size;
  a.vertex_count = head->tracked_topology().vertex_count;
  a.Check();
  Avatar avatar = RandomAvatar(a, 1);
  avatar.topology = head->tracked_topology();
  avatar.identities[0].vertex_mean = head->Pose(rest).tracked;
  avatar.vertex_variance = 0.01;
  return avatar;
}

// Codes to play: the avatar's own, in their order and back again; without any, a smooth random walk about the mean.
class Codes {
 public:
  explicit Codes(const Avatar& avatar, bool walk) : code_(avatar.architecture.latent), random_(7) {
    if (walk) return;
    for (const FrameCode& frame : avatar.codes) {
      if (frame.identity == 0) own_.push_back(frame.mu);
    }
  }

  const std::vector<float>& Next() {
    if (own_.size() > 1) {
      const size_t period = 2 * own_.size() - 2, at = frame_++ % period;
      return own_[at < own_.size() ? at : period - at];
    }
    constexpr double kKept = 0.98;  // of a step at 90 Hz: half of a code is forgotten in 0.4 s
    for (float& value : code_) {
      value = static_cast<float>(kKept * value + std::sqrt(1 - kKept * kKept) * random_.Normal());
    }
    return code_;
  }

 private:
  std::vector<std::vector<float>> own_;
  std::vector<float> code_;
  Random random_;
  size_t frame_ = 0;
};

// Milliseconds of each stage, frame by frame.
struct Times {
  std::vector<double> decode, mip_maps, vertices, raster, frame;
};

struct Result {
  int texture_size = 0, vertices = 0, triangles = 0, threads = 0;
  double covered = 0;  // share of the pixels
  std::string decode_kernel, draw_kernel;
  Times times;
};

// Two eyes before the head, which fills a share of the picture's height.
std::vector<Camera> EyeCameras(const Arguments& arguments, const Avatar& avatar) {
  PortraitOptions options;
  options.width = arguments.width, options.height = arguments.height;
  options.distance_mm = kDistanceMm;
  const Vertices& mean = avatar.identities[0].vertex_mean;
  const double height_mm = mean.col(1).maxCoeff() - mean.col(1).minCoeff();
  options.focal_px = arguments.share * arguments.height * kDistanceMm / height_mm;
  const Camera middle = PortraitCamera(mean, avatar.topology, options);
  return {EyeCamera(middle, -kEyeDistanceMm / 2, kDistanceMm), EyeCamera(middle, kEyeDistanceMm / 2, kDistanceMm)};
}

Result Measure(const fs::path& file, const Avatar& avatar, const Arguments& arguments) {
  Team::Options threads;
  threads.threads = std::min(ThreadCount(), 64);
  const auto team = std::make_shared<Team>(threads);
  DecoderOptions decoding;
  decoding.team = team;
  const auto decoder = Decoder::Open(file, decoding);
  FrameRendererOptions drawing;
  drawing.team = team;
  drawing.anti_alias = arguments.anti_alias;
  const int size = avatar.architecture.texture_size;
  FrameRenderer renderer(avatar.topology, size, drawing);

  const int64_t texture_bytes = int64_t{4} * size * size, row_bytes = int64_t{4} * arguments.width;
  std::vector<uint8_t> textures[2], pictures[2];
  std::vector<float> vertices(static_cast<size_t>(avatar.architecture.vertex_count) * 3);
  std::vector<Decoder::View> decoded;
  std::vector<FrameRenderer::View> drawn;
  for (const Camera& camera : EyeCameras(arguments, avatar)) {
    const size_t eye = decoded.size();
    textures[eye].resize(static_cast<size_t>(texture_bytes));
    pictures[eye].resize(static_cast<size_t>(row_bytes * arguments.height));
    const Eigen::Vector3f view = ViewVector(camera, {}).cast<float>();
    decoded.push_back({{view.x(), view.y(), view.z()}, textures[eye].data(), int64_t{4} * size});
    drawn.push_back({ProjectionOf(camera, {}), arguments.width, arguments.height, textures[eye].data(),
                     pictures[eye].data(), row_bytes});
  }

  Result result = {size,
                   avatar.architecture.vertex_count,
                   static_cast<int>(avatar.topology.triangles.size()),
                   team->threads(),
                   0,
                   decoder->kernel(),
                   renderer.kernel(),
                   {}};
  Codes codes(avatar, arguments.avatar.empty());
  constexpr int kWarm = 20;
  for (int frame = -kWarm; frame < arguments.frames; ++frame) {
    const std::vector<float>& code = codes.Next();
    const auto began = Clock::now();
    decoder->Decode(code, decoded, {vertices.data(), 12});
    const auto between = Clock::now();
    renderer.Draw(vertices, drawn);
    const auto ended = Clock::now();
    if (frame < 0) continue;
    const auto ms = [](Clock::duration time) { return std::chrono::duration<double, std::milli>(time).count(); };
    result.times.decode.push_back(ms(between - began));
    result.times.mip_maps.push_back(renderer.times().mip_maps_ms);
    result.times.vertices.push_back(renderer.times().vertices_ms);
    result.times.raster.push_back(renderer.times().raster_ms);
    result.times.frame.push_back(ms(ended - began));
  }
  int64_t lit = 0;
  for (const std::vector<uint8_t>& picture : pictures) {
    for (size_t i = 0; i < picture.size(); i += 4) lit += (picture[i] | picture[i + 1] | picture[i + 2]) != 0;
  }
  result.covered = static_cast<double>(lit) / (2.0 * arguments.width * arguments.height);
  return result;
}

std::vector<Result> MeasureAll(const Arguments& arguments) {
  if (!arguments.avatar.empty()) {
    const fs::path file = AvatarFile(arguments.avatar);
    return {Measure(file, LoadAvatar(file), arguments)};
  }
  std::vector<Result> results;
  const fs::path file = fs::temp_directory_path() / fmt::format("likeness-bench-frame-{}.safetensors", getpid());
  for (const int size : {1024, 512, 256}) {
    const Avatar avatar = RandomHead(size);
    SaveAvatar(file, avatar);
    results.push_back(Measure(file, avatar, arguments));
    fs::remove(file);
  }
  return results;
}

double ShareInTime(const Result& result) {
  const std::vector<double>& frames = result.times.frame;
  const auto in_time = std::count_if(frames.begin(), frames.end(), [](double ms) { return ms <= kFrameMs; });
  return static_cast<double>(in_time) / static_cast<double>(frames.size());
}

const std::pair<const char*, std::vector<double> Times::*> kStages[] = {{"decode", &Times::decode},
                                                                        {"mip_maps", &Times::mip_maps},
                                                                        {"vertices", &Times::vertices},
                                                                        {"raster", &Times::raster},
                                                                        {"frame", &Times::frame}};

void PrintJson(const std::vector<Result>& results, const Arguments& arguments) {
  nlohmann::ordered_json json = nlohmann::json::array();
  for (const Result& r : results) {
    nlohmann::ordered_json stages;
    for (const auto& [name, times] : kStages) {
      const std::vector<double>& values = r.times.*times;
      stages[name] = {{"median_ms", Quantile(values, 0.5)},
                      {"p90_ms", Quantile(values, 0.9)},
                      {"p99_ms", Quantile(values, 0.99)},
                      {"least_ms", Quantile(values, 0)}};
    }
    json.push_back({{"texture", r.texture_size},
                    {"vertices", r.vertices},
                    {"triangles", r.triangles},
                    {"width", arguments.width},
                    {"height", arguments.height},
                    {"covered", r.covered},
                    {"threads", r.threads},
                    {"decode_kernel", r.decode_kernel},
                    {"draw_kernel", r.draw_kernel},
                    {"frames", r.times.frame.size()},
                    {"stages", stages},
                    {"within_11_1_ms", ShareInTime(r)}});
  }
  fmt::print("{}\n", json.dump(2));
}

void PrintText(const std::vector<Result>& results, const Arguments& arguments) {
  for (const Result& r : results) {
    fmt::print("texture {0} x {0}, {1} triangles, 2 x {2} x {3} pixels ({4:.0f}% covered), {5} threads, {6} and {7}\n",
               r.texture_size, r.triangles, arguments.width, arguments.height, 100 * r.covered, r.threads,
               r.decode_kernel, r.draw_kernel);
    fmt::print("  {:<10}{:>9}{:>9}{:>9}{:>9}\n", "ms", "median", "p90", "p99", "least");
    for (const auto& [name, times] : kStages) {
      const std::vector<double>& values = r.times.*times;
      fmt::print("  {:<10}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}\n", name, Quantile(values, 0.5), Quantile(values, 0.9),
                 Quantile(values, 0.99), Quantile(values, 0));
    }
    fmt::print("  {:.1f}% of {} frames within 11.1 ms\n", 100 * ShareInTime(r), r.times.frame.size());
  }
}

}  // namespace

int RunBenchFrame(int argc, const char* const* argv) {
  Arguments arguments;
  Command command("bench frame", "Times whole stereo frames: decoded for each eye, and drawn on the processor.",
                  "likeness bench frame avatars/demo --json");
  command.Positional("AVATAR", &arguments.avatar,
                     "avatar file or training folder, whose codes are played (default: random networks of three sizes "
                     "on a procedural head)",
                     false);
  command.Option("frames", &arguments.frames, "to measure");
  command.Option("width", &arguments.width, "pixels of an eye's picture");
  command.Option("height", &arguments.height, "pixels");
  command.Option("head", &arguments.share, "share of the picture's height that the head fills");
  command.Option("anti-alias", &arguments.anti_alias, "eight samples a pixel");
  command.Option("json", &arguments.json, "write the results as JSON");
  if (!command.Parse(argc, argv)) return 0;
  if (arguments.frames < 1) throw UsageError("--frames is at least 1");
  if (!(arguments.share > 0 && arguments.share <= 10)) throw UsageError("--head is more than 0, and at most 10");
  const std::vector<Result> results = MeasureAll(arguments);
  if (arguments.json) {
    PrintJson(results, arguments);
  } else {
    PrintText(results, arguments);
  }
  return 0;
}

}  // namespace likeness
