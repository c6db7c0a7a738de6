// The records of `kairos bench` as JSON and CSV.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "app/bench_records.h"

namespace kairos {

/// Everything but the pictures themselves; docs/file-formats.md describes the entries. Numbers that JSON does
/// not have (the PSNR of equal images is infinite) are null.
nlohmann::ordered_json benchJson(const BenchReport& report);

/// One row per frame, a header first.
std::string benchCsv(const BenchReport& report);

}  // namespace kairos
