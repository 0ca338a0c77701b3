#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/simulate/performance.h"
#include "likeness/simulate/speech.h"

namespace likeness {
namespace {

using Weights = std::array<float, kExpressionCount>;

struct Expression {
  std::string name;
  std::vector<std::pair<std::string, float>> weights;  // "*" in a name stands for both sides
};

// The most different ones first: short performances take only those.
const std::vector<Expression>& Expressions() {
  static const std::vector<Expression> expressions = {
      {"neutral", {}},
      {"jaw_open", {{"jawOpen", 0.75f}}},
      {"smile_closed", {{"mouthSmile*", 0.8f}, {"cheekSquint*", 0.5f}, {"eyeSquint*", 0.3f}}},
      {"lips_pucker", {{"mouthPucker", 0.95f}}},
      {"eyes_closed", {{"eyeBlink*", 1}}},
      {"brows_up", {{"browInnerUp", 1}, {"browOuterUp*", 0.9f}, {"eyeWide*", 0.5f}}},
      {"anger", {{"browDown*", 1}, {"eyeSquint*", 0.5f}, {"mouthPress*", 0.6f}, {"noseSneer*", 0.4f}}},
      {"smile_open",
       {{"mouthSmile*", 0.95f},
        {"jawOpen", 0.25f},
        {"mouthUpperUp*", 0.4f},
        {"mouthLowerDown*", 0.3f},
        {"cheekSquint*", 0.7f}}},
      {"sadness", {{"mouthFrown*", 0.9f}, {"browInnerUp", 0.8f}, {"mouthShrugLower", 0.4f}}},
      {"surprise",
       {{"jawOpen", 0.5f}, {"mouthFunnel", 0.3f}, {"browInnerUp", 0.9f}, {"browOuterUp*", 0.9f}, {"eyeWide*", 0.9f}}},
      {"disgust", {{"noseSneer*", 0.9f}, {"mouthUpperUp*", 0.6f}, {"browDown*", 0.5f}, {"eyeSquint*", 0.5f}}},
      {"lips_funnel", {{"mouthFunnel", 0.9f}, {"jawOpen", 0.2f}}},
      {"grimace", {{"mouthStretch*", 0.9f}, {"mouthLowerDown*", 0.7f}, {"mouthUpperUp*", 0.3f}, {"jawOpen", 0.08f}}},
      {"gaze_left", {{"eyeLookOutLeft", 0.8f}, {"eyeLookInRight", 0.8f}}},
      {"gaze_right", {{"eyeLookOutRight", 0.8f}, {"eyeLookInLeft", 0.8f}}},
      {"gaze_up", {{"eyeLookUp*", 0.8f}, {"browInnerUp", 0.2f}}},
      {"gaze_down", {{"eyeLookDown*", 0.8f}, {"eyeBlink*", 0.15f}}},
      {"cheek_puff", {{"cheekPuff", 0.9f}, {"mouthPress*", 0.3f}}},
      {"mouth_left", {{"mouthLeft", 0.9f}}},
      {"mouth_right", {{"mouthRight", 0.9f}}},
      {"lips_roll_in", {{"mouthRollLower", 0.8f}, {"mouthRollUpper", 0.8f}}},
      {"jaw_wide_open", {{"jawOpen", 1}, {"mouthStretch*", 0.2f}, {"eyeSquint*", 0.3f}}},
      {"squint", {{"eyeSquint*", 1}, {"cheekSquint*", 0.7f}, {"eyeBlink*", 0.3f}}},
      {"wink_left", {{"eyeBlinkLeft", 1}, {"cheekSquintLeft", 0.7f}, {"mouthSmileLeft", 0.4f}}},
      {"wink_right", {{"eyeBlinkRight", 1}, {"cheekSquintRight", 0.7f}, {"mouthSmileRight", 0.4f}}},
      {"fear", {{"eyeWide*", 1}, {"browInnerUp", 1}, {"mouthStretch*", 0.6f}, {"jawOpen", 0.2f}}},
      {"jaw_left", {{"jawLeft", 0.9f}, {"jawOpen", 0.1f}}},
      {"jaw_right", {{"jawRight", 0.9f}, {"jawOpen", 0.1f}}},
      {"chin_raise", {{"mouthShrugLower", 0.9f}, {"mouthShrugUpper", 0.6f}}},
      {"upper_lip_raise", {{"mouthUpperUp*", 0.9f}}},
      {"lower_lip_down", {{"mouthLowerDown*", 0.9f}}},
      {"tongue_out", {{"tongueOut", 0.9f}, {"jawOpen", 0.45f}}},
      {"smirk_left", {{"mouthSmileLeft", 0.9f}, {"mouthDimpleLeft", 0.5f}}},
      {"smirk_right", {{"mouthSmileRight", 0.9f}, {"mouthDimpleRight", 0.5f}}},
      {"brow_left", {{"browOuterUpLeft", 1}, {"browDownRight", 0.6f}}},
      {"brow_right", {{"browOuterUpRight", 1}, {"browDownLeft", 0.6f}}},
      {"jaw_forward", {{"jawForward", 0.9f}}},
  };
  return expressions;
}

void AddExpression(const Expression& expression, float amount, Weights* weights) {
  const auto add = [&](const std::string& name, float weight) {
    float& w = (*weights)[static_cast<size_t>(ExpressionIndex(name))];
    w = std::clamp(w + amount * weight, 0.0f, 1.0f);
  };
  for (const auto& [name, weight] : expression.weights) {
    if (name.ends_with('*')) {
      add(name.substr(0, name.size() - 1) + "Left", weight);
      add(name.substr(0, name.size() - 1) + "Right", weight);
    } else {
      add(name, weight);
    }
  }
}

// 0 ... 1: how far sample k of n is into an expression that comes and goes; its peak is among the samples.
float Envelope(int k, int n) {
  const double t = (k + 1.0) / (n % 2 == 1 ? n + 1 : n + 2);
  return static_cast<float>(std::pow(std::sin(std::numbers::pi * t), 0.8));
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

  void AddExpressions(int frames) {
    const auto& expressions = Expressions();
    const int count = std::min(frames, static_cast<int>(expressions.size()));
    for (int i = 0; i < count; ++i) {
      const int n = frames / count + (i < frames % count ? 1 : 0);
      PerformanceSegment& segment = Begin("EXP_" + expressions[i].name, false);
      for (int k = 0; k < n; ++k) {
        Weights weights = {};
        AddExpression(expressions[i], Envelope(k, n), &weights);
        Add(&segment, weights, 0.2);
      }
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

  // Two expressions at a time, at most as strong as their peaks.
  void AddFreeFace(int frames, int expressions) {
    PerformanceSegment& segment = Begin("EXP_free_face", true);
    Random random(seed_, Hash("free face"));
    for (int k = 0; k < frames; ++k) {
      Weights weights = {};
      const double share = random.Uniform(0.25, 0.75);
      AddExpression(Expressions()[random.Below(expressions)], static_cast<float>(share), &weights);
      AddExpression(Expressions()[random.Below(expressions)], static_cast<float>(1 - share), &weights);
      Add(&segment, weights, 0.3);
    }
  }

  Performance Finish() { return std::move(performance_); }

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
  Performance performance_;
  double time_s_ = 0;
  int last_number_ = 0;
};

}  // namespace

Performance BuiltInPerformance(int frames, uint64_t seed) {
  if (frames < 2 || frames > 100000) throw Error("a performance has 2 to 100000 frames, not {}", frames);
  const int held_out = std::max(1, static_cast<int>(std::lround(0.2 * frames)));
  const int training = frames - held_out;
  const int expressions = (training + 1) / 2, speech = training - expressions;
  const int held_out_speech = (held_out + 1) / 2;
  const auto& sentences = BuiltInSentences();
  Builder builder(seed);
  builder.AddExpressions(expressions);
  // A sentence takes five frames or more before another begins.
  const int spoken = std::min(static_cast<int>(sentences.size()) - 1, (speech + 4) / 5);
  for (int i = 0; i < spoken; ++i) {
    builder.AddSentence(sentences[i], speech / spoken + (i < speech % spoken ? 1 : 0), false);
  }
  builder.AddSentence(sentences.back(), held_out_speech, true);
  if (held_out > held_out_speech) {
    builder.AddFreeFace(held_out - held_out_speech, std::min<int>(expressions, Expressions().size()));
  }
  return builder.Finish();
}

}  // namespace likeness
