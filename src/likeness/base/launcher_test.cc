#include "likeness/base/launcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

class LauncherTest : public testing::Test {
 protected:
  LauncherTest() { Clear(); }
  ~LauncherTest() override { Clear(); }

  static void Set(const std::map<std::string, std::string>& variables) {
    Clear();
    for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), 1);
  }

 private:
  static void Clear() {
    for (const char* name : {"RANK", "WORLD_SIZE", "LOCAL_RANK", "MASTER_ADDR", "MASTER_PORT", "SLURM_PROCID",
                             "SLURM_NTASKS", "SLURM_LOCALID", "SLURM_STEP_ID", "TORCHELASTIC_USE_AGENT_STORE"}) {
      unsetenv(name);
    }
  }
};

TEST_F(LauncherTest, AloneByDefault) {
  EXPECT_EQ(ReadLauncher().count, 1);
  EXPECT_EQ(ReadLauncher().rank, 0);
}

TEST_F(LauncherTest, Torchrun) {
  Set({{"RANK", "5"},
       {"WORLD_SIZE", "8"},
       {"LOCAL_RANK", "1"},
       {"MASTER_ADDR", "node1"},
       {"MASTER_PORT", "29500"},
       {"TORCHELASTIC_USE_AGENT_STORE", "True"}});
  const Launcher launcher = ReadLauncher();
  EXPECT_EQ(launcher.rank, 5);
  EXPECT_EQ(launcher.count, 8);
  EXPECT_EQ(launcher.local_rank, 1);
  EXPECT_EQ(launcher.address, "node1");
  EXPECT_EQ(launcher.port, 29500);
  EXPECT_TRUE(launcher.has_store);
}

TEST_F(LauncherTest, SlurmStepsButNotBatchScripts) {
  const std::map<std::string, std::string> script = {{"SLURM_PROCID", "0"},
                                                     {"SLURM_NTASKS", "4"},
                                                     {"SLURM_LOCALID", "0"},
                                                     {"MASTER_ADDR", "node1"},
                                                     {"MASTER_PORT", "29500"}};
  Set(script);
  EXPECT_EQ(ReadLauncher().count, 1);
  std::map<std::string, std::string> step = script;
  step.insert_or_assign("SLURM_STEP_ID", std::string("0"));
  step.insert_or_assign("SLURM_PROCID", std::string("3"));
  Set(step);
  EXPECT_EQ(ReadLauncher().count, 4);
  EXPECT_EQ(ReadLauncher().rank, 3);
  EXPECT_FALSE(ReadLauncher().has_store);
  step.erase("MASTER_ADDR");
  Set(step);
  EXPECT_EQ(ReadLauncher().count, 1);
}

TEST_F(LauncherTest, ShardsNeedNoAddress) {
  EXPECT_EQ(ReadLauncherShard().count, 1);
  Set({{"RANK", "2"}, {"WORLD_SIZE", "5"}});
  EXPECT_EQ(ReadLauncherShard().index, 3);
  EXPECT_EQ(ReadLauncherShard().count, 5);
  Set({{"SLURM_PROCID", "1"}, {"SLURM_NTASKS", "4"}});
  EXPECT_EQ(ReadLauncherShard().count, 1) << "a batch script, not a step";
  Set({{"SLURM_PROCID", "1"}, {"SLURM_NTASKS", "4"}, {"SLURM_STEP_ID", "0"}});
  EXPECT_EQ(ReadLauncherShard().index, 2);
  EXPECT_EQ(ReadLauncherShard().count, 4);
  Set({{"RANK", "5"}, {"WORLD_SIZE", "5"}});
  EXPECT_THAT(ErrorOf(ReadLauncherShard), HasSubstr("RANK is '5'"));
  const Shard shard = {2, 3};
  for (int i = 0; i < 9; ++i) EXPECT_EQ(shard.Has(i), i % 3 == 1);
}

TEST_F(LauncherTest, NamesTheVariableThatIsWrong) {
  Set({{"RANK", "0"}});
  EXPECT_THAT(ErrorOf(ReadLauncher), HasSubstr("WORLD_SIZE"));
  Set({{"RANK", "2"}, {"WORLD_SIZE", "2"}});
  EXPECT_THAT(ErrorOf(ReadLauncher), HasSubstr("RANK is '2'"));
  Set({{"RANK", "-1"}, {"WORLD_SIZE", "2"}});
  EXPECT_THAT(ErrorOf(ReadLauncher), HasSubstr("RANK"));
  Set({{"RANK", "0"}, {"WORLD_SIZE", "2"}});
  EXPECT_THAT(ErrorOf(ReadLauncher), HasSubstr("MASTER_ADDR"));
  Set({{"RANK", "0"}, {"WORLD_SIZE", "2"}, {"MASTER_ADDR", "a"}, {"MASTER_PORT", "70000"}});
  EXPECT_THAT(ErrorOf(ReadLauncher), HasSubstr("MASTER_PORT"));
}

}  // namespace
}  // namespace likeness
