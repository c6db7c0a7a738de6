#include "core/budget.h"

#include <chrono>
#include <ctime>

namespace kairos {
namespace {

class SteadyBudgetClock : public BudgetClock {
 public:
  double now() override {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
};

class ProcessorBudgetClock : public BudgetClock {
 public:
  double now() override {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return double(time.tv_sec) * 1e3 + double(time.tv_nsec) * 1e-6;
  }
};

}  // namespace

BudgetClock& steadyBudgetClock() {
  static SteadyBudgetClock clock;
  return clock;
}

BudgetClock& processorBudgetClock() {
  static ProcessorBudgetClock clock;
  return clock;
}

}  // namespace kairos
