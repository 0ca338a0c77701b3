#include "likeness/base/random.h"

#include <cmath>
#include <numbers>

namespace likeness {
namespace {

// The finaliser of SplitMix64.
uint64_t Mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

}  // namespace

Random::Random(uint64_t seed, uint64_t stream) : state_(0), increment_(Mix(stream) | 1) {
  Next();
  state_ += Mix(seed);
  Next();
}

uint32_t Random::Next() {
  const uint64_t old = state_;
  state_ = old * 6364136223846793005ull + increment_;
  const auto shifted = static_cast<uint32_t>(((old >> 18) ^ old) >> 27);
  const auto rotation = static_cast<uint32_t>(old >> 59);
  return (shifted >> rotation) | (shifted << ((32 - rotation) & 31));
}

double Random::Uniform() { return Next() * 0x1p-32; }

double Random::Uniform(double a, double b) { return a + (b - a) * Uniform(); }

int64_t Random::Below(int64_t n) {
  const uint64_t high = Next();
  return static_cast<int64_t>(((high << 32) | Next()) % static_cast<uint64_t>(n));
}

double Random::Normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  // Box and Muller.
  const double radius = std::sqrt(-2 * std::log(1 - Uniform()));
  const double angle = 2 * std::numbers::pi * Uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

uint64_t Hash(std::initializer_list<uint64_t> values) {
  uint64_t hash = 0x9e3779b97f4a7c15ull;
  for (const uint64_t value : values) hash = Mix(hash ^ Mix(value + 0x9e3779b97f4a7c15ull));
  return hash;
}

uint64_t Hash(std::string_view text) {
  uint64_t hash = Mix(text.size());
  for (const char c : text) hash = Mix(hash ^ static_cast<unsigned char>(c));
  return hash;
}

}  // namespace likeness
