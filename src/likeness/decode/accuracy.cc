#include "likeness/decode/accuracy.h"

#include <algorithm>
#include <cmath>

namespace likeness {

bool KernelAccuracy::Suffices() const { return psnr_db >= kLeastPsnrDb && largest_distance_mm <= kMostDistanceMm; }

std::vector<SampleFrame> SampleFrames(const DecoderNetwork& network) {
  constexpr std::array<float, 3> kDirections[] = {
      {0, 0, 1}, {0.8f, 0, 0.6f}, {-0.8f, 0, 0.6f}, {0, 0.8f, 0.6f}, {0, -0.8f, 0.6f}};
  std::vector<std::vector<float>> codes = {network.mean_code};
  codes.insert(codes.end(), network.some_codes.begin(), network.some_codes.end());
  // Without codes of its own, some as large as the prior, a normal distribution, has them.
  for (int k = 1; network.some_codes.empty() && k <= 3; ++k) {
    std::vector<float> code = network.mean_code;
    for (size_t i = 0; i < code.size(); ++i) code[i] += (i >> (k - 1)) % 2 == 0 ? 1.0f : -1.0f;
    codes.push_back(code);
  }
  std::vector<SampleFrame> frames;
  for (const std::array<float, 3>& direction : kDirections) {
    frames.push_back({codes[frames.size() % codes.size()], direction});
  }
  return frames;
}

KernelAccuracy Compare(const Sample& sample, const Sample& truth) {
  double squares = 0, largest = 0;
  for (size_t i = 0; i < truth.pixels.size(); ++i) {
    const int difference = sample.pixels[i] - truth.pixels[i];
    squares += difference * difference;
  }
  for (size_t i = 0; i < truth.vertices.size(); i += 3) {
    double distance = 0;
    for (size_t k = i; k < i + 3; ++k) {
      const double difference = static_cast<double>(sample.vertices[k]) - truth.vertices[k];
      distance += difference * difference;
    }
    // A distance that is no number is the worst.
    largest = distance <= largest ? largest : distance;
  }
  const double mean = squares / (static_cast<double>(truth.pixels.size()) * 3 / 4);  // opacity is always equal
  return {mean > 0 ? 10 * std::log10(255 * 255 / mean) : 100, std::sqrt(largest)};
}

}  // namespace likeness
