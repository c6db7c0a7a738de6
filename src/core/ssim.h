// The structural similarity index (Wang, Bovik, Sheikh, Simoncelli 2004).
#pragma once

#include "core/image.h"

namespace kairos {

/// Mean SSIM of the Rec. 709 luma of the displayed images (over black, clipped, sRGB-encoded, peak 1):
/// Gaussian window of 11x11 and sigma 1.5, K1 = 0.01, K2 = 0.03. As in the original (and in scikit-image with
/// its Gaussian weights) the mean is over the pixels whose window lies inside the image; when there are none,
/// over all, with repeated borders. Images have 4 channels and equal sizes. NaN shows as black.
double meanSsim(const Image& a, const Image& b);

}  // namespace kairos
