#include "likeness/decode/decoder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "likeness/base/error.h"
#include "likeness/decode/frame_checks.h"
#include "likeness/decode/kernels.h"

namespace likeness {

namespace {

constexpr int kMostThreads = 64;

// What a plan makes of the sample frames.
Sample SampleOf(Plan& plan, Team& team, const DecoderNetwork& network) {
  const int64_t size = network.architecture.texture_size, vertices = network.architecture.vertex_count;
  const std::vector<SampleFrame> frames = SampleFrames(network);
  Sample sample;
  sample.pixels.resize(frames.size() * size * size * 4);
  sample.vertices.resize(frames.size() * vertices * 3);
  for (size_t i = 0; i < frames.size(); ++i) {
    FrameRequest request;
    request.code = frames[i].code.data();
    request.views = 1;
    std::copy_n(frames[i].direction.data(), 3, request.view[0]);
    request.pixels[0] = sample.pixels.data() + i * size * size * 4;
    request.row_bytes[0] = size * 4;
    request.vertices = sample.vertices.data() + i * vertices * 3;
    request.vertex_bytes = 12;
    plan.Decode(request, team);
  }
  return sample;
}

std::shared_ptr<Team> OwnTeam(const DecoderOptions& options) {
  Team::Options team;
  team.threads =
      options.threads > 0 ? options.threads : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
  team.pin = options.pin;
  team.spin_ms = options.spin_ms;
  team.parallel = options.parallel;
  team.pool = options.pool;
  return std::make_shared<Team>(team);
}

}  // namespace

void DecoderOptions::Check() const {
  if (threads < 0 || threads > kMostThreads) throw Error("threads is {}; expected 0 to {}", threads, kMostThreads);
  if (!(spin_ms >= 0 && spin_ms <= 1e6)) throw Error("spin_ms is {}; expected 0 to 1000000", spin_ms);
  CheckConditions(conditions);
  CheckDisplay(display);
  if (kernel != "auto") FindKernel(kernel);
}

std::unique_ptr<Decoder> Decoder::Open(const std::filesystem::path& avatar_file, const DecoderOptions& options) {
  return std::make_unique<Decoder>(SafetensorsFile::Map(avatar_file), options);
}

Decoder::Decoder(SafetensorsFile file, const DecoderOptions& options) {
  options.Check();
  const DecoderNetwork network = NetworkFrom(std::move(file), options.display, options.person, options.conditions);
  architecture_ = network.architecture;
  mean_code_ = network.mean_code;
  triangles_ = network.triangles;
  triangle_uvs_ = network.triangle_uvs;
  uvs_ = network.uvs;
  team_ = options.team != nullptr ? options.team : OwnTeam(options);
  ChoosePlan(network, options);
  kernel_ = plan_->kernel().name;
}

void Decoder::ChoosePlan(const DecoderNetwork& network, const DecoderOptions& options) {
  const int threads = team_->threads();
  if (options.kernel != "auto" && !FindKernel(options.kernel).fixed_point) {
    plan_ = std::make_unique<Plan>(network, FindKernel(options.kernel), threads);
    return;
  }
  // The fastest one in full precision that can represent the avatar, and those that are faster.
  std::vector<const Kernel*> faster;
  for (const Kernel* kernel : AvailableKernels()) {
    if (!kernel->full_precision) {
      if (plan_ == nullptr) faster.push_back(kernel);
      continue;
    }
    try {
      plan_ = std::make_unique<Plan>(network, *kernel, threads);
      break;
    } catch (const Error&) {
      continue;  // the next one: the plainest represents everything
    }
  }
  LIKENESS_CHECK(plan_ != nullptr);
  if (options.kernel != "auto") faster = {&FindKernel(options.kernel)};
  if (faster.empty()) return;
  plan_->MeasureRanges();
  const Sample truth = SampleOf(*plan_, *team_, network);
  const std::vector<float> ranges = plan_->TakeRanges();
  const auto plan_with = [&](const Kernel& kernel) {
    return std::make_unique<Plan>(network, kernel, threads, kernel.fixed_point ? ranges : std::vector<float>());
  };
  if (options.kernel != "auto") {
    plan_ = plan_with(*faster[0]);
    return;
  }
  for (const Kernel* kernel : faster) {
    try {
      std::unique_ptr<Plan> plan = plan_with(*kernel);
      const KernelAccuracy accuracy = Compare(SampleOf(*plan, *team_, network), truth);
      if (!accuracy.Suffices()) continue;
      accuracy_ = accuracy;
      checked_ = true;
      plan_ = std::move(plan);
      return;
    } catch (const Error&) {
      continue;
    }
  }
}

void Decoder::Decode(std::span<const float> code, std::span<const View> views, const Mesh& mesh, PixelFormat format) {
  CheckCode(code, architecture_);
  CheckViewCount(views.size());
  FrameRequest request;
  request.code = code.data();
  request.format = format;
  const int64_t row = static_cast<int64_t>(architecture_.texture_size) * (format == PixelFormat::kRgba8 ? 4 : 8);
  for (const View& view : views) {
    CheckDirection(view.direction);
    if (view.pixels == nullptr) throw Error("a view has no memory for its texture");
    if (view.row_bytes < row)
      throw Error("a texture's rows are {} bytes apart; expected at least {}", view.row_bytes, row);
    const int v = request.views++;
    std::copy_n(view.direction, 3, request.view[v]);
    request.pixels[v] = static_cast<uint8_t*>(view.pixels);
    request.row_bytes[v] = view.row_bytes;
  }
  if (mesh.vertices != nullptr && mesh.vertex_bytes < 12) {
    throw Error("vertices are {} bytes apart; expected at least 12", mesh.vertex_bytes);
  }
  request.vertices = mesh.vertices;
  request.vertex_bytes = mesh.vertex_bytes;
  plan_->Decode(request, *team_);
}

void Decoder::Jacobian(std::span<const float> code, std::span<const int> vertices, std::span<float> out) {
  CheckCode(code, architecture_);
  for (const int vertex : vertices) {
    if (vertex < 0 || vertex >= architecture_.vertex_count) {
      throw Error("there is no vertex {}; the mesh has {}", vertex, architecture_.vertex_count);
    }
  }
  const bool all = vertices.empty();
  const int count = all ? architecture_.vertex_count : static_cast<int>(vertices.size());
  const size_t expected = static_cast<size_t>(3) * count * architecture_.latent;
  if (out.size() != expected) throw Error("a Jacobian has {} values; expected room for {}", expected, out.size());
  plan_->Jacobian(code.data(), all ? nullptr : vertices.data(), count, out.data(), *team_);
}

}  // namespace likeness
