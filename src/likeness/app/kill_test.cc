// A run of the program that is killed at random, twenty times, ends with the same weights as one that is left alone.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "likeness/app/program_testing.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kIterations = 1200;
constexpr int kKills = 20;

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
  ASSERT_EQ(WaitFor(StartProgram(TrainInto(scratch, alone))), 0);

  const auto iteration = [&] {  // of the newest checkpoint
    const std::vector<std::string> names = ListFolder(killed / "checkpoints");
    return names.empty() ? 0 : std::atoi(names.back().c_str());
  };
  // Every fourth time while the program may still be loading, otherwise some steps on.
  constexpr uint64_t kSeed = 20;
  SCOPED_TRACE(fmt::format("seed {}", kSeed));
  Random random(kSeed);
  int kills = 0, status = 0;
  for (; kills < kKills; ++kills) {
    const bool early = kills % 4 == 0;
    const int target = early ? 0 : iteration() + 1 + static_cast<int>(random.Below(40));
    const pid_t process = StartProgram(TrainInto(scratch, killed));
    // A run that has ended stays a zombie until it is waited for.
    siginfo_t ended = {};
    while (iteration() < target &&
           waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(random.Uniform(0, early ? 0.5 : 0.02)));
    kill(process, SIGKILL);
    status = WaitFor(process);
    if (status != 128 + SIGKILL) break;
  }
  EXPECT_EQ(kills, kKills) << "the run ended before it was killed so often, with status " << status;
  ASSERT_EQ(WaitFor(StartProgram(TrainInto(scratch, killed))), 0);

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
