// The instruction sets a kernel is compiled for, and the choice among them.
#pragma once

#include <hwy/targets.h>

#include <cstdint>
#include <span>

#include "raycast/tile_kernel.h"

namespace kairos {

/// One compilation of a kernel: its instruction set, Highway's bit for it, and what picks its instance for a
/// scene.
struct KernelTarget {
  Isa isa;
  int64_t bit;
  TileKernel (*select)(const KernelScene&);
};

/// Can this machine run it?
inline bool isSupported(const KernelTarget& target) {
  static const int64_t here = hwy::SupportedTargets();
  return (target.bit & here) != 0;
}

/// The first of `targets` (best first) that this machine can run and that `isa` means; null where none is.
inline const KernelTarget* findTarget(std::span<const KernelTarget> targets, Isa isa) {
  for (const KernelTarget& target : targets)
    if (isSupported(target) && (isa == Isa::automatic || isa == target.isa)) return &target;
  return nullptr;
}

}  // namespace kairos
