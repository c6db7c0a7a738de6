// Reading ahead: the next time steps are read and compared while the current one is rendered.
#pragma once

#include <exception>
#include <memory>
#include <thread>

#include "app/step_source.h"
#include "core/bounded_queue.h"

namespace kairos {

/// Steps [first, last] of a source, in order, the first one whole; at most two are ready or being read ahead.
/// Uses the source from a thread of its own until it is destroyed.
class StepStream {
 public:
  StepStream(StepSource& source, size_t first, size_t last);
  /// Waits for the step being read, and drops what was read ahead.
  ~StepStream();

  /// The next step, or null after the last. Rethrows what reading it threw.
  std::unique_ptr<LoadedStep> next();

 private:
  void load(size_t first, size_t last);

  StepSource& source_;
  BoundedQueue<std::unique_ptr<LoadedStep>> queue_{1};
  std::exception_ptr failure_;  // written before the queue is closed, read after it is drained
  std::thread thread_;
};

}  // namespace kairos
