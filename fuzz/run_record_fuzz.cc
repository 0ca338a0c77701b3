// What a training run and the stages before it wrote down: log.csv and the times of stages.

#include "fuzz.h"
#include "likeness/train/run_record.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  if (const auto log = Parsed([&] { return ParseLossLog(kPath, bytes); })) {
    for (const auto* column : {&log->elapsed_s, &log->loss, &log->texture, &log->geometry, &log->kl}) {
      LIKENESS_CHECK(column->size() == log->iteration.size());
    }
  }
  if (const auto stages = Parsed([&] { return ParseStageTimes(kPath, bytes); })) {
    for (const StageTime& stage : *stages) LIKENESS_CHECK(!stage.name.empty() && stage.seconds >= 0);
  }
}

}  // namespace likeness
