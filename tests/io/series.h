// Procedural series of fields, and what changes between them.
#pragma once

#include <string>
#include <vector>

#include "io/sequence.h"

namespace kairos::test {

/// `count` fields of a moving, pulsing blob: leaves appear and vanish, f32 has NaNs with payload, negative
/// zeros and infinities that come and go, u16 uses its whole range.
std::vector<Field> movingBlob(ElementType type, int count, int edge = 24);

/// All voxels that differ bitwise, leaf by leaf: slow and obviously right.
ChangedVoxels changesBetween(const Field& before, const Field& after);

/// Voxels of both fields are the same bits.
bool sameState(const Field& a, const Field& b);

SequenceManifest manifestFor(const std::vector<Field>& fields);
SequenceStep entryFor(const Field& field, int64_t step, const ChangedVoxels* changes);

/// Writes fields [from, to) as steps 21, 22, ...
void writeSteps(SequenceWriter& writer, const std::vector<Field>& fields, size_t from, size_t to,
                int keyEvery = 0);
void writeSequence(const std::string& directory, const std::vector<Field>& fields, int keyEvery = 0);

}  // namespace kairos::test
