#include "core/budget.h"

#include <chrono>

namespace kairos {
namespace {

class SteadyBudgetClock : public BudgetClock {
 public:
  double now() override {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
};

}  // namespace

BudgetClock& steadyBudgetClock() {
  static SteadyBudgetClock clock;
  return clock;
}

}  // namespace kairos
