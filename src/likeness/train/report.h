// report.html: one self-contained page about a trained avatar, for whoever trained it. No network, light and dark.

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/capture/capture.h"
#include "likeness/train/evaluate.h"
#include "likeness/train/run_record.h"

namespace likeness {

// What the page is made from; everything is borrowed.
struct ReportContent {
  std::string avatar_path;  // as commands name it
  const Avatar& avatar;
  const Capture& capture;
  const EvaluationResult& result;
  std::optional<LossLog> loss;    // of the training run, where it is known
  std::vector<StageTime> stages;  // where they are known
  int identity = 0;               // the avatar's person whom the capture shows
};

std::string ReportHtml(const ReportContent& content);

// What the figures suggest to do next, as plain sentences; commands stand in `backticks`.
std::vector<std::string> Advice(const ReportContent& content);

std::string EscapeHtml(const std::string& text);
std::string Base64(const std::string& bytes);

}  // namespace likeness
