// A run of the program that is killed at random, twenty times, ends with the same weights as one that is left alone.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "likeness/avatar/safetensors.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"

extern char** environ;

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kIterations = 1200;
constexpr int kKills = 20;

pid_t Start(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), LIKENESS_PROGRAM);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t process = 0;
  EXPECT_EQ(posix_spawn(&process, LIKENESS_PROGRAM, nullptr, nullptr, argv.data(), environ), 0);
  return process;
}

std::vector<std::string> TrainInto(const ScratchFolder& scratch, const fs::path& out) {
  return {"train",
          scratch / "capture",
          out,
          "--iterations",
          std::to_string(kIterations),
          "--minutes",
          "0",
          "--batch",
          "6",
          "--views",
          "3",
          "--latent",
          "8",
          "--log-every",
          "50",
          "--quiet",
          "--save-minutes",
          "0.0003",
          "--threads",
          "2"};
}

TEST(Kill, ResumesToTheSameWeights) {
  const ScratchFolder scratch;
  SyntheticCapture().Write(scratch / "capture");
  const fs::path alone = scratch / "alone", killed = scratch / "killed";
  int status = -1;
  waitpid(Start(TrainInto(scratch, alone)), &status, 0);
  ASSERT_EQ(status, 0);

  const auto iteration = [&] {  // of the newest checkpoint
    const std::vector<std::string> names = ListFolder(killed / "checkpoints");
    return names.empty() ? 0 : std::atoi(names.back().c_str());
  };
  // Every fourth time while the program may still be loading, otherwise some steps on.
  constexpr uint64_t kSeed = 20;
  SCOPED_TRACE(fmt::format("seed {}", kSeed));
  Random random(kSeed);
  int kills = 0;
  for (; kills < kKills; ++kills) {
    const bool early = kills % 4 == 0;
    const int target = early ? 0 : iteration() + 1 + static_cast<int>(random.Below(40));
    const pid_t process = Start(TrainInto(scratch, killed));
    while (iteration() < target && waitpid(process, &status, WNOHANG) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(random.Uniform(0, early ? 0.5 : 0.02)));
    kill(process, SIGKILL);
    waitpid(process, &status, 0);
    if (WIFEXITED(status)) break;
  }
  EXPECT_EQ(kills, kKills) << "the run ended before it was killed so often, with status " << WEXITSTATUS(status);
  waitpid(Start(TrainInto(scratch, killed)), &status, 0);
  ASSERT_EQ(status, 0);

  for (const fs::path& name :
       {fs::path("avatar.safetensors"), "checkpoints" / fs::path(ListFolder(alone / "checkpoints").back())}) {
    const SafetensorsFile a(alone / name), b(killed / name);
    ASSERT_EQ(a.names(), b.names());
    for (const std::string& tensor : a.names()) {
      const auto x = a.Bytes(tensor), y = b.Bytes(tensor);
      EXPECT_TRUE(std::equal(x.begin(), x.end(), y.begin(), y.end())) << name << ": " << tensor;
    }
  }
  for (const std::string& name : ListFolder(killed / "checkpoints")) EXPECT_EQ(name.find("partial"), std::string::npos);
}

}  // namespace
}  // namespace likeness
