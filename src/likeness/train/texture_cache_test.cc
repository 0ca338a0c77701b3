#include "likeness/train/texture_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <thread>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

struct Views {
  ImageU8 texture, seen;
};

// Runs of seen texels of all lengths; colours where nothing is seen too.
Views RandomViews(int size, double share, uint64_t seed) {
  Random random(seed);
  Views views = {ImageU8(size, size, 3), ImageU8(size, size, 1)};
  for (uint8_t& value : views.texture.values()) value = static_cast<uint8_t>(random.Below(256));
  bool seen = false;
  for (uint8_t& value : views.seen.values()) {
    if (random.Uniform() < 0.1) seen = random.Uniform() < share;
    value = seen ? 255 : 0;
  }
  return views;
}

TEST(PackedTexture, KeepsWhatIsSeen) {
  for (const int size : {1, 3, 8, 37, 64}) {
    for (const double share : {0.0, 0.4, 1.0}) {
      SCOPED_TRACE(fmt::format("size {}, share {}", size, share));
      const Views views = RandomViews(size, share, 7);
      const PackedTexture packed(views.texture, views.seen);
      ImageU8 texture, seen;
      packed.Unpack(size, &texture, &seen);
      EXPECT_EQ(seen, views.seen);
      size_t count = 0;
      for (size_t i = 0; i < seen.values().size(); ++i) {
        const bool visible = views.seen.values()[i] != 0;
        count += visible ? 1 : 0;
        for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
          EXPECT_EQ(texture.values()[c], visible ? views.texture.values()[c] : 0);
        }
      }
      EXPECT_EQ(packed.bytes().size(), (seen.values().size() + 7) / 8 + 3 * count);
    }
  }
}

TEST(PackedTexture, WithoutAMaskBlackIsUnseen) {
  ImageU8 texture(4, 4, 3), read, seen;
  texture.at(1, 2)[1] = 5;
  texture.at(3, 3)[0] = 9;
  PackedTexture(texture, {}).Unpack(4, &read, &seen);
  EXPECT_EQ(read, texture);
  EXPECT_EQ(std::count(seen.values().begin(), seen.values().end(), 255), 2);
}

class TextureCacheTest : public testing::Test {
 protected:
  static constexpr int kCount = 40, kSize = 32;
  static PackedTexture Make(int i) {
    const Views views = RandomViews(kSize, 0.5, static_cast<uint64_t>(i));
    return {views.texture, views.seen};
  }
  static size_t AllBytes() {
    size_t bytes = 0;
    for (int i = 0; i < kCount; ++i) bytes += Make(i).bytes().size();
    return bytes;
  }
  // Reads everything twice from four threads.
  static void ReadAll(TextureCache* cache) {
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        for (int i = 0; i < 2 * kCount; ++i) {
          const int index = (7 * i + t) % kCount;
          EXPECT_EQ(cache->Get(index)->bytes(), Make(index).bytes()) << index;
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  ScratchFolder scratch_;
};

TEST_F(TextureCacheTest, MemoryStaysInItsBounds) {
  for (const double share : {0.0, 0.1, 0.5, 1.0}) {
    const auto budget = static_cast<size_t>(share * static_cast<double>(AllBytes()));
    TextureCache cache(kCount, Make, budget, {});
    ReadAll(&cache);
    EXPECT_LE(cache.memory_bytes(), budget);
    EXPECT_GE(cache.memory_bytes() + 3 * kSize * kSize, budget);
    EXPECT_EQ(cache.file_bytes(), 0u);
    if (share == 1) {
      EXPECT_EQ(cache.made(), kCount);
    }
    if (share == 0) {
      EXPECT_EQ(cache.made(), 4 * 2 * kCount);
    }
  }
}

TEST_F(TextureCacheTest, TheFileHoldsTheRestAndLeavesNothingBehind) {
  {
    TextureCache cache(kCount, Make, AllBytes() / 10, scratch_ / "new" / "folder");
    ReadAll(&cache);
    EXPECT_EQ(cache.made(), kCount);
    EXPECT_EQ(cache.memory_bytes() + cache.file_bytes(), AllBytes());
    EXPECT_THAT(ListFolder(scratch_ / "new" / "folder"), testing::IsEmpty());
  }
  EXPECT_THAT(ErrorOf([] { TextureCache(1, Make, 0, "/proc/nowhere"); }), testing::HasSubstr("/proc/nowhere"));
}

TEST_F(TextureCacheTest, AFullDiskOnlyCostsTime) {
  SetQuiet(true);
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small = {10000, before.rlim_max};
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  TextureCache cache(kCount, Make, 0, scratch_.path());
  ReadAll(&cache);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_DFL);
  EXPECT_GT(cache.made(), kCount);
}

TEST_F(TextureCacheTest, WhatCannotBeReadIsAskedForAgain) {
  int calls = 0;
  TextureCache cache(1,
                     [&](int i) {
                       if (++calls == 1) throw Error("gone");
                       return Make(i);
                     },
                     1 << 20, {});
  EXPECT_EQ(ErrorOf([&] { cache.Get(0); }), "gone");
  EXPECT_EQ(cache.Get(0)->bytes(), Make(0).bytes());
}

}  // namespace
}  // namespace likeness
