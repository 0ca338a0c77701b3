#include "likeness/simulate/performance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/simulate/expressions.h"
#include "likeness/simulate/live_link.h"
#include "likeness/simulate/speech.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

float WeightOf(const std::array<float, kExpressionCount>& weights, const std::string& name) {
  return weights[static_cast<size_t>(ExpressionIndex(name))];
}

// What every source promises.
void CheckPerformance(const SimulatedPerformance& performance, int frames) {
  EXPECT_EQ(performance.FrameCount(), frames);
  std::set<std::string> names;
  int held_out = 0, last_number = -1;
  double last_time = -1, most_turn = 0, most_shift = 0;
  for (const PerformanceSegment& segment : performance.segments) {
    EXPECT_TRUE(names.insert(segment.name).second) << segment.name;
    EXPECT_FALSE(segment.frames.empty()) << segment.name;
    held_out += segment.held_out ? static_cast<int>(segment.frames.size()) : 0;
    for (const PerformanceFrame& frame : segment.frames) {
      EXPECT_GT(frame.number, last_number);
      EXPECT_GT(frame.time_s, last_time);
      last_number = frame.number;
      last_time = frame.time_s;
      for (const float weight : frame.weights) EXPECT_TRUE(weight >= 0 && weight <= 1);
      most_turn = std::max({most_turn, std::abs(frame.yaw), std::abs(frame.pitch), std::abs(frame.roll)});
      most_shift = std::max(most_shift, frame.shift_mm.norm());
      EXPECT_LT(RotationDefect(frame.WorldFromHead().rotation), 1e-12);
    }
  }
  // Head poses matter, but the head stays in the picture.
  EXPECT_GT(most_turn, 0.02);
  EXPECT_LT(most_turn, 0.3);
  EXPECT_GT(most_shift, 0.5);
  EXPECT_LT(most_shift, 15);
  EXPECT_GT(held_out, 0);
  EXPECT_LT(held_out, frames);
  // Held-out segments match by prefix: none may take a training segment along.
  for (const PerformanceSegment& a : performance.segments) {
    for (const PerformanceSegment& b : performance.segments) {
      if (a.held_out && !b.held_out) {
        EXPECT_FALSE(b.name.starts_with(a.name)) << a.name << " " << b.name;
      }
    }
  }
}

TEST(BuiltInPerformanceTest, HasWhatCapturesNeedAtAnyLength) {
  for (const int frames : {2, 3, 5, 10, 17, 48, 60, 250}) {
    SCOPED_TRACE(frames);
    const SimulatedPerformance performance = BuiltInPerformance(frames, 7);
    if (frames >= 10) {
      CheckPerformance(performance, frames);
    } else {
      EXPECT_EQ(performance.FrameCount(), frames);
    }
  }
  EXPECT_NE(ErrorOf([] { BuiltInPerformance(1, 0); }), "");
}

TEST(BuiltInPerformanceTest, IsTheSameForTheSameSeed) {
  const SimulatedPerformance a = BuiltInPerformance(40, 3), b = BuiltInPerformance(40, 3),
                             c = BuiltInPerformance(40, 4);
  double difference = 0;
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (size_t s = 0; s < a.segments.size(); ++s) {
    EXPECT_EQ(a.segments[s].name, b.segments[s].name);
    for (size_t f = 0; f < a.segments[s].frames.size(); ++f) {
      EXPECT_EQ(a.segments[s].frames[f].weights, b.segments[s].frames[f].weights);
      EXPECT_EQ(a.segments[s].frames[f].yaw, b.segments[s].frames[f].yaw);
      difference += std::abs(a.segments[s].frames[f].yaw - c.segments[s].frames[f].yaw);
    }
  }
  EXPECT_GT(difference, 0.1);
}

// Held-out frames do not go further than training frames do.
TEST(BuiltInPerformanceTest, TrainingCoversWhatIsHeldOut) {
  const SimulatedPerformance performance = BuiltInPerformance(60, 1);
  std::array<float, kExpressionCount> most = {};
  for (const PerformanceSegment& segment : performance.segments) {
    for (const PerformanceFrame& frame : segment.frames) {
      for (size_t i = 0; i < most.size(); ++i) {
        if (!segment.held_out) most[i] = std::max(most[i], frame.weights[i]);
      }
    }
  }
  for (const PerformanceSegment& segment : performance.segments) {
    if (!segment.held_out) continue;
    for (const PerformanceFrame& frame : segment.frames) {
      for (size_t i = 0; i < most.size(); ++i) {
        EXPECT_LE(frame.weights[i], most[i] + 0.3f) << segment.name << " " << ExpressionNames()[i];
      }
    }
  }
}

TEST(FullPerformanceTest, Has122ExpressionsAnd50SentencesAtAnyLength) {
  for (const int frames : {173, 174, 500, 3460}) {
    SCOPED_TRACE(frames);
    const SimulatedPerformance performance = FullPerformance(frames, 7);
    CheckPerformance(performance, frames);
    std::set<std::string> held_out;
    int expressions = 0, sentences = 0;
    size_t shortest = 1000;
    for (const PerformanceSegment& segment : performance.segments) {
      if (segment.held_out) held_out.insert(segment.name.substr(0, 4));
      expressions += segment.name.starts_with("EXP_") && segment.name != "EXP_free_face" ? 1 : 0;
      sentences += segment.name.starts_with("SEN_") ? 1 : 0;
      shortest = std::min(shortest, segment.frames.size());
    }
    EXPECT_EQ(expressions, 122);
    EXPECT_EQ(sentences, 50);
    EXPECT_EQ(performance.segments.size(), 173);
    EXPECT_EQ(held_out, (std::set<std::string>{"EXP_", "SEN_"}));
    EXPECT_GE(shortest, static_cast<size_t>(frames / 260));
  }
  EXPECT_THAT(ErrorOf([] { FullPerformance(172, 1); }), HasSubstr("173 segments"));
}

TEST(FullPerformanceTest, PeaksComeFromTheNeutralFaceAndGoBack) {
  const SimulatedPerformance performance = FullPerformance(1730, 1);
  for (size_t i = 0; i < PeakExpressions().size(); ++i) {
    const PerformanceSegment& segment = performance.segments[i];
    EXPECT_EQ(segment.name, "EXP_" + PeakExpressions()[i].name);
    std::array<float, kExpressionCount> peak = {};
    AddExpression(PeakExpressions()[i], 1, &peak);
    const std::array<float, kExpressionCount> neutral = {};
    float nearest = 1;
    for (const PerformanceFrame& frame : segment.frames) {
      float away = 0;
      for (size_t k = 0; k < peak.size(); ++k) away = std::max(away, std::abs(frame.weights[k] - peak[k]));
      nearest = std::min(nearest, away);
    }
    EXPECT_LT(nearest, 1e-5f) << segment.name;
    ASSERT_GE(segment.frames.size(), 3) << segment.name;
    EXPECT_EQ(segment.frames.front().weights, neutral) << segment.name;
    EXPECT_EQ(segment.frames.back().weights, neutral) << segment.name;
  }
}

TEST(PeakExpressionsTest, DifferFromEachOtherAndUseAllShapes) {
  const auto& expressions = PeakExpressions();
  std::set<std::string> names;
  std::vector<std::array<float, kExpressionCount>> peaks;
  std::array<float, kExpressionCount> most = {};
  for (const PeakExpression& expression : expressions) {
    EXPECT_TRUE(names.insert(expression.name).second) << expression.name;
    peaks.emplace_back();
    AddExpression(expression, 1, &peaks.back());
    for (size_t k = 0; k < most.size(); ++k) most[k] = std::max(most[k], peaks.back()[k]);
    for (size_t other = 0; other + 1 < peaks.size(); ++other) {
      float away = 0;
      for (size_t k = 0; k < most.size(); ++k) away += std::abs(peaks.back()[k] - peaks[other][k]);
      EXPECT_GT(away, 0.15f) << expression.name << " " << expressions[other].name;
    }
  }
  for (size_t k = 0; k < most.size(); ++k) EXPECT_GE(most[k], 0.3f) << ExpressionNames()[k];
}

TEST(SentencesTest, HeldOutOnesSayNothingNew) {
  const auto& sentences = BuiltInSentences();
  std::set<std::string> known;
  for (size_t i = 0; i < sentences.size(); ++i) {
    std::istringstream words(sentences[i].phonemes);
    for (std::string word; words >> word;) {
      if (i + 10 < sentences.size()) {
        known.insert(word);
      } else {
        EXPECT_TRUE(known.contains(word)) << sentences[i].name << " " << word;
      }
    }
    EXPECT_GT(SentenceDuration(sentences[i]), 1);
  }
}

TEST(BuiltInPerformanceTest, ExpressionsReachTheirPeaks) {
  for (const PerformanceSegment& segment : BuiltInPerformance(48, 1).segments) {
    float most = 0;
    for (const PerformanceFrame& frame : segment.frames) {
      if (segment.name == "EXP_jaw_open") most = std::max(most, WeightOf(frame.weights, "jawOpen") / 0.75f);
      if (segment.name == "EXP_smile_closed") most = std::max(most, WeightOf(frame.weights, "mouthSmileLeft") / 0.8f);
    }
    if (segment.name == "EXP_jaw_open" || segment.name == "EXP_smile_closed") {
      EXPECT_NEAR(most, 1, 1e-5);
    }
  }
}

TEST(SpeechTest, LipsCloseOpenAndRoundWhereTheSoundsSay) {
  const Sentence sentence{"SEN_test", "_ AA M AA UW AA F AA _"};
  const auto at = [&](int phoneme) { return SpeechWeights(sentence, 0.09 * (phoneme + 0.5)); };
  EXPECT_GT(WeightOf(at(1), "jawOpen"), 0.3);
  EXPECT_LT(WeightOf(at(2), "jawOpen"), 0.6 * WeightOf(at(1), "jawOpen"));
  EXPECT_GT(WeightOf(at(2), "mouthPressLeft"), 0.2);
  EXPECT_GT(WeightOf(at(4), "mouthPucker"), 0.4);
  EXPECT_LT(WeightOf(at(1), "mouthPucker"), 0.15);
  EXPECT_GT(WeightOf(at(6), "mouthRollLower"), 0.2);
  // Shapes run into each other: no jump within a millisecond.
  for (double t = 0; t < SentenceDuration(sentence); t += 0.013) {
    const auto a = SpeechWeights(sentence, t), b = SpeechWeights(sentence, t + 0.001);
    for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 0.03);
  }
  EXPECT_THAT(ErrorOf([] { SpeechWeights({"SEN_x", "AA QQ"}, 0); }), HasSubstr("'QQ'"));
  for (const Sentence& built_in : BuiltInSentences()) EXPECT_GT(SentenceDuration(built_in), 1.5);
}

std::string Header(const std::string& more = ",HeadYaw,HeadPitch,HeadRoll") {
  std::string header = "Timecode,BlendShapeCount";
  for (std::string name : ExpressionNames()) {
    name[0] = static_cast<char>(std::toupper(name[0]));
    header += "," + name;
  }
  return header + more + "\n";
}

// 52 equal weights and three angles.
std::string Row(const std::string& timecode, const std::string& weight = "0.25", const std::string& yaw = "0.1") {
  std::string row = timecode + ",55";
  for (int i = 0; i < kExpressionCount; ++i) row += "," + weight;
  return row + "," + yaw + ",0.2,-0.3\n";
}

LiveLinkRecording Parse(const std::string& text) { return ParseLiveLink("r.csv", text); }

TEST(LiveLinkTest, ReadsWeightsAnglesAndTime) {
  const LiveLinkRecording recording =
      Parse("\xef\xbb\xbf" + Header() + Row("23:59:59:58.0") + "23:59:59:59.0,0\n" + Row("00:00:00:00.500", "1.01"));
  ASSERT_EQ(recording.frames.size(), 2);
  EXPECT_NEAR(recording.frames[1].time_s, 2.5 / 60, 1e-9);  // past midnight, at 60 frames a second
  EXPECT_NEAR(recording.frames_per_second, 24, 1e-6);
  EXPECT_EQ(recording.frames[1].number, 2);  // the row without a face counts
  EXPECT_EQ(recording.frames[0].weights[3], 0.25f);
  EXPECT_EQ(recording.frames[1].weights[3], 1.0f);
  EXPECT_EQ(recording.frames[0].yaw, 0.1);
  EXPECT_EQ(recording.frames[0].pitch, 0.2);
  EXPECT_EQ(recording.frames[0].roll, -0.3);
}

TEST(LiveLinkTest, WrongFilesAreErrorsThatNameTheLine) {
  const std::string good = Header() + Row("00:00:00:00.0") + Row("00:00:00:01.0");
  EXPECT_EQ(ErrorOf([&] { Parse(good); }), "");
  const auto error = [](const std::string& text) { return ErrorOf([&] { Parse(text); }); };
  EXPECT_THAT(error(""), HasSubstr("empty"));
  EXPECT_THAT(error("a,b\n"), HasSubstr("r.csv:1: expected a header"));
  EXPECT_THAT(error("Timecode,BlendShapeCount,EyeBlinkLeft\n"), HasSubstr("eyeLookDownLeft is missing"));
  EXPECT_THAT(error(Header(",HeadYaw,HeadYaw")), HasSubstr("HeadYaw stands there twice"));
  EXPECT_THAT(error(Header() + Row("00:00:00:00")), HasSubstr("fewer than two rows"));
  EXPECT_THAT(error(Header() + Row("00:00:00:00") + Row("00:00:00:00")), HasSubstr("same timecode"));
  EXPECT_THAT(error(good + Row("00:00:00:00.5")), HasSubstr("r.csv:4: time runs backwards"));
  EXPECT_THAT(error(good + Row("12:00")), HasSubstr("r.csv:4: '12:00' is no timecode"));
  EXPECT_THAT(error(good + Row("00:61:00:00")), HasSubstr("no timecode"));
  EXPECT_THAT(error(good + Row("00:00:00:-1")), HasSubstr("no timecode"));
  EXPECT_THAT(error(good + Row("00:00:00:nan")), HasSubstr("r.csv:4"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "nan")), HasSubstr("r.csv:4"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "inf")), HasSubstr("r.csv:4"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "-0.5")), HasSubstr("eyeBlinkLeft is -0.5, expected 0 to 1"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "50")), HasSubstr("expected 0 to 1"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "")), HasSubstr("r.csv:4"));
  EXPECT_THAT(error(good + Row("00:00:00:02", "0.1", "90")), HasSubstr("radians"));
  EXPECT_THAT(error(good + "00:00:00:02,55,0.5\n"), HasSubstr("expected 57 fields, found 3"));
  EXPECT_THAT(error(good + "00:00:00:02\n"), HasSubstr("expected 57 fields"));
  EXPECT_THAT(error(good + "00:00:00:02,54" + Row("x").substr(4)), HasSubstr("BlendShapeCount is 54"));
  EXPECT_THAT(error(std::string("\xff\xfeT\0i\0m\0", 8)), HasSubstr("r.csv:1"));
  EXPECT_THAT(error(good.substr(0, good.size() - 60)), HasSubstr("r.csv:3"));
  EXPECT_NE(ErrorOf([] { ReadLiveLink("/nonexistent/recording.csv"); }), "");
}

TEST(LiveLinkTest, ARecordingBecomesSegments) {
  std::string text = Header();
  for (int i = 0; i < 600; ++i) {
    text += Row(fmt::format("10:00:{:02}:{:02}.0", i / 30, 2 * (i % 30)), "0.5", i % 2 == 0 ? "0.05" : "0.06");
  }
  const LiveLinkRecording recording = Parse(text);
  EXPECT_NEAR(recording.frames_per_second, 30, 1e-6);
  const SimulatedPerformance performance = PerformanceFromRecording(recording, 48, 1);
  EXPECT_EQ(performance.FrameCount(), 48);
  EXPECT_EQ(performance.segments.front().frames.front().pitch, 0.2) << "recorded head motion stays";
  // Spread over the recording: equal steps.
  int last = -6, first_step = 0;
  for (const PerformanceSegment& segment : performance.segments) {
    for (const PerformanceFrame& frame : segment.frames) {
      const int step = frame.number - last;
      last = frame.number;
      if (first_step++ > 0) {
        EXPECT_TRUE(step == 12 || step == 13) << step;
      }
    }
  }
  EXPECT_GT(last, 590);
  EXPECT_EQ(PerformanceFromRecording(recording, 5000, 1).FrameCount(), 600);
}

TEST(LiveLinkTest, ReadsARealRecording) {
  const auto path = SampleData("motion/alex_rom_3.csv");
  if (!path) GTEST_SKIP() << "sample data absent";
  const LiveLinkRecording recording = ReadLiveLink(*path);
  EXPECT_EQ(recording.frames.size(), 4030);
  EXPECT_NEAR(recording.frames_per_second, 30, 0.1);
  // This one has no head rotation: it gets some.
  CheckPerformance(PerformanceFromRecording(recording, 48, 1), 48);
}

}  // namespace
}  // namespace likeness
