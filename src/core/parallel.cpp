#include "core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <optional>

// TBB is not built for ThreadSanitizer, which therefore cannot see that a loop's bodies run after what its
// caller did before and before what it does afterwards.
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#else
static void __tsan_acquire(void*) {}
static void __tsan_release(void*) {}
#endif

namespace kairos {

struct ThreadPool::Arena {
  // TBB caps its workers at the hardware's count unless told otherwise; `--threads 8` on two cores must mean
  // eight. The smallest cap in force counts, so every pool that needs more asks for the same, plenty.
  std::optional<tbb::global_control> limit;
  tbb::task_arena arena;
  explicit Arena(int threads) : arena(threads) {
    constexpr int kPlenty = 1 << 14;
    if (threads > tbb::info::default_concurrency())
      limit.emplace(tbb::global_control::max_allowed_parallelism, size_t(std::max(threads, kPlenty)));
  }
};

ThreadPool::ThreadPool(int threads)
    : threads_(threads > 0 ? threads : tbb::info::default_concurrency()),
      arena_(std::make_unique<Arena>(threads_)) {}

ThreadPool::~ThreadPool() = default;

void ThreadPool::run(size_t count, size_t grain, BodyReference body) {
  if (count == 0) return;
  grain = std::max<size_t>(grain, 1);
  if (threads_ == 1 || count <= grain) {
    for (size_t b = 0; b < count; b += grain) body(b, std::min(count, b + grain));
    return;
  }
  char begun = 0, done = 0;  // their addresses stand for these two moments
  __tsan_release(&begun);
  const auto part = [&](const tbb::blocked_range<size_t>& range) {
    __tsan_acquire(&begun);
    body(range.begin(), range.end());
    __tsan_release(&done);
  };
  arena_->arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, grain), part, tbb::simple_partitioner{});
  });
  __tsan_acquire(&done);
}

}  // namespace kairos
