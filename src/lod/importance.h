// How much of a frame's time a subvolume deserves (Li and Shen 2002, 4.3 and 5.4).
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace kairos {

/// What is known about a visible subvolume before it is rendered.
struct SubvolumeView {
  double maxOpacity = 0;     // highest opacity of any of its voxels, over one unit distance
  double distance = 0;       // world units from the eye to its centre
  double projectedArea = 0;  // pixels its bounding box covers on the image
  double x = 0, y = 0;       // pixels: the centre of that area
};

/// Importance of one subvolume: any number of 0 or more; only ratios matter.
using SubvolumeImportance = std::function<double(const SubvolumeView&)>;
/// Importances of all visible subvolumes of a frame.
using Importance = std::function<void(std::span<const SubvolumeView>, std::span<double>)>;

/// Any function of one subvolume: the user's own, too.
Importance perSubvolume(SubvolumeImportance function);

/// All alike.
Importance uniformImportance();
/// The maximum opacity.
Importance opacityImportance();
/// The reciprocal of the distance to the eye.
Importance distanceImportance();
/// The projected area of the bounding box.
Importance areaImportance();
/// A good radius for gazeImportance, as a fraction of the image's diagonal.
inline constexpr double kGazeRadius = 0.06;

/// Falls with the distance g from the gaze at image position (x, y), in pixels, to the centre of the
/// projected area: 1 / (1 + (g / radius)^2).
Importance gazeImportance(double x, double y, double radius);

/// The weighted sum of importances, each first brought to a sum of one over the frame so that their units do
/// not matter.
struct WeightedImportance {
  Importance importance;
  double weight = 1;
};
Importance mixedImportance(std::vector<WeightedImportance> parts);

}  // namespace kairos
