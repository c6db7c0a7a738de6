// How many threads a piece of work may use. One TBB arena per renderer or command; no global state.
#pragma once

#include <functional>
#include <memory>

namespace kairos {

/// Runs work inside an arena of `threads` threads (0: all hardware threads). Not copyable; cheap to pass by
/// reference.
class ThreadPool {
 public:
  explicit ThreadPool(int threads = 0);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return threads_; }

  /// Calls body(begin, end) over disjoint parts of [0, count), each at most `grain` long; returns when all
  /// are done. The first exception thrown by a body is rethrown here.
  void forEach(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body);

 private:
  struct Arena;
  int threads_;
  std::unique_ptr<Arena> arena_;
};

}  // namespace kairos
