#include "core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace kairos {

struct ThreadPool::Arena {
  // TBB caps its workers at the hardware's count unless told otherwise; `--threads 8` on two cores must mean eight.
  tbb::global_control limit;
  tbb::task_arena arena;
  explicit Arena(int threads)
      : limit(tbb::global_control::max_allowed_parallelism, std::max(threads, tbb::info::default_concurrency())),
        arena(threads) {}
};

ThreadPool::ThreadPool(int threads)
    : threads_(threads > 0 ? threads : tbb::info::default_concurrency()), arena_(std::make_unique<Arena>(threads_)) {}

ThreadPool::~ThreadPool() = default;

void ThreadPool::forEach(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
  if (count == 0) return;
  grain = std::max<size_t>(grain, 1);
  if (threads_ == 1 || count <= grain) {
    for (size_t b = 0; b < count; b += grain) body(b, std::min(count, b + grain));
    return;
  }
  arena_->arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, grain), [&](const auto& r) { body(r.begin(), r.end()); },
        tbb::simple_partitioner{});
  });
}

}  // namespace kairos
