// Several processes that train one avatar, as torchrun and Slurm start them: real processes over loopback.

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "likeness/app/program_testing.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A port that nobody uses now.
int FreePort() {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  EXPECT_EQ(bind(descriptor, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(descriptor);
  return ntohs(address.sin_port);
}

class PeersTest : public testing::Test {
 protected:
  PeersTest() { SyntheticCapture().Write(scratch_ / "capture"); }

  std::vector<std::string> TrainInto(const std::string& out, int iterations, int batch) const {
    return {"train",
            scratch_ / "capture",
            scratch_ / out,
            "--iterations",
            std::to_string(iterations),
            "--minutes",
            "0",
            "--threads",
            "1",
            "--views",
            "3",
            "--latent",
            "8",
            "--quiet",
            "--batch",
            std::to_string(batch)};
  }

  // One process a rank.
  std::vector<pid_t> Start(int count, const std::vector<std::string>& arguments) const {
    const std::string port = std::to_string(FreePort());
    std::vector<pid_t> processes;
    for (int rank = 0; rank < count; ++rank) {
      processes.push_back(StartProgram(arguments,
                                       {{"RANK", std::to_string(rank)},
                                        {"WORLD_SIZE", std::to_string(count)},
                                        {"LOCAL_RANK", std::to_string(rank)},
                                        {"MASTER_ADDR", "127.0.0.1"},
                                        {"MASTER_PORT", port}},
                                       Log(rank)));
    }
    return processes;
  }
  fs::path Log(int rank) const { return scratch_ / fmt::format("{}.log", rank); }

  fs::path Newest(const std::string& out) const {
    const fs::path folder = scratch_ / out / "checkpoints";
    const std::vector<std::string> names = ListFolder(folder);
    return names.empty() ? fs::path() : folder / names.back();
  }

  // Adam's first moments after one step are a tenth of the gradients.
  void ExpectEqualGradients(const fs::path& path_a, const fs::path& path_b) const {
    const SafetensorsFile a(path_a), b(path_b);
    int compared = 0;
    for (const std::string& name : a.names()) {
      if (!name.starts_with("adam_m/")) continue;
      const std::vector<float> x = a.Floats(name, a.ShapeOf(name)), y = b.Floats(name, a.ShapeOf(name));
      double difference = 0, norm = 0;
      for (size_t i = 0; i < x.size(); ++i) {
        difference += std::pow(x[i] - y[i], 2);
        norm += std::pow(x[i], 2);
      }
      // Sums over 4096 texels and more, each rounded to 24 bits.
      EXPECT_LE(std::sqrt(difference), 1e-5 * std::sqrt(norm)) << name;
      compared += norm > 0;
    }
    EXPECT_GT(compared, 20);
  }

  const ScratchFolder scratch_;
};

TEST_F(PeersTest, GradientsAreThoseOfOneWithTheWholeBatch) {
  ASSERT_EQ(WaitFor(StartProgram(TrainInto("one", 1, 6))), 0);
  for (const pid_t process : Start(2, TrainInto("two", 1, 3))) EXPECT_EQ(WaitFor(process), 0) << ReadFile(Log(0));
  ExpectEqualGradients(Newest("one"), Newest("two"));

  ASSERT_EQ(WaitFor(StartProgram(TrainInto("nine", 1, 9))), 0);
  for (const pid_t process : Start(3, TrainInto("three", 1, 3))) EXPECT_EQ(WaitFor(process), 0) << ReadFile(Log(0));
  ExpectEqualGradients(Newest("nine"), Newest("three"));
}

TEST_F(PeersTest, ALostOneEndsTheOthersAndTrainingGoesOnWithoutIt) {
  constexpr int kIterations = 300;
  std::vector<std::string> arguments = TrainInto("out", kIterations, 3);
  for (const char* more : {"--save-minutes", "0.0005", "--peer-timeout", "20"}) arguments.emplace_back(more);
  for (const int lost : {1, 0}) {
    SCOPED_TRACE(fmt::format("process {} is lost", lost));
    const fs::path before = Newest("out");
    const std::vector<pid_t> processes = Start(2, arguments);
    const auto start = std::chrono::steady_clock::now();
    while (Newest("out") == before && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ASSERT_NE(Newest("out"), before) << ReadFile(Log(0)) << ReadFile(Log(1));
    kill(processes[static_cast<size_t>(lost)], SIGKILL);
    const auto killed = std::chrono::steady_clock::now();
    EXPECT_EQ(WaitFor(processes[static_cast<size_t>(lost)]), 128 + SIGKILL);
    EXPECT_EQ(WaitFor(processes[static_cast<size_t>(1 - lost)]), 1);
    EXPECT_LT(std::chrono::steady_clock::now() - killed, std::chrono::seconds(20));
    EXPECT_THAT(ReadFile(Log(1 - lost)),
                AllOf(HasSubstr("error: another process of this run has ended"), HasSubstr("last checkpoint")));
  }
  // With another number of them.
  for (const pid_t process : Start(3, arguments)) EXPECT_EQ(WaitFor(process), 0) << ReadFile(Log(0));
  EXPECT_TRUE(fs::exists(scratch_ / "out" / "avatar.safetensors"));
  EXPECT_EQ(Newest("out").filename(), "000000300.safetensors");
}

TEST_F(PeersTest, OneThatNeverComesIsMissedInTime) {
  std::vector<std::string> arguments = TrainInto("out", 1, 3);
  for (const char* more : {"--peer-timeout", "2"}) arguments.emplace_back(more);
  const pid_t alone = StartProgram(
      arguments,
      {{"RANK", "0"}, {"WORLD_SIZE", "2"}, {"MASTER_ADDR", "127.0.0.1"}, {"MASTER_PORT", std::to_string(FreePort())}},
      Log(0));
  EXPECT_EQ(WaitFor(alone), 1);
  EXPECT_THAT(ReadFile(Log(0)), HasSubstr("process 0 of 2 did not find the others"));
}

TEST_F(PeersTest, Torchrun) {
  const fs::path torchrun = fs::path(LIKENESS_SOURCE_DIR) / ".deps/python/bin/torchrun";
  if (!fs::exists(torchrun)) GTEST_SKIP() << "torchrun is not installed";
  ASSERT_EQ(WaitFor(StartProgram(TrainInto("one", 1, 6))), 0);
  std::vector<std::string> arguments = {"--no-python",
                                        "--nproc-per-node",
                                        "2",
                                        "--master-addr",
                                        "127.0.0.1",
                                        "--master-port",
                                        std::to_string(FreePort()),
                                        LIKENESS_PROGRAM};
  for (const std::string& argument : TrainInto("two", 1, 3)) arguments.push_back(argument);
  EXPECT_EQ(WaitFor(StartProcess(torchrun, arguments, {}, Log(0))), 0) << ReadFile(Log(0));
  ExpectEqualGradients(Newest("one"), Newest("two"));
}

}  // namespace
}  // namespace likeness
