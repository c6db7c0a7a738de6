// Which views the methods under a budget can serve.
#pragma once

#include "core/error.h"
#include "raycast/render_settings.h"
#include "raycast/tile_caster.h"

namespace kairos {

/// The settings as they are. Throws OptionError for projections, whose values are classified after they are
/// combined, and for depth, which is infinite beside what is seen.
inline const RenderSettings& interpolatable(const RenderSettings& settings) {
  if (settings.mode != RenderMode::dvr)
    throw OptionError("--budget", "needs --mode dvr: a projection cannot be interpolated");
  if (settings.depth) throw OptionError("--aov", "depth needs an exact method: it cannot be interpolated");
  return settings;
}

/// The caster as it is. Throws OptionError for a view so large that its segments are not listed
/// (TileCaster::index).
inline const TileCaster& withSegmentLists(const TileCaster& caster) {
  if (!caster.index())
    throw OptionError("--size",
                      "the view has too many ray segments to list, expected a smaller image for a "
                      "method under a budget");
  return caster;
}

}  // namespace kairos
