// sequence.json.
#pragma once

#include <string>

#include "io/sequence.h"

namespace kairos {

std::string manifestPath(const std::string& directory);
/// The file's text, its own checksum included.
std::string manifestText(const SequenceManifest& manifest);
/// The first entry in which two manifests of the same simulation would differ, as "tolerance 0.5 instead of
/// 0"; empty when all that must agree for resuming does.
std::string manifestDifference(const SequenceManifest& found, const SequenceManifest& wanted);

/// Name of the one grid in the sequence's files: the manifest's, as far as it is UTF-8.
std::string gridNameInFiles(const SequenceManifest& m);
std::string keyPathOf(const std::string& directory, int64_t step);
std::string differentialPathOf(const std::string& directory, int64_t step);

}  // namespace kairos
