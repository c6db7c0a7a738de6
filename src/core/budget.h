// What a frame may cost, and the clock it is measured with.
#pragma once

#include <cstdint>

namespace kairos {

/// A limit for each frame: wall-clock time, from the moment a step is handed over to its finished image;
/// samples, with which two runs give the same bits; or an error that is good enough, with which they do, too.
struct Budget {
  double milliseconds = 0;  // 0: no limit of time
  uint64_t samples = 0;     // 0: no limit of samples
  double error = 0;         // RMSE, colours 0 to 1, that the frame may have; 0: no such goal

  static Budget time(double ms) { return {.milliseconds = ms}; }
  static Budget framesPerSecond(double rate) { return {.milliseconds = 1000 / rate}; }
  static Budget ofSamples(uint64_t count) { return {.samples = count}; }
  static Budget ofError(double rmse) { return {.error = rmse}; }
  bool limited() const { return milliseconds > 0 || samples > 0 || error > 0; }
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
