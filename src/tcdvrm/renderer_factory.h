// One way to every method.
#pragma once

#include <memory>

#include "diff/frame_renderer.h"

namespace kairos {

/// The renderer of `options.method`. Throws OptionError naming the setting that is out of range.
std::unique_ptr<FrameRenderer> makeRenderer(const Lattice& lattice, const RenderSettings& settings,
                                            const RendererOptions& options);

}  // namespace kairos
