// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kairos {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// "740 B", "25.2 MB": powers of ten, three digits.
std::string byteText(double bytes);
/// "1 234 567".
std::string groupedText(uint64_t count);
/// "3.21 %", "0.00012 %", "0 %".
std::string percentText(double fraction);
/// "0.8 s", "75 s", "12 min 5 s".
std::string durationText(double seconds);
/// "1 step", "3 steps".
std::string countText(uint64_t count, const std::string& singular);
/// The first few, joined by ", ", and how many more there are.
std::string listText(const std::vector<std::string>& items, size_t shown = 5);

/// Of an unsorted list; 0 when empty.
double median(std::vector<double> values);

}  // namespace kairos
