// Time as the LOD renderer sees it: injected, so that time control is tested exactly.
#pragma once

#include <chrono>

namespace kairos {

class Clock {
 public:
  virtual ~Clock() = default;
  /// Seconds since some moment; never goes back.
  virtual double seconds() = 0;
};

class SteadyClock : public Clock {
 public:
  double seconds() override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
};

}  // namespace kairos
