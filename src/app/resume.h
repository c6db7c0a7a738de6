// Which frames of an animation stand already.
#pragma once

#include <cstdint>
#include <string>

#include "raycast/render_settings.h"
#include "volume/field.h"

namespace kairos {

/// A hash of everything that decides a frame's pixels and how they are stored, apart from the step's own
/// voxels. `further` adds what the caller knows. Method and thread count are not in it: they change no bit.
uint64_t settingsFingerprint(const RenderSettings& settings, const Lattice& lattice,
                             const std::string& further);

/// What a frame carries as "kairos:settings": the fingerprint together with the step's identity.
std::string frameFingerprint(uint64_t settings, uint64_t stepIdentity);

/// Is `path` a whole, readable image of this size that carries `fingerprint`? (And `png`, unless empty, an
/// image too.)
bool frameStands(const std::string& path, const std::string& png, const RenderSettings& settings,
                 const std::string& fingerprint);

}  // namespace kairos
