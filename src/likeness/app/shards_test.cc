// simulate, unwrap and evaluate shared out among several processes, as torchrun and Slurm start them: the same files
// and figures as of one process.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "likeness/app/program_testing.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

using Arguments = std::vector<std::string>;
using Environment = std::map<std::string, std::string>;

class ShardsTest : public testing::Test {
 protected:
  fs::path Log(int rank) const { return scratch_ / fmt::format("{}.log", rank); }

  // One process a rank, with what the launcher tells it; MASTER_ADDR is not needed.
  std::vector<pid_t> Start(int count, const Arguments& arguments, bool slurm = false) const {
    std::vector<pid_t> processes;
    for (int rank = 0; rank < count; ++rank) {
      const std::string own = std::to_string(rank), all = std::to_string(count);
      processes.push_back(
          StartProgram(arguments,
                       slurm ? Environment{{"SLURM_STEP_ID", "0"}, {"SLURM_PROCID", own}, {"SLURM_NTASKS", all}}
                             : Environment{{"RANK", own}, {"WORLD_SIZE", all}},
                       Log(rank)));
    }
    return processes;
  }
  void RunShared(int count, const Arguments& arguments, bool slurm = false) const {
    const std::vector<pid_t> processes = Start(count, arguments, slurm);
    for (int rank = 0; rank < count; ++rank) {
      EXPECT_EQ(WaitFor(processes[static_cast<size_t>(rank)]), 0) << ReadFile(Log(rank));
    }
  }
  void RunAlone(const Arguments& arguments) const {
    ASSERT_EQ(WaitFor(StartProgram(arguments, {}, Log(0))), 0) << ReadFile(Log(0));
  }

  // What every file below a folder holds, but for locks and for records of options, which name the folder.
  static std::map<std::string, std::string> Files(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const fs::path& path = entry.path();
      if (!entry.is_regular_file() || path.filename() == ".lock" || path.extension() == ".toml") continue;
      files[path.lexically_relative(folder).string()] = ReadFile(path);
    }
    return files;
  }
  // How many there are, while others come and go.
  static size_t CountPngs(const fs::path& folder) {
    size_t count = 0;
    std::error_code code;
    for (fs::recursive_directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
      const std::string name = it->path().filename().string();
      count += name.ends_with(".png") && !name.starts_with('.') ? 1 : 0;
    }
    return count;
  }
  static void ExpectSame(const fs::path& a, const fs::path& b) {
    const auto files_a = Files(a), files_b = Files(b);
    for (const auto& [name, bytes] : files_a) {
      ASSERT_TRUE(files_b.contains(name)) << name;
      EXPECT_TRUE(files_b.at(name) == bytes) << name;
    }
    EXPECT_EQ(files_a.size(), files_b.size());
  }

  Arguments Simulate(const std::string& out) const {
    return {"simulate",
            scratch_ / out,
            "--head",
            "procedural:3",
            "--preset",
            "small",
            "--frames",
            "7",
            "--cameras",
            "4",
            "--held-out-cameras",
            "1",
            "--width",
            "80",
            "--height",
            "96",
            "--samples",
            "1",
            "--lights",
            "8",
            "--threads",
            "1",
            "--quiet"};
  }
  Arguments Unwrap(const std::string& capture) const {
    return {"unwrap", scratch_ / capture, "--size", "64", "--threads", "1", "--quiet"};
  }
  Arguments Evaluate(const Arguments& more) const {
    Arguments arguments = {"evaluate", scratch_ / "avatar", scratch_ / "one", "--json", "--threads", "1", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  const ScratchFolder scratch_;
};

TEST_F(ShardsTest, GiveWhatOneProcessGives) {
  RunAlone(Simulate("one"));
  RunShared(3, Simulate("three"));
  ExpectSame(scratch_ / "one", scratch_ / "three");

  RunAlone(Unwrap("one"));
  RunShared(3, Unwrap("three"), true);
  ExpectSame(scratch_ / "one", scratch_ / "three");

  RunAlone({"train", scratch_ / "one", scratch_ / "avatar", "--iterations", "3", "--minutes", "0", "--latent", "8",
            "--threads", "1", "--quiet"});
  RunAlone(Evaluate({}));
  const std::string alone = ReadFile(Log(0));
  EXPECT_THAT(alone, HasSubstr("held_out_both"));

  // One of them, the last to finish, has the table.
  const std::string parts = scratch_ / "parts";
  RunShared(3, Evaluate({"--parts", parts}));
  int tables = 0;
  for (int rank = 0; rank < 3; ++rank) {
    const std::string text = ReadFile(Log(rank));
    if (text.empty()) continue;
    ++tables;
    EXPECT_EQ(text, alone);
  }
  EXPECT_EQ(tables, 1);

  // A part is lost: another shard says so with nothing on stdout, and a last call measures what is missing.
  ASSERT_EQ(ListFolder(parts).size(), 1u);
  const fs::path folder = fs::path(parts) / ListFolder(parts)[0];
  fs::remove(folder / "2-of-3.json");
  RunAlone(Evaluate({"--parts", parts, "--shard", "1/3"}));
  EXPECT_EQ(ReadFile(Log(0)), "");
  RunAlone(Evaluate({"--parts", parts}));
  EXPECT_EQ(ReadFile(Log(0)), alone);
  // With other options nothing of it is used.
  RunAlone(Evaluate({"--parts", parts, "--shard", "1/3", "--max-images", "2"}));
  EXPECT_EQ(ReadFile(Log(0)), "");
  // With pictures, which are kept with the parts: the same report.
  RunAlone(Evaluate({"--csv", scratch_ / "one.csv", "--pictures", scratch_ / "pictures"}));
  RunShared(2, Evaluate({"--parts", parts, "--csv", scratch_ / "two.csv", "--pictures", scratch_ / "pictures2"}));
  EXPECT_EQ(ReadFile(scratch_ / "one.csv"), ReadFile(scratch_ / "two.csv"));
  fs::remove(scratch_ / "pictures" / "evaluation.json");  // names its folder
  fs::remove(scratch_ / "pictures2" / "evaluation.json");
  ExpectSame(scratch_ / "pictures", scratch_ / "pictures2");

  EXPECT_EQ(WaitFor(StartProgram(Evaluate({"--shard", "1/2"}), {}, Log(0))), 2);
  EXPECT_THAT(ReadFile(Log(0)), HasSubstr("--parts DIR"));
  EXPECT_EQ(WaitFor(StartProgram(Evaluate({"--parts", parts, "--shard", "3/2"}), {}, Log(0))), 2);
  EXPECT_THAT(ReadFile(Log(0)), HasSubstr("such as 2/8"));

  fs::remove_all(parts);
  WriteFile(scratch_ / "file", "in the way");
  EXPECT_EQ(WaitFor(StartProgram(Evaluate({"--parts", scratch_ / "file"}), {}, Log(0))), 1);
  EXPECT_THAT(ReadFile(Log(0)), HasSubstr((scratch_ / "file").string()));
}

TEST_F(ShardsTest, AKilledUnwrapLosesNothing) {
  RunAlone(Simulate("one"));
  fs::copy(scratch_ / "one", scratch_ / "killed", fs::copy_options::recursive);
  RunAlone(Unwrap("one"));
  // Each in turn is killed after its first textures.
  const fs::path textures = scratch_ / "killed" / "unwrapped_uv_64";
  for (int round = 0; round < 3; ++round) {
    const size_t before = CountPngs(textures);
    const std::vector<pid_t> processes = Start(3, Unwrap("killed"));
    const auto start = std::chrono::steady_clock::now();
    while (CountPngs(textures) < before + 2 && std::chrono::steady_clock::now() - start < std::chrono::seconds(10)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(processes[static_cast<size_t>(round)], SIGKILL);
    for (const pid_t process : processes) WaitFor(process);
  }
  RunShared(3, Unwrap("killed"));
  ExpectSame(scratch_ / "one" / "unwrapped_mask_64", scratch_ / "killed" / "unwrapped_mask_64");
  for (const char* name : {"tex_mean.png", "tex_var.txt", "vert_mean.bin", "vert_var.txt"}) {
    EXPECT_EQ(ReadFile(scratch_ / "one" / name), ReadFile(scratch_ / "killed" / name)) << name;
  }
}

}  // namespace
}  // namespace likeness
