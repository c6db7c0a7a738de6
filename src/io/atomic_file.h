// Files that appear under their final name complete or not at all.
#pragma once

#include <string>
#include <string_view>

namespace kairos {

/// Writes `bytes` beside `path` as "<path>.tmp-<pid>" and renames it. Throws OutputError when that cannot be
/// done (directory missing or not writable, disk full, `path` exists and is no regular file); nothing is left
/// behind then.
void writeFileAtomically(const std::string& path, std::string_view bytes);

/// Creates `directory` and its parents if needed, proves that files can be created in it, and removes
/// temporary files that killed processes left there. Throws OutputError.
void makeWritableDirectory(const std::string& directory);

}  // namespace kairos
