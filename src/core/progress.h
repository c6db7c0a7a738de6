// How a long-running library call tells its caller where it is. Libraries never print.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "core/error.h"

namespace kairos {

/// Called after each finished unit of work with (done, total).
using ProgressCallback = std::function<void(int64_t done, int64_t total)>;

/// Set by a signal handler or another thread; long calls check it between units of work.
class StopFlag {
 public:
  void request() noexcept { stop_.store(true, std::memory_order_relaxed); }
  bool requested() const noexcept { return stop_.load(std::memory_order_relaxed); }
  /// Throws Interrupted once `request` was called.
  void check() const {
    if (requested()) throw Interrupted();
  }

 private:
  std::atomic<bool> stop_{false};
};

}  // namespace kairos
