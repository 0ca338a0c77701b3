#include "likeness/train/image_cache.h"

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
  ImageU8 image, counts;
};

// Runs of all lengths that count; colours elsewhere too.
Views RandomViews(int width, int height, double share, uint64_t seed) {
  Random random(seed);
  Views views = {ImageU8(width, height, 3), ImageU8(width, height, 1)};
  for (uint8_t& value : views.image.values()) value = static_cast<uint8_t>(random.Below(256));
  bool counts = false;
  for (uint8_t& value : views.counts.values()) {
    if (random.Uniform() < 0.1) counts = random.Uniform() < share;
    value = counts ? 255 : 0;
  }
  return views;
}

TEST(PackedImage, KeepsWhatCounts) {
  for (const int width : {1, 3, 8, 37, 64}) {
    for (const double share : {0.0, 0.4, 1.0}) {
      SCOPED_TRACE(fmt::format("width {}, share {}", width, share));
      const int height = width + 2;
      const Views views = RandomViews(width, height, share, 7);
      const PackedImage packed(views.image, views.counts);
      ImageU8 image, counts;
      packed.Unpack(width, height, &image, &counts);
      EXPECT_EQ(counts, views.counts);
      size_t count = 0;
      for (size_t i = 0; i < counts.values().size(); ++i) {
        const bool does = views.counts.values()[i] != 0;
        count += does ? 1 : 0;
        for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
          EXPECT_EQ(image.values()[c], does ? views.image.values()[c] : 0);
        }
      }
      EXPECT_EQ(packed.bytes().size(), (counts.values().size() + 7) / 8 + 3 * count);
    }
  }
}

TEST(PackedImage, WithoutAMaskBlackDoesNotCount) {
  ImageU8 image(4, 4, 3), read, counts;
  image.at(1, 2)[1] = 5;
  image.at(3, 3)[0] = 9;
  PackedImage(image, {}).Unpack(4, 4, &read, &counts);
  EXPECT_EQ(read, image);
  EXPECT_EQ(std::count(counts.values().begin(), counts.values().end(), 255), 2);
}

class ImageCacheTest : public testing::Test {
 protected:
  static constexpr int kCount = 40, kSize = 32;
  static PackedImage Make(int i) {
    const Views views = RandomViews(kSize, kSize, 0.5, static_cast<uint64_t>(i));
    return {views.image, views.counts};
  }
  static size_t AllBytes() {
    size_t bytes = 0;
    for (int i = 0; i < kCount; ++i) bytes += Make(i).bytes().size();
    return bytes;
  }
  // Reads everything twice from four threads.
  static void ReadAll(ImageCache* cache) {
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

TEST_F(ImageCacheTest, MemoryStaysInItsBounds) {
  for (const double share : {0.0, 0.1, 0.5, 1.0}) {
    const auto budget = static_cast<size_t>(share * static_cast<double>(AllBytes()));
    ImageCache cache(kCount, Make, budget, {});
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

TEST_F(ImageCacheTest, TheFileHoldsTheRestAndLeavesNothingBehind) {
  {
    ImageCache cache(kCount, Make, AllBytes() / 10, scratch_ / "new" / "folder");
    ReadAll(&cache);
    EXPECT_EQ(cache.made(), kCount);
    EXPECT_EQ(cache.memory_bytes() + cache.file_bytes(), AllBytes());
    EXPECT_THAT(ListFolder(scratch_ / "new" / "folder"), testing::IsEmpty());
  }
  EXPECT_THAT(ErrorOf([] { ImageCache(1, Make, 0, "/proc/nowhere"); }), testing::HasSubstr("/proc/nowhere"));
}

TEST_F(ImageCacheTest, AFullDiskOnlyCostsTime) {
  SetQuiet(true);
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small = {10000, before.rlim_max};
  signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  ImageCache cache(kCount, Make, 0, scratch_.path());
  ReadAll(&cache);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, SIG_DFL);
  EXPECT_GT(cache.made(), kCount);
}

TEST_F(ImageCacheTest, WhatCannotBeReadIsAskedForAgain) {
  int calls = 0;
  ImageCache cache(1,
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
