#include "likeness/train/render/bench.h"

#include <ATen/Parallel.h>
#include <torch/types.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/train/ops/masked_loss.h"
#include "likeness/train/render/rasterise.h"
#include "likeness/train/render/shade.h"

namespace likeness {
namespace {

constexpr int kAround = 120, kDown = 60;  // 14,400 triangles, as a head has

struct Ball {
  Vertices vertices;
  MeshTopology topology;

  Ball() {
    topology.vertex_count = (kAround + 1) * (kDown + 1);
    vertices.resize(topology.vertex_count, 3);
    for (int j = 0; j <= kDown; ++j) {
      for (int i = 0; i <= kAround; ++i) {
        const double turn = 2 * M_PI * i / kAround, polar = M_PI * j / kDown;
        const double radius = 90 + 6 * std::sin(9 * turn) * std::sin(8 * polar);
        vertices.row(j * (kAround + 1) + i) << static_cast<float>(radius * std::sin(polar) * std::sin(turn)),
            static_cast<float>(1.3 * radius * std::cos(polar)),
            static_cast<float>(radius * std::sin(polar) * std::cos(turn));
        topology.uvs.emplace_back(static_cast<float>(i) / kAround, 1 - static_cast<float>(j) / kDown);
      }
    }
    for (int j = 0; j < kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const int a = j * (kAround + 1) + i, below = a + kAround + 1;
        topology.triangles.emplace_back(a, below, below + 1);
        topology.triangles.emplace_back(a, below + 1, a + 1);
      }
    }
    topology.triangle_uvs = topology.triangles;
  }
};

torch::Tensor RandomCrops(const Ball& ball, const RenderBenchOptions& options) {
  Random random(options.seed);
  std::vector<PixelFromMesh> projections;
  for (int i = 0; i < options.crops; ++i) {
    const double turn = random.Uniform(-1.3, 1.3), lift = random.Uniform(-0.4, 0.4);
    const Eigen::Vector3d centre =
        1100 * Eigen::Vector3d(std::cos(lift) * std::sin(turn), std::sin(lift), std::cos(lift) * std::cos(turn));
    const Camera camera = LookAt(centre, {0, 0, 0}, {0, 1, 0}, 7700, 1334, 2048);
    // Around a vertex that faces the camera.
    Eigen::Vector3d point;
    do {
      point = ball.vertices.row(random.Below(ball.vertices.rows())).transpose().cast<double>();
    } while (point.dot(centre) < 0);
    const Eigen::Vector2d pixel = camera.Project(point);
    projections.push_back(ProjectionOf(camera, {}, static_cast<int>(pixel.x()) - options.crop / 2,
                                       static_cast<int>(pixel.y()) - options.crop / 2));
  }
  return Projections(projections);
}

class Times {
 public:
  void Measure(const std::function<void()>& call) {
    const auto begin = std::chrono::steady_clock::now();
    const double processor = ProcessorMs();
    call();
    processor_.push_back(ProcessorMs() - processor);
    wall_.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }

  // Without the first.
  RunTime Median() const { return {MedianOf(wall_), MedianOf(processor_)}; }

 private:
  static double ProcessorMs() {
    timespec time = {};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
  }
  static double MedianOf(std::vector<double> values) {
    std::sort(values.begin() + 1, values.end());
    return values[1 + (values.size() - 1) / 2];
  }

  std::vector<double> wall_, processor_;
};

using ShadeFunction = torch::Tensor (*)(const torch::Tensor&, const torch::Tensor&, const torch::Tensor&,
                                        const RenderTopology&, const torch::Tensor&);

torch::Tensor Plain(const torch::Tensor& triangle, const torch::Tensor& texture, const torch::Tensor& vertices,
                    const RenderTopology& topology, const torch::Tensor& projections) {
  return ShadePlain(triangle, texture, vertices, topology, projections);
}

// Of the first crop's image, in some precision, to its texture and vertices.
struct Gradients {
  torch::Tensor texture, vertices;

  Gradients(ShadeFunction shade, torch::ScalarType type, const torch::Tensor& triangle,
            const torch::Tensor& all_textures, const torch::Tensor& all_vertices, const Ball& ball,
            const torch::Tensor& projections, const torch::Tensor& target) {
    const auto first = [&](const torch::Tensor& t) { return t.detach().narrow(0, 0, 1).to(type); };
    const torch::Tensor a = first(all_textures).requires_grad_(), b = first(all_vertices).requires_grad_();
    const torch::Tensor image =
        shade(triangle.narrow(0, 0, 1), a, b, RenderTopology(ball.topology, type), projections.narrow(0, 0, 1));
    (image - first(target)).square().sum().backward();
    texture = a.grad();
    vertices = b.grad();
  }

  // The larger of the two's distances from another's, in parts of its norm.
  double DistanceFrom(const Gradients& other) const {
    const auto distance = [](const torch::Tensor& x, const torch::Tensor& y) {
      return (x - y).norm().item<double>() / y.norm().item<double>();
    };
    return std::max(distance(texture, other.texture), distance(vertices, other.vertices));
  }
};

}  // namespace

void RenderBenchOptions::Check() const {
  const auto in_range = [](const char* name, int value, int least, int most) {
    if (value < least || value > most) throw Error("--{} is {}; expected {} to {}", name, value, least, most);
  };
  in_range("crops", crops, 1, 1024);
  in_range("crop", crop, 1, 4096);
  in_range("texture", texture, 1, 8192);
  in_range("runs", runs, 1, 1000);
}

RenderBenchResult BenchRenderLoss(const RenderBenchOptions& options) {
  options.Check();
  at::set_num_threads(ThreadCount());
  torch::manual_seed(static_cast<int64_t>(options.seed));
  const Ball ball;
  const RenderTopology topology(ball.topology, torch::kFloat32);
  const torch::Tensor projections = RandomCrops(ball, options);
  const auto last = torch::MemoryFormat::ChannelsLast;  // as the network gives textures
  const int64_t n = options.crops, side = options.texture, crop = options.crop;
  torch::Tensor texture = torch::rand({n, 3, side, side}).contiguous(last).requires_grad_();
  torch::Tensor vertices = torch::empty({n, ball.vertices.rows(), 3});
  for (int64_t i = 0; i < n; ++i) {
    std::copy_n(ball.vertices.data(), ball.vertices.size(), vertices[i].mutable_data_ptr<float>());
  }
  vertices.requires_grad_();
  const torch::Tensor target = torch::rand({n, 3, crop, crop}).contiguous(last);

  RenderBenchResult result;
  result.threads = at::get_num_threads();
  result.vertices = ball.vertices.rows();
  result.triangles = static_cast<int64_t>(ball.topology.triangles.size());
  Times rasterise, forward, backward, plain_forward, plain_backward;
  torch::Tensor triangle, mask, loss;
  const auto forget = [&] {
    texture.mutable_grad().reset();
    vertices.mutable_grad().reset();
  };
  for (int run = 0; run <= options.runs; ++run) {
    rasterise.Measure(
        [&] { triangle = RasteriseTriangles(vertices, topology, projections, options.crop, options.crop); });
    mask = (triangle >= 0).unsqueeze(1).to(torch::kFloat32);
    forward.Measure([&] {
      loss = MaskedSquaredError(ShadeFused(triangle, texture, vertices, topology, projections), target, mask);
    });
    backward.Measure([&] { loss.backward(); });
    forget();
    plain_forward.Measure([&] {
      loss = ((ShadePlain(triangle, texture, vertices, topology, projections) - target) * mask).square().mean();
    });
    plain_backward.Measure([&] { loss.backward(); });
    if (run == 0) {
      result.covered = mask.mean().item<double>();
      const auto gradients = [&](ShadeFunction shade, torch::ScalarType type) {
        return Gradients(shade, type, triangle, texture, vertices, ball, projections, target);
      };
      const Gradients truth = gradients(Plain, torch::kFloat64);
      result.gradient_error = gradients(ShadeFused, torch::kFloat32).DistanceFrom(truth);
      result.plain_gradient_error = gradients(Plain, torch::kFloat32).DistanceFrom(truth);
    }
    loss.reset();
    forget();
  }
  result.rasterise = rasterise.Median();
  result.forward = forward.Median();
  result.backward = backward.Median();
  result.plain_forward = plain_forward.Median();
  result.plain_backward = plain_backward.Median();
  return result;
}

}  // namespace likeness
