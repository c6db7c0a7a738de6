// Option values as typed, turned into numbers. The functions that take the option's name throw OptionError
// with it, what was found and what was expected.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/budget.h"
#include "core/vec3.h"

namespace kairos {

/// The whole of `text` as a finite number, or nothing.
std::optional<double> parsedNumber(const std::string& text);
/// The whole of `text` as a whole number, or nothing.
std::optional<int64_t> parsedInteger(const std::string& text);
/// The words between commas; empty ones are kept.
std::vector<std::string> commaSeparated(const std::string& text);

/// Throws OptionError: `OPTION: found "TEXT", expected EXPECTED`.
[[noreturn]] void refuseValue(const std::string& option, const std::string& text,
                              const std::string& expected);

/// A finite number in [lo, hi].
double numberOption(const std::string& option, const std::string& text, double lo, double hi,
                    const std::string& expected);
/// A whole number in [lo, hi].
int64_t integerOption(const std::string& option, const std::string& text, int64_t lo, int64_t hi,
                      const std::string& expected);
/// `count` finite numbers with commas between them.
std::vector<double> numbersOption(const std::string& option, const std::string& text, size_t count,
                                  const std::string& expected);
Vec3d vectorOption(const std::string& option, const std::string& text, const std::string& expected);
/// A number of bytes with an optional suffix KiB, MiB, GiB or TiB.
uint64_t bytesOption(const std::string& option, const std::string& text);

/// "40ms", "25fps", "samples:2000000" (also 2e6) or "error:1e-3".
Budget budgetOption(const std::string& option, const std::string& text);

/// Time steps "A-B", "A", "A-" or "-B", both ends included.
struct StepRange {
  std::optional<int64_t> first, last;
  bool contains(int64_t step) const { return (!first || step >= *first) && (!last || step <= *last); }
};
StepRange stepRangeOption(const std::string& option, const std::string& text);

/// The position of `text` in `choices`.
size_t choiceOption(const std::string& option, const std::string& text,
                    const std::vector<std::string>& choices);

}  // namespace kairos
