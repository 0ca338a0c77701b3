#include "likeness/decode/gl_decoder.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/decode/frame_checks.h"

namespace likeness {

namespace {

// What a plan makes of the sample frames, read back.
Sample SampleOf(const GlFunctions& gl, GlPlan& plan, const DecoderNetwork& network) {
  const int size = network.architecture.texture_size;
  Sample sample;
  for (const SampleFrame& frame : SampleFrames(network)) {
    plan.Decode(frame.code, {&frame.direction, 1}, true);
    const std::vector<uint8_t> pixels = ReadTexture(gl, plan.texture(0), size, size);
    const std::vector<float> vertices = ReadBuffer(gl, plan.vertices(), network.mesh.out);
    sample.pixels.insert(sample.pixels.end(), pixels.begin(), pixels.end());
    sample.vertices.insert(sample.vertices.end(), vertices.begin(), vertices.end());
  }
  return sample;
}

}  // namespace

void GlDecoderOptions::Check() const {
  if (storage != "auto" && storage != "half" && storage != "float") {
    throw Error("there is no storage '{}'; expected auto, half or float", storage);
  }
  CheckDisplay(display);
}

std::unique_ptr<GlDecoder> GlDecoder::Open(const GlFunctions& gl, const std::filesystem::path& avatar_file,
                                           const GlDecoderOptions& options) {
  options.Check();
  return std::make_unique<GlDecoder>(
      gl, NetworkFrom(SafetensorsFile::Map(avatar_file), options.display, options.person), options);
}

GlDecoder::GlDecoder(const GlFunctions& gl, const DecoderNetwork& network, const GlDecoderOptions& options) {
  options.Check();
  architecture_ = network.architecture;
  mean_code_ = network.mean_code;
  triangles_ = network.triangles;
  triangle_uvs_ = network.triangle_uvs;
  uvs_ = network.uvs;
  ChoosePlan(gl, network, options);
}

void GlDecoder::ChoosePlan(const GlFunctions& gl, const DecoderNetwork& network, const GlDecoderOptions& options) {
  plan_ = std::make_unique<GlPlan>(gl, network, GlStorage{options.storage != "float", options.format});
  if (options.storage != "auto") return;
  auto truth = std::make_unique<GlPlan>(gl, network, GlStorage{false, options.format});
  accuracy_ = Compare(SampleOf(gl, *plan_, network), SampleOf(gl, *truth, network));
  measured_ = accuracy_.Suffices();
  if (!measured_) plan_ = std::move(truth);
}

void GlDecoder::Decode(std::span<const float> code, std::span<const std::array<float, 3>> views, bool mesh) {
  CheckCode(code, architecture_);
  CheckViewCount(views.size());
  for (const std::array<float, 3>& view : views) CheckDirection(view.data());
  plan_->Decode(code, views, mesh);
}

}  // namespace likeness
