#include "likeness/decode/accuracy.h"

#include <algorithm>
#include <cmath>

namespace likeness {

bool KernelAccuracy::Suffices() const { return psnr_db >= kLeastPsnrDb && largest_distance_mm <= kMostDistanceMm; }

std::vector<std::vector<float>> SampleCodes(const DecoderNetwork& network) {
  std::vector<std::vector<float>> codes = network.some_codes;
  codes.push_back(network.mean_code);
  return codes;
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
