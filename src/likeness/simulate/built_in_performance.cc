#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/simulate/expressions.h"
#include "likeness/simulate/performance.h"
#include "likeness/simulate/speech.h"

namespace likeness {
namespace {

using Weights = std::array<float, kExpressionCount>;

constexpr int kMostFrames = 1000000;
constexpr size_t kHeldOutSentences = 10;  // of the full performance

// 0 ... 1: how far sample k of n is into an expression that comes and goes; its peak is among the samples.
float Envelope(int k, int n) {
  const double t = (k + 1.0) / (n % 2 == 1 ? n + 1 : n + 2);
  return static_cast<float>(std::pow(std::sin(std::numbers::pi * t), 0.8));
}

// The same for a segment that begins and ends with the neutral face, if it is long enough.
float NeutralToNeutral(int k, int n) {
  if (n < 3) return Envelope(k, n);
  const int peak = (n - 1) / 2;
  const double part = k <= peak ? static_cast<double>(k) / peak : static_cast<double>(n - 1 - k) / (n - 1 - peak);
  return static_cast<float>(0.5 - 0.5 * std::cos(std::numbers::pi * part));
}

// Looks about, lifts brows and blinks, as people do while they speak.
class Liveliness {
 public:
  explicit Liveliness(uint64_t seed) : seed_(seed) {}

  void Apply(double time_s, Weights* weights) const {
    // A new point to look at every 0.8 s; eyes jump.
    Random look(seed_, Hash({Hash("gaze"), static_cast<uint64_t>(time_s / 0.8)}));
    const double left = 0.35 * look.Normal(), up = 0.2 * look.Normal();
    Set("eyeLookOutLeft", left, weights);
    Set("eyeLookInRight", left, weights);
    Set("eyeLookInLeft", -left, weights);
    Set("eyeLookOutRight", -left, weights);
    for (const char* side : {"Left", "Right"}) {
      Set(std::string("eyeLookUp") + side, up, weights);
      Set(std::string("eyeLookDown") + side, -up, weights);
    }
    // A blink of 0.25 s at a random time of every 2.5 s.
    constexpr double kEvery = 2.5, kBlink = 0.25;
    Random when(seed_, Hash({Hash("blink"), static_cast<uint64_t>(time_s / kEvery)}));
    const double start = when.Uniform(0, kEvery - kBlink), into = std::fmod(time_s, kEvery) - start;
    if (into > 0 && into < kBlink) {
      const double closed = std::min(1.0, 1.4 * std::sin(std::numbers::pi * into / kBlink));
      for (const char* side : {"Left", "Right"}) Set(std::string("eyeBlink") + side, closed, weights);
    }
    Random brow(seed_, Hash("brow"));
    const double lift = 0.45 * std::sin(2 * std::numbers::pi * 0.31 * time_s + brow.Uniform(0, 6.28)) - 0.1;
    Set("browInnerUp", lift, weights);
    Set("browOuterUpLeft", 0.7 * lift, weights);
    Set("browOuterUpRight", 0.7 * lift, weights);
  }

 private:
  static void Set(const std::string& name, double weight, Weights* weights) {
    float& w = (*weights)[static_cast<size_t>(ExpressionIndex(name))];
    w = std::max(w, static_cast<float>(std::clamp(weight, 0.0, 1.0)));
  }

  uint64_t seed_;
};

class Builder {
 public:
  explicit Builder(uint64_t seed) : seed_(seed), head_motion_(seed), liveliness_(seed) {}

  // `expressions` of them, the neutral face first.
  void AddExpressions(int frames, int expressions) {
    const PeakExpression neutral = {"neutral", {}};
    for (int i = 0; i < expressions; ++i) {
      const PeakExpression& expression = i == 0 ? neutral : PeakExpressions()[static_cast<size_t>(i) - 1];
      const int n = frames / expressions + (i < frames % expressions ? 1 : 0);
      PerformanceSegment& segment = Begin("EXP_" + expression.name, false);
      for (int k = 0; k < n; ++k) {
        Weights weights = {};
        AddExpression(expression, Envelope(k, n), &weights);
        Add(&segment, weights, 0.2);
      }
    }
  }

  // From the neutral face to the peak and back, in two seconds.
  void AddPeak(const PeakExpression& expression, int frames) {
    PerformanceSegment& segment = Begin("EXP_" + expression.name, false);
    for (int k = 0; k < frames; ++k) {
      Weights weights = {};
      AddExpression(expression, NeutralToNeutral(k, frames), &weights);
      Add(&segment, weights, 2.0 / frames);
    }
  }

  void AddSentence(const Sentence& sentence, int frames, bool held_out) {
    PerformanceSegment& segment = Begin(sentence.name, held_out);
    const double step = SentenceDuration(sentence) / frames;
    for (int k = 0; k < frames; ++k) {
      Weights weights = SpeechWeights(sentence, (k + 0.5) * step);
      liveliness_.Apply(time_s_, &weights);
      Add(&segment, weights, step);
    }
  }

  // Two of the first `expressions` (0 is the neutral face) at a time, at most as strong as their peaks.
  void AddFreeFace(int frames, int expressions) {
    PerformanceSegment& segment = Begin("EXP_free_face", true);
    Random random(seed_, Hash("free face"));
    for (int k = 0; k < frames; ++k) {
      Weights weights = {};
      const double share = random.Uniform(0.25, 0.75);
      for (const double amount : {share, 1 - share}) {
        const auto i = static_cast<size_t>(random.Below(expressions));
        if (i > 0) AddExpression(PeakExpressions()[i - 1], static_cast<float>(amount), &weights);
      }
      Add(&segment, weights, 0.3);
    }
  }

  SimulatedPerformance Finish() { return std::move(performance_); }

 private:
  PerformanceSegment& Begin(std::string name, bool held_out) {
    time_s_ += 1;
    return performance_.segments.emplace_back(PerformanceSegment{std::move(name), held_out, {}});
  }

  // Time passes by `step` seconds, frame numbers at 30 a second.
  void Add(PerformanceSegment* segment, const Weights& weights, double step) {
    PerformanceFrame frame;
    frame.number = std::max(static_cast<int>(std::lround(30 * time_s_)), last_number_ + 1);
    frame.time_s = time_s_;
    frame.weights = weights;
    head_motion_.Apply(&frame);
    segment->frames.push_back(frame);
    last_number_ = frame.number;
    time_s_ += step;
  }

  uint64_t seed_;
  HeadMotion head_motion_;
  Liveliness liveliness_;
  SimulatedPerformance performance_;
  double time_s_ = 0;
  int last_number_ = 0;
};

}  // namespace

SimulatedPerformance BuiltInPerformance(int frames, uint64_t seed) {
  if (frames < 2 || frames > kMostFrames) throw Error("a performance has 2 to {} frames, not {}", kMostFrames, frames);
  const int held_out = std::max(1, static_cast<int>(std::lround(0.2 * frames)));
  const int training = frames - held_out;
  const int expression_frames = (training + 1) / 2, speech = training - expression_frames;
  const int held_out_speech = (held_out + 1) / 2;
  const auto& sentences = BuiltInSentences();
  const int expressions = std::min(expression_frames, static_cast<int>(PeakExpressions().size()) + 1);
  Builder builder(seed);
  builder.AddExpressions(expression_frames, expressions);
  // A sentence takes five frames or more before another begins.
  const int spoken = std::min(static_cast<int>(sentences.size()) - 1, (speech + 4) / 5);
  for (int i = 0; i < spoken; ++i) {
    builder.AddSentence(sentences[i], speech / spoken + (i < speech % spoken ? 1 : 0), false);
  }
  builder.AddSentence(sentences.back(), held_out_speech, true);
  if (held_out > held_out_speech) builder.AddFreeFace(held_out - held_out_speech, expressions);
  return builder.Finish();
}

SimulatedPerformance FullPerformance(int frames, uint64_t seed) {
  const auto& expressions = PeakExpressions();
  const auto& sentences = BuiltInSentences();
  // Shares of the frames: a sentence takes twice as long as an expression, the free face as long as ten sentences.
  constexpr int kSentence = 2, kFreeFace = 20;
  std::vector<int> parts(expressions.size(), 1);
  parts.insert(parts.end(), sentences.size(), kSentence);
  parts.push_back(kFreeFace);
  const int segments = static_cast<int>(parts.size()), all = std::accumulate(parts.begin(), parts.end(), 0);
  if (frames < segments || frames > kMostFrames) {
    throw Error("the full performance has {} segments, so it takes {} to {} frames, not {}; the short one takes fewer",
                segments, segments, kMostFrames, frames);
  }
  // One frame for each segment; the others by their shares, so that the sum is right.
  int64_t before = 0;
  const auto next_frames = [&](int part) {
    const int64_t extra = frames - segments, from = before * extra / all;
    before += part;
    return 1 + static_cast<int>(before * extra / all - from);
  };
  Builder builder(seed);
  for (size_t i = 0; i < expressions.size(); ++i) builder.AddPeak(expressions[i], next_frames(parts[i]));
  for (size_t i = 0; i < sentences.size(); ++i) {
    builder.AddSentence(sentences[i], next_frames(kSentence), i + kHeldOutSentences >= sentences.size());
  }
  builder.AddFreeFace(next_frames(kFreeFace), static_cast<int>(expressions.size()) + 1);
  return builder.Finish();
}

}  // namespace likeness
