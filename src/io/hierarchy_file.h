// Levels of detail of a time step, kept beside its sequence so that the next run need not compute them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kairos {

/// Two arrays of numbers that follow from a field; what they mean is the renderer's business.
struct StoredHierarchy {
  std::vector<float> values;
  std::vector<double> statistics;

  bool operator==(const StoredHierarchy&) const = default;
};

/// Writes atomically. `identity` stands for everything the arrays were computed from. Throws OutputError.
void writeHierarchy(const std::string& path, uint64_t identity, const StoredHierarchy& hierarchy);

/// Nothing where the file is missing, unreadable, damaged, or belongs to another identity: it only saves
/// time, and is then computed anew.
std::optional<StoredHierarchy> readHierarchy(const std::string& path, uint64_t identity);

}  // namespace kairos
