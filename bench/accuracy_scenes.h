// The scenes of the accuracy benchmark: data sets by element types and transfer functions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "raycast/render_settings.h"
#include "volume/field.h"

namespace kairos::bench {

/// soft: opacity rises gently over the range. band: two narrow windows with steep sides, as isosurface-like
/// pictures have them.
enum class Classification { soft, band };

struct AccuracyScene {
  std::string name;  // plume/u8
  Lattice lattice;
  Field field;
  ValueRange range;
  std::vector<Field> before;  // earlier time steps, in order; none of static data

  /// 512x512, perspective, from a corner.
  RenderSettings settings(Classification classification) const;
};

/// plume (the last of four steps) and noise (one) as u8 and f32; with a directory of data sets (jets/jet2,
/// smoke) also the last of four steps of each of these.
std::vector<AccuracyScene> accuracyScenes(const std::string& dataDirectory);

}  // namespace kairos::bench
