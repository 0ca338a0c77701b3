#include "likeness/train/checkpoint.h"

#include <fmt/format.h>

#include "likeness/avatar/safetensors.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/text.h"

namespace likeness {

namespace {

constexpr char kFormat[] = "likeness-checkpoint-2";

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

// Throws Error when the file holds no checkpoint.
void CheckFormat(const SafetensorsFile& file) {
  const auto format = file.metadata().find("format");
  if (format == file.metadata().end() || format->second != kFormat) {
    throw FileError(file.path(), "is no checkpoint of this program");
  }
  for (const char* key : {"options", "architecture"}) file.Metadata(key);
}

void CheckSameRun(const SafetensorsFile& file, const RunIdentity& identity) {
  constexpr char kAdvice[] = "give the same ones, name another folder, or start afresh: --no-resume";
  if (const std::string differences = Differences(file.path(), file.Metadata("options"), identity.fingerprint);
      !differences.empty()) {
    throw FileError(file.path(), fmt::format("belongs to a run with other options: {}; {}", differences, kAdvice));
  }
  if (const std::string now = ArchitectureToJson(identity.architecture); file.Metadata("architecture") != now) {
    throw FileError(file.path(), fmt::format("belongs to another network, {}; this one is {}; {}",
                                             file.Metadata("architecture"), now, kAdvice));
  }
}

RunState ReadRun(const SafetensorsFile& file, const std::vector<Parameter>& tensors) {
  const auto positive = [&](const char* key, auto value) {
    if (value < 0) throw FileError(file.path(), fmt::format("its {} is {}", key, value));
    return value;
  };
  const auto whole = [&](const char* key) {
    const std::string& text = file.Metadata(key);
    return positive(key, TextLines(file.path(), text).Integer(text));
  };
  RunState run;
  run.iteration = whole("iteration");
  run.batches = whole("batches");
  const std::string& elapsed_s = file.Metadata("elapsed_s");
  run.elapsed_s = positive("elapsed_s", TextLines(file.path(), elapsed_s).Number(elapsed_s));
  run.skipped = whole("skipped");
  run.skipped_in_a_row = whole("skipped_in_a_row");

  const torch::NoGradGuard no_grad;
  for (const Parameter& tensor : tensors) {
    std::vector<float> values = file.Floats(tensor.name, tensor.value.sizes().vec());
    tensor.value.copy_(torch::from_blob(values.data(), tensor.value.sizes()));
  }
  return run;
}

}  // namespace

Checkpoints::Checkpoints(const std::filesystem::path& out, int keep)
    : folder_(out / "checkpoints"), keep_(static_cast<size_t>(keep)) {
  LIKENESS_CHECK(keep >= 1);
  for (const std::string& name : ListFolder(folder_)) {
    if (name.find(".partial") != std::string::npos) std::filesystem::remove(folder_ / name);
  }
}

std::vector<std::filesystem::path> Checkpoints::Files() const {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : ListFolder(folder_)) {  // sorted, and numbers have leading zeros
    if (name.ends_with(".safetensors") && !name.starts_with('.')) files.insert(files.begin(), folder_ / name);
  }
  return files;
}

void Checkpoints::Save(const RunState& run, const RunIdentity& identity, const std::vector<Parameter>& tensors) {
  std::vector<torch::Tensor> copies;  // keeps the views' memory
  std::vector<TensorView> views;
  for (const Parameter& tensor : tensors) {
    copies.push_back(tensor.value.detach().to(torch::kCPU, torch::kFloat32).contiguous());
    const torch::Tensor& values = copies.back();
    views.push_back(ViewOf(tensor.name, values.sizes().vec(),
                           std::span(values.const_data_ptr<float>(), static_cast<size_t>(values.numel()))));
  }
  const std::filesystem::path path = folder_ / fmt::format("{:09}.safetensors", run.iteration);
  WriteSafetensors(path, views,
                   {{"format", kFormat},
                    {"iteration", fmt::format("{}", run.iteration)},
                    {"batches", fmt::format("{}", run.batches)},
                    {"elapsed_s", fmt::format("{}", run.elapsed_s)},
                    {"skipped", fmt::format("{}", run.skipped)},
                    {"skipped_in_a_row", fmt::format("{}", run.skipped_in_a_row)},
                    {"architecture", ArchitectureToJson(identity.architecture)},
                    {"options", Joined(identity.fingerprint)}});
  for (const std::filesystem::path& old : replaced_) {
    if (old != path) std::filesystem::remove(old);
  }
  replaced_.clear();
  const std::vector<std::filesystem::path> files = Files();
  for (size_t i = keep_; i < files.size(); ++i) std::filesystem::remove(files[i]);
}

std::optional<RunState> Checkpoints::Load(const RunIdentity& identity, const std::vector<Parameter>& tensors) const {
  const std::vector<std::filesystem::path> files = Files();
  std::string damage;
  const auto pass_over = [&](const Error& error) {
    LogWarning("{}; an older checkpoint is tried", error.what());
    if (damage.empty()) damage = error.what();
  };
  for (const std::filesystem::path& path : files) {
    std::optional<SafetensorsFile> file;
    try {
      file.emplace(path);
      CheckFormat(*file);
    } catch (const Error& error) {
      pass_over(error);
      continue;
    }
    CheckSameRun(*file, identity);
    try {
      const RunState run = ReadRun(*file, tensors);
      LogInfo("go on from iteration {}, {}", run.iteration, path.string());
      return run;
    } catch (const Error& error) {
      pass_over(error);
    }
  }
  if (!damage.empty()) {
    throw Error("{}; no checkpoint there is whole; name another folder, or start afresh: --no-resume", damage);
  }
  return std::nullopt;
}

}  // namespace likeness
