// What the program runs on, for records of measurements.
#pragma once

#include <cstdint>
#include <string>

namespace kairos {

/// "AMD EPYC 9B14"; "unknown" where the system does not say.
std::string processorName();
/// "Linux 6.1.0".
std::string systemName();
/// "GCC 12.2.0".
std::string compilerName();
uint64_t systemMemory();
/// Over the last minute; negative where the system does not say.
double loadAverage();
/// "2026-11-22 14:03 UTC".
std::string currentTime();

}  // namespace kairos
