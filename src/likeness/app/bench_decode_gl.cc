// likeness bench decode --kernel gl

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "likeness/app/bench_decode.h"
#include "likeness/base/quantile.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/gl_decoder.h"
#include "likeness/gl/offscreen.h"

namespace likeness {
namespace {

using Clock = std::chrono::steady_clock;

struct Row {
  int views = 0;
  std::vector<double> clock_ms, gpu_ms;
  double psnr_db = 0;
  std::vector<GlLayerCost> layers;
};

std::vector<std::array<float, 3>> Views(int count) {
  const float z = std::sqrt(1 - kEyeX * kEyeX);
  std::vector<std::array<float, 3>> views = {{-kEyeX, 0, z}, {kEyeX, 0, z}};
  views.resize(static_cast<size_t>(count));
  return views;
}

// The first view by the portable kernel.
std::vector<uint8_t> TruthOf(const std::filesystem::path& file) {
  DecoderOptions options;
  options.kernel = "portable";
  const auto decoder = Decoder::Open(file, options);
  const int64_t size = decoder->architecture().texture_size;
  std::vector<uint8_t> pixels(static_cast<size_t>(4 * size * size));
  const std::array<float, 3> view = Views(1)[0];
  const Decoder::View where = {{view[0], view[1], view[2]}, pixels.data(), 4 * size};
  decoder->Decode(decoder->mean_code(), {&where, 1}, {});
  return pixels;
}

// Each frame is waited for: by the clock from the call to its end, on the GPU from its first dispatch to its last.
Row Measure(const GlFunctions& gl, GlDecoder& decoder, int view_count, double seconds,
            const std::vector<uint8_t>& truth) {
  const std::vector<std::array<float, 3>> views = Views(view_count);
  const bool mesh = view_count == 2;
  const GlQuery begin = MakeQuery(gl), end = MakeQuery(gl);
  Row row;
  row.views = view_count;
  row.layers = decoder.Costs(view_count, mesh);
  constexpr int kWarmUp = 3, kLeast = 5;
  Clock::time_point since;
  for (int frame = -kWarmUp;; ++frame) {
    if (frame == 0) since = Clock::now();
    if (frame >= kLeast && Clock::now() - since > std::chrono::duration<double>(seconds)) break;
    const auto called = Clock::now();
    gl.QueryCounter(begin.id(), GL_TIMESTAMP);
    decoder.Decode(decoder.mean_code(), views, mesh);
    gl.QueryCounter(end.id(), GL_TIMESTAMP);
    gl.Finish();
    const double clock_ms = std::chrono::duration<double, std::milli>(Clock::now() - called).count();
    GLuint64 first = 0, last = 0;
    gl.GetQueryObjectui64v(begin.id(), GL_QUERY_RESULT, &first);
    gl.GetQueryObjectui64v(end.id(), GL_QUERY_RESULT, &last);
    if (frame < 0) continue;
    row.clock_ms.push_back(clock_ms);
    row.gpu_ms.push_back(1e-6 * static_cast<double>(last - first));
  }
  const int size = decoder.architecture().texture_size;
  row.psnr_db = PsnrDb(ReadTexture(gl, decoder.texture(0), size, size), truth);
  CheckGlErrors(gl, "decoding");
  return row;
}

GlLayerCost Total(const std::vector<GlLayerCost>& layers) {
  GlLayerCost total;
  total.name = "in all";
  for (const GlLayerCost& layer : layers) {
    total.flops += layer.flops;
    total.weight_bytes += layer.weight_bytes;
    total.bias_bytes += layer.bias_bytes;
    total.feature_bytes += layer.feature_bytes;
  }
  return total;
}

nlohmann::ordered_json JsonOf(const Row& row, const std::string& renderer, bool half) {
  const GlLayerCost total = Total(row.layers);
  nlohmann::ordered_json layers = nlohmann::json::array();
  for (const GlLayerCost& layer : row.layers) {
    layers.push_back({{"name", layer.name},
                      {"gflop", 1e-9 * layer.flops},
                      {"weight_mbytes", 1e-6 * layer.weight_bytes},
                      {"bias_mbytes", 1e-6 * layer.bias_bytes},
                      {"feature_mbytes", 1e-6 * layer.feature_bytes}});
  }
  return {{"kernel", half ? "gl half" : "gl float"},
          {"renderer", renderer},
          {"views", row.views},
          {"mesh", row.views == 2},
          {"median_ms", Quantile(row.clock_ms, 0.5)},
          {"p90_ms", Quantile(row.clock_ms, 0.9)},
          {"p99_ms", Quantile(row.clock_ms, 0.99)},
          {"least_ms", Quantile(row.clock_ms, 0)},
          {"gpu_median_ms", Quantile(row.gpu_ms, 0.5)},
          {"gpu_p99_ms", Quantile(row.gpu_ms, 0.99)},
          {"psnr_db", row.psnr_db},
          {"mbytes", 1e-6 * (total.weight_bytes + total.bias_bytes + total.feature_bytes)},
          {"gflop", 1e-9 * total.flops},
          {"layers", layers}};
}

void PrintText(const std::vector<Row>& rows, const std::string& renderer, bool half) {
  fmt::print("{}, {} storage\n\n", renderer, half ? "half" : "float");
  fmt::print("{:>5}{:>10}{:>8}{:>8}{:>8}{:>12}{:>9}\n", "views", "median", "p90", "p99", "least", "GPU median", "PSNR");
  for (const Row& row : rows) {
    fmt::print("{:>5}{:>10.3f}{:>8.3f}{:>8.3f}{:>8.3f}{:>12.3f}{:>9.1f}\n", row.views, Quantile(row.clock_ms, 0.5),
               Quantile(row.clock_ms, 0.9), Quantile(row.clock_ms, 0.99), Quantile(row.clock_ms, 0),
               Quantile(row.gpu_ms, 0.5), row.psnr_db);
  }
  fmt::print("\nmilliseconds until the frame is done; two views with the mesh, one without\n");
  for (const Row& row : rows) {
    fmt::print("\n{:<16}{:>9}{:>13}{:>12}{:>14}\n", fmt::format("{} view{}", row.views, row.views == 1 ? "" : "s"),
               "GFLOP", "weights, MB", "biases, MB", "features, MB");
    std::vector<GlLayerCost> layers = row.layers;
    layers.push_back(Total(row.layers));
    for (const GlLayerCost& layer : layers) {
      fmt::print("{:<16}{:>9.4f}{:>13.3f}{:>12.3f}{:>14.3f}\n", layer.name, 1e-9 * layer.flops,
                 1e-6 * layer.weight_bytes, 1e-6 * layer.bias_bytes, 1e-6 * layer.feature_bytes);
    }
  }
}

}  // namespace

void BenchDecodeOnGl(const std::filesystem::path& avatar_file, double seconds, bool json) {
  const OffscreenContext context(4, 3);
  const GlFunctions& gl = context.gl();
  const std::vector<uint8_t> truth = TruthOf(avatar_file);
  const auto decoder = GlDecoder::Open(gl, avatar_file);
  std::vector<Row> rows;
  for (const int views : {1, 2}) rows.push_back(Measure(gl, *decoder, views, seconds, truth));
  if (!json) return PrintText(rows, gl.renderer, decoder->half());
  nlohmann::ordered_json all = nlohmann::json::array();
  for (const Row& row : rows) all.push_back(JsonOf(row, gl.renderer, decoder->half()));
  fmt::print("{}\n", all.dump(2));
}

}  // namespace likeness
