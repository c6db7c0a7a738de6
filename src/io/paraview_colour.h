// How ParaView interpolates colours and opacities between the points of a colour map.
#pragma once

#include <array>
#include <string>

namespace kairos {

/// Display (sRGB) components in [0, 1].
using DisplayColour = std::array<double, 3>;

enum class ParaViewColourSpace { rgb, hsv, hsvWrapped, lab, diverging, step };

/// vtkColorTransferFunction between two neighbouring points of sharpness 0, s in [0, 1].
DisplayColour interpolateParaViewColour(ParaViewColourSpace space, const DisplayColour& a,
                                        const DisplayColour& b, double s);

/// vtkPiecewiseFunction between two neighbouring points, whose first one has this midpoint and sharpness.
double interpolateParaViewOpacity(double a, double b, double midpoint, double sharpness, double s);

}  // namespace kairos
