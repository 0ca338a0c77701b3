#include "likeness/train/run_log.h"

#include <cerrno>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {

namespace {

constexpr char kHeader[] = "iteration,elapsed_s,loss,texture,geometry,kl,image,gradient_norm,learning_rate,skipped\n";

}  // namespace

RunLog::RunLog(const std::filesystem::path& out, int64_t first)
    : path_(out / "log.csv"), tensorboard_(out / "tensorboard") {
  std::string kept = kHeader;
  if (first > 0 && std::filesystem::exists(path_)) {
    std::string text = ReadFile(path_);
    text.resize(text.rfind('\n') + 1);  // a killed process may leave half a row
    TextLines lines(path_, text);
    lines.Next();  // the header
    while (lines.Next()) {
      const auto fields = lines.Fields(',');
      if (fields.size() != 10 || lines.Integer(fields[0]) > first) break;
      last_ = {lines.Number(fields[2]),
               lines.Number(fields[3]),
               lines.Number(fields[4]),
               lines.Number(fields[5]),
               lines.Number(fields[6]),
               lines.Number(fields[7]),
               false};
      kept += std::string(lines.line()) + "\n";
    }
  }
  WriteFile(path_, kept);
  csv_.open(path_, std::ios::app);
}

void RunLog::Add(const StepValues& values, double learning_rate) {
  learning_rate_ = learning_rate;
  if (values.skipped) return;
  ++counted_;
  sums_.total += values.total;
  sums_.texture += values.texture;
  sums_.geometry += values.geometry;
  sums_.kl += values.kl;
  sums_.image += values.image;
  sums_.gradient_norm += values.gradient_norm;
}

StepValues RunLog::Means() const {
  if (counted_ == 0) return last_;
  const double n = static_cast<double>(counted_);
  return {sums_.total / n,
          sums_.texture / n,
          sums_.geometry / n,
          sums_.kl / n,
          sums_.image / n,
          sums_.gradient_norm / n,
          false};
}

void RunLog::Write(const RunState& run) {
  last_ = Means();
  sums_ = {};
  counted_ = 0;
  csv_ << fmt::format("{},{:.2f},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.4g},{:.4g},{}\n", run.iteration, run.elapsed_s,
                      last_.total, last_.texture, last_.geometry, last_.kl, last_.image, last_.gradient_norm,
                      learning_rate_, run.skipped);
  csv_.flush();
  if (!csv_) throw FileError(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
  tensorboard_.WriteScalars(run.iteration, {{"loss/total", last_.total},
                                            {"loss/texture", last_.texture},
                                            {"loss/geometry", last_.geometry},
                                            {"loss/kl", last_.kl},
                                            {"loss/image", last_.image},
                                            {"optimiser/gradient_norm", last_.gradient_norm},
                                            {"optimiser/learning_rate", learning_rate_}});
}

void RunLog::WritePicture(const RunState& run, const ImageU8& picture) {
  tensorboard_.WriteImage(run.iteration, "texture: truth, prediction, difference x 5", picture);
}

}  // namespace likeness
