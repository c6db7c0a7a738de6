#include "tcdvrm/renderer_factory.h"

#include "core/error.h"
#include "diff/differential_renderer.h"
#include "diff/dvrm_renderer.h"
#include "tcdvrm/anytime_renderer.h"
#include "tcdvrm/lowres_renderer.h"
#include "tcdvrm/tcdvrm_renderer.h"
#include "tcdvrm/tiles_renderer.h"

namespace kairos {

std::unique_ptr<FrameRenderer> makeRenderer(const Lattice& lattice, const RenderSettings& settings,
                                            const RendererOptions& options) {
  const bool asPublished =
      options.method == Method::dvrm || options.method == Method::tldvrm || options.method == Method::tcdvrm;
  if (settings.error > 0 && asPublished)
    throw OptionError("--error",
                      std::string("--method ") + name(options.method) +
                          " recasts the rays that changed voxels project to, but with them a brick's "
                          "sample distance may change; expected another method");
  if (budgeted(options.method) && !takes(options.method, options.budget))
    throw OptionError("--budget", std::string("--method ") + name(options.method) +
                                      " cannot stop at an error, expected --method anytime");
  switch (options.method) {
    case Method::full:
    case Method::segments:
      return std::make_unique<DifferentialRenderer>(lattice, settings, options);
    case Method::dvrm:
    case Method::tldvrm:
      return std::make_unique<DvrmRenderer>(lattice, settings, options);
    case Method::tcdvrm:
      return std::make_unique<TcdvrmRenderer>(lattice, settings, options);
    case Method::anytime:
      return std::make_unique<AnytimeRenderer>(lattice, settings, options);
    case Method::tiles:
      return std::make_unique<TilesRenderer>(lattice, settings, options);
    case Method::lowres:
      return std::make_unique<LowresRenderer>(lattice, settings, options);
    default:
      throw OptionError("--method", std::string("this build has no \"") + name(options.method) + "\"");
  }
}

}  // namespace kairos
