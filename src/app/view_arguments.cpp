#include "app/view_arguments.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/option_values.h"
#include "core/colour_map.h"
#include "core/error.h"
#include "io/transfer_function_file.h"

namespace kairos {
namespace {

constexpr const char* kPoint = "three numbers X,Y,Z in world units";
constexpr int kMaxEdge = 16384;

void addText(CLI::App& command, const char* group, const char* option, const char* placeholder,
             std::string& value, const std::string& help) {
  command.add_option(option, value, help)->group(group)->option_text(placeholder);
}

std::string colourMapList() {
  std::string list;
  for (const std::string& name : colourMapNames()) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// "512x512"
void interpretSize(const std::string& text, int& width, int& height) {
  const std::string expected = "WIDTHxHEIGHT in pixels, each from 1 to " + std::to_string(kMaxEdge);
  const size_t x = text.find('x');
  if (x == std::string::npos) refuseValue("--size", text, expected);
  const auto w = parsedInteger(text.substr(0, x)), h = parsedInteger(text.substr(x + 1));
  if (!w || !h || *w < 1 || *h < 1 || *w > kMaxEdge || *h > kMaxEdge) refuseValue("--size", text, expected);
  width = int(*w);
  height = int(*h);
}

ValueRange interpretRange(const std::string& text) {
  const char* const kExpected = "two numbers LO,HI with LO below HI, or auto";
  const auto ends = numbersOption("--range", text, 2, kExpected);
  const ValueRange range{float(ends[0]), float(ends[1])};
  if (!(range.lo < range.hi) || !std::isfinite(range.lo) || !std::isfinite(range.hi))
    refuseValue("--range", text, kExpected);
  return range;
}

// A table needs some width, also where all values are equal.
ValueRange widened(ValueRange range) {
  if (range.lo < range.hi) return range;
  const float margin = std::max(1.0f, std::abs(range.lo) * 1e-3f);
  return {range.lo, range.lo + margin};
}

// z is up; y where the view is along z.
Vec3d defaultUp(const Vec3d& direction) {
  const Vec3d z{0, 0, 1};
  return length(cross(direction, z)) > 1e-6 * length(direction) ? z : Vec3d{0, 1, 0};
}

}  // namespace

void ViewArguments::addTo(CLI::App& command) {
  addViewOptions(command);
  addTransferOptions(command);
  addSamplingOptions(command);
}

void ViewArguments::addViewOptions(CLI::App& command) {
  const auto add = [&](const char* option, const char* placeholder, std::string& value, const char* help) {
    addText(command, "View", option, placeholder, value, help);
  };
  add("--view", "NAME", words_.view,
      "look from x, -x, y, -y, z, -z or iso; the whole volume fits into the\nimage [iso]");
  add("--eye", "X,Y,Z", words_.eye, "or: the camera's position in world units (instead of --view)");
  add("--target", "X,Y,Z", words_.target, "with --eye: what it looks at [the volume's centre]");
  add("--up", "X,Y,Z", words_.up,
      "with --eye: what is up in the image [0,0,1, or 0,1,0 when looking along z]");
  add("--fov", "DEGREES", words_.fov, "vertical field of view, from 1 to 170 [30]");
  add("--ortho", "HEIGHT|fit", words_.ortho,
      "orthographic: the height of the image in world units, or fit (with\n--view) to show the whole volume "
      "[perspective]");
  add("--size", "WxH", words_.size, "image size in pixels, each from 1 to 16384 [512x512]");
}

void ViewArguments::addTransferOptions(CLI::App& command) {
  const auto add = [&](const char* option, const char* placeholder, std::string& value,
                       const std::string& help) {
    addText(command, "Transfer function", option, placeholder, value, help);
  };
  add("--tf", "NAME|FILE", words_.transferFunction,
      "a built-in map (" + colourMapList() +
          "),\nstretched over the range of the values; or a file: ParaView colour-map\nJSON with opacity "
          "points, or rows "
          "\"value r g b a\" (linear colour,\nopacity per unit distance), in the simulation's values [" +
          colourMapNames().front() + "]");
  add("--range", "LO,HI|auto", words_.range,
      "stretch the transfer function over these values; auto: those of the\nwhole sequence. Simulation files "
      "take a "
      "first pass for that, which\nLO,HI avoids [auto for a built-in map, else the file's own]");
  add("--unit-distance", "D", words_.unitDistance,
      "world units over which the transfer function's opacity is meant,\nabove 0 [one voxel]");
}

void ViewArguments::addSamplingOptions(CLI::App& command) {
  const char* const kGroup = "Sampling";
  const auto add = [&](const char* option, const char* placeholder, std::string& value, const char* help) {
    addText(command, kGroup, option, placeholder, value, help);
  };
  add("--step", "VOXELS", words_.step, "distance between samples in voxels, from 1/64 to 64 [1]");
  command
      .add_flag("--preintegrated", base_.preintegrated,
                "integrate the transfer function between samples: as good as post-classified\nsamples many "
                "times closer where it is steep (dvr, trilinear, unshaded)")
      ->group(kGroup);
  add("--error", "E", words_.error,
      "pre-integrated, with a sample distance of its own in every brick, for an\nexpected root-mean-square "
      "error of at most E on colours from 0 to 1, from\n1e-6 to 0.5 [none]");
  add("--filter", "NAME", words_.filter, "trilinear or nearest [trilinear]");
  add("--mode", "NAME", words_.mode,
      "dvr: emission and absorption; mip: the largest value of each ray;\naverage: the mean of each ray "
      "[dvr]");
  command
      .add_flag("--shade", base_.shade,
                "light surfaces from the camera (dvr; gradients by central differences)")
      ->group(kGroup);
  add("--terminate", "ALPHA", words_.terminate,
      "a ray stops where its opacity reaches this, from 0 to 1 [0.999]");
  add("--clip-box", "X0,Y0,Z0,X1,Y1,Z1", words_.clipBox,
      "sample only inside this box, in world units [the whole volume]");
  add("--precision", "NAME", words_.precision,
      "full: within 1e-5 of a double-precision reference; fast: within 3e-4, less\nthan half a step of a "
      "half float at 1, "
      "and quicker on integer data [full]");
}

void ViewArguments::interpret() {
  interpretView();
  interpretTransferFunction();
  interpretSampling();
}

void ViewArguments::interpretView() {
  Words& w = words_;
  if (!w.size.empty()) interpretSize(w.size, base_.width, base_.height);
  if (!w.view.empty() && !w.eye.empty())
    throw OptionError("--eye", "cannot be combined with --view; give one of the two");
  if (w.eye.empty() && !w.target.empty()) throw OptionError("--target", "needs --eye X,Y,Z as well");
  if (w.eye.empty() && !w.up.empty()) throw OptionError("--up", "needs --eye X,Y,Z as well");
  if (w.view.empty()) w.view = "iso";
  choiceOption("--view", w.view, {"x", "-x", "y", "-y", "z", "-z", "iso"});
  if (!w.eye.empty()) eye_ = vectorOption("--eye", w.eye, kPoint);
  if (!w.target.empty()) target_ = vectorOption("--target", w.target, kPoint);
  if (!w.up.empty()) up_ = vectorOption("--up", w.up, kPoint);
  if (!w.fov.empty()) fov_ = numberOption("--fov", w.fov, 1, 170, "degrees from 1 to 170");
  if (w.ortho.empty()) return;
  orthographic_ = true;
  if (!w.fov.empty())
    throw OptionError("--fov", "cannot be combined with --ortho, which has no field of view");
  if (w.ortho != "fit")
    orthoHeight_ =
        numberOption("--ortho", w.ortho, 1e-12, 1e12, "an image height above 0 in world units, or fit");
  else if (eye_)
    throw OptionError("--ortho", "fit needs --view; with --eye expected an image height in world units");
}

void ViewArguments::interpretTransferFunction() {
  const auto& names = colourMapNames();
  const std::string name = words_.transferFunction.empty() ? names.front() : words_.transferFunction;
  // What is neither a map nor a file is refused as an unknown map.
  const bool builtIn =
      std::find(names.begin(), names.end(), name) != names.end() || !std::filesystem::exists(name);
  base_.transferFunction = builtIn ? builtInTransferFunction(name) : readTransferFunction(name);
  if (words_.range.empty() || words_.range == "auto")
    stretchToData_ = builtIn || words_.range == "auto";
  else
    range_ = interpretRange(words_.range);
  if (!words_.unitDistance.empty())
    base_.unitDistance =
        numberOption("--unit-distance", words_.unitDistance, 1e-12, 1e12, "a length above 0 in world units");
}

void ViewArguments::interpretSampling() {
  const Words& w = words_;
  if (!w.precision.empty())
    base_.precision = Precision(choiceOption("--precision", w.precision, {"full", "fast"}));
  if (!w.step.empty())
    base_.step = numberOption("--step", w.step, 1.0 / 64, 64, "a number of voxels from 1/64 to 64");
  if (!w.error.empty())
    base_.error = numberOption("--error", w.error, 1e-6, 0.5, "a number from 1e-6 to 0.5");
  if (!w.filter.empty()) base_.filter = Filter(choiceOption("--filter", w.filter, {"trilinear", "nearest"}));
  if (!w.mode.empty()) base_.mode = RenderMode(choiceOption("--mode", w.mode, {"dvr", "mip", "average"}));
  if (base_.shade && base_.mode != RenderMode::dvr)
    throw OptionError("--shade", "needs --mode dvr; the other modes have no surfaces to light");
  if (!w.terminate.empty())
    base_.terminate = float(numberOption("--terminate", w.terminate, 0, 1, "an opacity from 0 to 1"));
  if (w.clipBox.empty()) return;
  const char* const kExpected = "X0,Y0,Z0,X1,Y1,Z1 in world units with X0 < X1, Y0 < Y1 and Z0 < Z1";
  const auto n = numbersOption("--clip-box", w.clipBox, 6, kExpected);
  for (size_t axis = 0; axis < 3; ++axis)
    if (!(n[axis] < n[axis + 3])) refuseValue("--clip-box", w.clipBox, kExpected);
  base_.clipBox = PointBox{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
}

Camera ViewArguments::camera(const Lattice& lattice) const {
  const PointBox bounds = lattice.worldBounds();
  const double aspect = double(base_.width) / base_.height;
  Camera camera;
  if (!eye_) {
    camera = orthographic_ ? fittedOrthographicCamera(words_.view, bounds, aspect)
                           : fittedCamera(words_.view, bounds, fov_, aspect);
  } else {
    camera.eye = *eye_;
    camera.target = target_.value_or((bounds.lo + bounds.hi) * 0.5);
    camera.up = up_.value_or(defaultUp(camera.target - camera.eye));
    camera.verticalFovDegrees = fov_;
    if (orthographic_) camera.projection = Camera::Projection::orthographic;
  }
  if (orthoHeight_) camera.imageHeight = *orthoHeight_;
  return camera;
}

RenderSettings ViewArguments::settings(const Lattice& lattice, ValueRange dataRange) const {
  RenderSettings settings = base_;
  settings.camera = camera(lattice);
  if (range_ || stretchToData_) {
    settings.range = range_ ? *range_ : widened(dataRange);
    settings.transferFunction = base_.transferFunction.stretchedTo(settings.range);
  } else {
    settings.range = widened(base_.transferFunction.domain());
  }
  settings.validate();
  return settings;
}

}  // namespace kairos
