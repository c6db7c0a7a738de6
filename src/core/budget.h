// What a frame may cost, and the clock it is measured with.
#pragma once

#include <cstdint>

namespace kairos {

/// A limit for each frame: wall-clock time, from the moment a step is handed over to its finished image, or
/// samples, with which two runs give the same bits.
struct Budget {
  double milliseconds = 0;  // 0: no limit of time
  uint64_t samples = 0;     // 0: no limit of samples

  static Budget time(double ms) { return {ms, 0}; }
  static Budget framesPerSecond(double rate) { return {1000 / rate, 0}; }
  static Budget ofSamples(uint64_t count) { return {0, count}; }
  bool limited() const { return milliseconds > 0 || samples > 0; }
};

/// Where budgeted renderers read the time. A virtual clock in its place makes what they do repeatable: it
/// advances by what it is told was worked.
class BudgetClock {
 public:
  virtual ~BudgetClock() = default;
  /// Milliseconds from an arbitrary moment on.
  virtual double now() = 0;
  /// Told after each piece of work, before the time is read next.
  virtual void worked(uint64_t /*samples*/, uint64_t /*segments*/) {}
};

/// std::chrono::steady_clock.
BudgetClock& steadyBudgetClock();

/// Processor time of all of the process's threads. With one thread it is the time that an idle machine would
/// have taken.
BudgetClock& processorBudgetClock();

}  // namespace kairos
