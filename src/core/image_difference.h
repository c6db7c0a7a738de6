// How far two images are apart.
#pragma once

#include "core/image.h"

namespace kairos {

/// RMSE and maximum are over all four premultiplied linear channels. PSNR is -20 log10(rmse) (peak 1;
/// infinite for equal images). SSIM (Wang et al. 2004) and FLIP (Andersson et al. 2020, LDR, 67 pixels per
/// degree) are those of the images as displayed: over black, sRGB.
struct ImageDifference {
  double rmse = 0, max = 0, psnr = 0, ssim = 1, flip = 0;
};

/// Throws OptionError when the sizes differ, naming both; images must have 4 channels. NaN counts as a
/// difference of infinity, even against NaN; for SSIM it shows as black, for FLIP its pixel has error 1.
ImageDifference compareImages(const Image& a, const Image& b);

/// The two measures that cost no more than reading the images, as in ImageDifference.
struct ColourError {
  double rmse = 0, max = 0;
};
ColourError colourError(const Image& a, const Image& b);
/// -20 log10(rmse): peak 1; infinite for 0.
double psnrOf(double rmse);

/// FLIP's per-pixel error map in [0, 1], one channel.
Image flipMap(const Image& a, const Image& b);

}  // namespace kairos
