// What `kairos info` says of a sequence.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "io/sequence.h"

namespace kairos {

std::string sequenceText(const SequenceReader& reader);
nlohmann::ordered_json sequenceJson(const SequenceReader& reader);

}  // namespace kairos
