// The run-time decoder opens avatar files whose header is any text and whose data are zeros; small ones are decoded.

#include <cmath>
#include <vector>

#include "fuzz.h"
#include "likeness/decode/decoder.h"
#include "zero_tensors.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  DecoderOptions options;
  options.kernel = "portable";
  options.threads = 1;
  constexpr int kMostSize = 64, kMostLatent = 64;
  const std::string file = WithZeroTensors(bytes);
  const auto network =
      Parsed([&] { return NetworkFrom(SafetensorsFile(kPath, file, nullptr), options.display, 0).architecture; });
  if (!network || network->texture_size > kMostSize || network->latent > kMostLatent) return;
  Decoder decoder(SafetensorsFile(kPath, file, nullptr), options);
  const int64_t row = network->texture_size * int64_t{8};
  std::vector<uint8_t> pixels(static_cast<size_t>(row * network->texture_size));
  std::vector<float> vertices(static_cast<size_t>(network->vertex_count) * 3);
  const Decoder::View view{{0, 0, 1}, pixels.data(), row};
  decoder.Decode(decoder.mean_code(), {&view, 1}, {vertices.data(), 12}, PixelFormat::kRgba16F);
  // Weights are zero: only what the mean texture and the biases hold is left, which is zero too.
  for (const float v : vertices) LIKENESS_CHECK(v == 0);
}

}  // namespace likeness
