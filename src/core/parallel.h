// How many threads a piece of work may use. One TBB arena per renderer or command; no global state.
#pragma once

#include <cstddef>
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
  /// are done. The first exception thrown by a body is rethrown here. The body is not
  /// copied.
  template <class Body>
  void forEach(size_t count, size_t grain, const Body& body) {
    run(count, grain,
        {&body, [](const void* b, size_t begin, size_t end) { (*static_cast<const Body*>(b))(begin, end); }});
  }

 private:
  struct Arena;
  // A body that the caller keeps.
  struct BodyReference {
    const void* body;
    void (*call)(const void* body, size_t begin, size_t end);
    void operator()(size_t begin, size_t end) const { call(body, begin, end); }
  };

  void run(size_t count, size_t grain, BodyReference body);

  int threads_;
  std::unique_ptr<Arena> arena_;
};

}  // namespace kairos
