#include "likeness/train/checkpoint.h"

#include <cmath>
#include <cstring>

#include "likeness/avatar/safetensors.h"
#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {

namespace {

constexpr char kFormat[] = "likeness-checkpoint-1";

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

// "batch = 16 there, batch = 8 now; ..."
std::string Differences(const std::filesystem::path& path, const std::string& there,
                        const std::vector<std::string>& now) {
  std::string text;
  TextLines lines(path, there);
  size_t i = 0;
  for (; lines.Next(); ++i) {
    const std::string other = i < now.size() ? now[i] : "nothing";
    if (lines.line() != other) text += fmt::format("{}{} there, {} now", text.empty() ? "" : "; ", lines.line(), other);
  }
  for (; i < now.size(); ++i) text += fmt::format("{}nothing there, {} now", text.empty() ? "" : "; ", now[i]);
  return text;
}

}  // namespace

void SaveCheckpoint(const std::filesystem::path& path, const RunState& run, const Architecture& architecture,
                    const std::vector<std::string>& fingerprint, const std::vector<Parameter>& tensors) {
  std::vector<torch::Tensor> copies;  // keeps the views' memory
  std::vector<TensorView> views;
  for (const Parameter& tensor : tensors) {
    copies.push_back(tensor.value.detach().to(torch::kCPU, torch::kFloat32).contiguous());
    const torch::Tensor& values = copies.back();
    views.push_back(ViewOf(tensor.name, values.sizes().vec(),
                           std::span(values.const_data_ptr<float>(), static_cast<size_t>(values.numel()))));
  }
  WriteSafetensors(path, views,
                   {{"format", kFormat},
                    {"iteration", fmt::format("{}", run.iteration)},
                    {"elapsed_s", fmt::format("{}", run.elapsed_s)},
                    {"skipped", fmt::format("{}", run.skipped)},
                    {"skipped_in_a_row", fmt::format("{}", run.skipped_in_a_row)},
                    {"architecture", ArchitectureToJson(architecture)},
                    {"options", Joined(fingerprint)}});
}

RunState LoadCheckpoint(const std::filesystem::path& path, const Architecture& architecture,
                        const std::vector<std::string>& fingerprint, const std::vector<Parameter>& tensors) {
  const SafetensorsFile file(path);
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || format->second != kFormat) {
    throw FileError(path, "is no checkpoint of this program; name another folder, or start afresh: --no-resume");
  }
  const std::string differences = Differences(path, file.Metadata("options"), fingerprint);
  if (!differences.empty()) {
    throw FileError(path, fmt::format("belongs to a run with other options: {}; give the same ones, name another "
                                      "folder, or start afresh: --no-resume",
                                      differences));
  }
  if (file.Metadata("architecture") != ArchitectureToJson(architecture)) {
    throw FileError(path, fmt::format("belongs to another network, {}; this one is {}; name another folder, or start "
                                      "afresh: --no-resume",
                                      file.Metadata("architecture"), ArchitectureToJson(architecture)));
  }
  const auto number = [&](const char* key) {
    const std::string& text = file.Metadata(key);
    const double value = TextLines(path, text).Number(text);
    if (value < 0) throw FileError(path, fmt::format("its {} is {}", key, value));
    return value;
  };
  RunState run;
  run.iteration = static_cast<int64_t>(number("iteration"));
  run.elapsed_s = number("elapsed_s");
  run.skipped = static_cast<int64_t>(number("skipped"));
  run.skipped_in_a_row = static_cast<int64_t>(number("skipped_in_a_row"));

  const torch::NoGradGuard no_grad;
  for (const Parameter& tensor : tensors) {
    std::vector<float> values = file.Floats(tensor.name, tensor.value.sizes().vec());
    tensor.value.copy_(torch::from_blob(values.data(), tensor.value.sizes()));
  }
  return run;
}

}  // namespace likeness
