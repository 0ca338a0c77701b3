// Speech-like mouth motion: sentences as sequences of mouth shapes that run into each other.

#pragma once

#include <array>
#include <string>
#include <vector>

#include "likeness/simulate/head.h"

namespace likeness {

struct Sentence {
  std::string name;      // "SEN_..."
  std::string phonemes;  // ARPAbet symbols, parted by blanks; "_" is a pause
};

// The 50 built-in sentences, of which short performances take the first few; the last ten are meant to be held out.
// Their phonemes all occur in the others.
const std::vector<Sentence>& BuiltInSentences();

double SentenceDuration(const Sentence& sentence);  // seconds

// Weights of mouth, jaw and tongue at a time. Neighbouring shapes blend with dominance functions that fall off
// exponentially (Cohen and Massaro 1993, without their per-shape rates). Throws Error for an unknown phoneme.
std::array<float, kExpressionCount> SpeechWeights(const Sentence& sentence, double time_s);

}  // namespace likeness
