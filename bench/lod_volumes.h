// The two volumes of the experiments with levels of detail, of the sizes that Li and Shen (2002) used.
#pragma once

#include <string>

#include "core/parallel.h"
#include "core/transfer_function.h"
#include "volume/field.h"

namespace kairos::bench {

struct LodVolumeScene {
  std::string name;
  Lattice lattice;
  Field field;
  TransferFunction transferFunction;  // over values 0 to 1
  int paperSubvolumes;
};

/// 222 x 253 x 103 floats like the flow over a delta wing: two vortices that leave the leading edges, roll
/// up, grow downstream and burst, over a thin wing.
LodVolumeScene deltaWing(ThreadPool& pool);

/// 256 x 256 x 145 floats like an MRI of a head: scalp, skull, folded grey matter, white matter, ventricles,
/// and the scanner's noise.
LodVolumeScene brain(ThreadPool& pool);

}  // namespace kairos::bench
