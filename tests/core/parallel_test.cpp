#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace kairos {
namespace {

class ThreadPoolOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, ThreadPoolOf, testing::Range(1, 9));

TEST_P(ThreadPoolOf, CoversEachIndexOnceInPartsNoLongerThanTheGrain) {
  ThreadPool pool(GetParam());
  EXPECT_EQ(pool.threads(), GetParam());
  for (size_t count : {1, 2, 63, 64, 65, 1000})
    for (size_t grain : {1, 7, 64, 5000}) {
      std::vector<std::atomic<int>> visits(count);
      std::atomic<size_t> longest{0};
      pool.forEach(count, grain, [&](size_t begin, size_t end) {
        size_t seen = longest;
        while (end - begin > seen && !longest.compare_exchange_weak(seen, end - begin)) {
        }
        for (size_t i = begin; i < end; ++i) ++visits[i];
      });
      for (size_t i = 0; i < count; ++i) ASSERT_EQ(visits[i], 1) << "index " << i << " of " << count;
      EXPECT_LE(longest, grain);
      EXPECT_GE(longest, 1u);
    }
}

TEST_P(ThreadPoolOf, RethrowsAndStaysUsable) {
  ThreadPool pool(GetParam());
  const auto failing = [](size_t begin, size_t) {
    if (begin == 42) throw std::out_of_range("voxel 42");
  };
  try {
    pool.forEach(100, 1, failing);
    FAIL() << "nothing thrown";
  } catch (const std::out_of_range& e) {
    EXPECT_STREQ(e.what(), "voxel 42");
  }
  std::atomic<size_t> done{0};
  pool.forEach(100, 1, [&](size_t begin, size_t end) { done += end - begin; });
  EXPECT_EQ(done, 100u);
}

TEST_P(ThreadPoolOf, NothingToDoCallsNothing) {
  ThreadPool pool(GetParam());
  pool.forEach(0, 16, [](size_t, size_t) { FAIL() << "called for an empty range"; });
}

TEST_P(ThreadPoolOf, ReallyRunsAsManyAtOnceEvenOnFewerCores) {
  using Clock = std::chrono::steady_clock;
  const int threads = GetParam();
  ThreadPool pool(threads);
  std::atomic<int> arrived{0};
  const auto deadline = Clock::now() + std::chrono::seconds(30);
  pool.forEach(size_t(threads), 1, [&](size_t, size_t) {
    ++arrived;
    while (arrived < threads && Clock::now() < deadline) std::this_thread::yield();
  });
  EXPECT_LT(Clock::now(), deadline) << "the bodies never ran at the same time";
}

TEST(ThreadPool, OneThreadIsTheCallersOwnAndRunsInOrder) {
  ThreadPool pool(1);
  std::vector<size_t> begins;
  pool.forEach(10, 4, [&, caller = std::this_thread::get_id()](size_t begin, size_t) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    begins.push_back(begin);
  });
  EXPECT_EQ(begins, (std::vector<size_t>{0, 4, 8}));
}

TEST(ThreadPool, DefaultsToAllHardwareThreads) {
  EXPECT_GE(ThreadPool().threads(), 1);
}

TEST(ThreadPool, BodiesMayUseThePoolAgain) {
  ThreadPool pool(3);
  std::atomic<int> calls{0};
  pool.forEach(8, 1, [&](size_t, size_t) { pool.forEach(8, 1, [&](size_t, size_t) { ++calls; }); });
  EXPECT_EQ(calls, 64);
}

}  // namespace
}  // namespace kairos
