// Open VKL 2.0 as a driver of the peer comparison (see driver.h), one thread: packets of 4x4 rays, interval
// iterators that skip what the transfer function does not show, 16-wide sampling. Rays, sample positions and
// classification are Kairos's own, so that only the volume and its traversal differ.
//
//     openvkl_driver SCENE.json [--threads 1] [--resolution H]
//
// H is Open VKL's intervalResolutionHint, 0 (large intervals) to 1.
#include <openvkl/openvkl.h>
// The device's header builds on the host's.
#include <openvkl/device/openvkl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "driver.h"

using namespace kairos;

namespace {

constexpr int kEdge = 4, kLanes = kEdge * kEdge;

/// The committed volume and what samples and skips in it.
class VklVolume {
 public:
  VklVolume(const bench::Scene& scene, const ClassificationTable& table, float resolution) {
    vklInit();
    device_ = vklNewDevice("cpu");
    vklDeviceSetInt(device_, "numThreads", 1);
    vklCommitDevice(device_);
    if (scene.type == "u8")
      commitVolume(bench::readVoxels<uint8_t>(scene), VKL_UCHAR, scene.dims);
    else
      commitVolume(bench::readVoxels<float>(scene), VKL_FLOAT, scene.dims);
    sampler_ = vklNewSampler(volume_);
    vklCommit(sampler_);
    commitContext({table.firstVisible(), table.lastVisible()}, resolution);
  }
  ~VklVolume() {
    vklRelease(context_);
    vklRelease(sampler_);
    vklRelease(volume_);
    vklReleaseDevice(device_);
  }
  VklVolume(const VklVolume&) = delete;
  VklVolume& operator=(const VklVolume&) = delete;

  const VKLSampler* sampler() const { return &sampler_; }
  const VKLIntervalIteratorContext* context() const { return &context_; }

 private:
  template <class T>
  void commitVolume(const std::vector<T>& values, VKLDataType type, const Vec3i& dims) {
    volume_ = vklNewVolume(device_, "structuredRegular");
    vklSetVec3i(volume_, "dimensions", dims.x, dims.y, dims.z);
    vklSetVec3f(volume_, "gridOrigin", 0, 0, 0);
    vklSetVec3f(volume_, "gridSpacing", 1, 1, 1);
    const VKLData data = vklNewData(device_, values.size(), type, values.data(), VKL_DATA_DEFAULT, 0);
    vklSetData(volume_, "data", data);
    vklRelease(data);
    vklCommit(volume_);
  }

  void commitContext(vkl_range1f visible, float resolution) {
    context_ = vklNewIntervalIteratorContext(sampler_);
    const VKLData ranges = vklNewData(device_, 1, VKL_BOX1F, &visible, VKL_DATA_DEFAULT, 0);
    vklSetData(context_, "valueRanges", ranges);
    vklRelease(ranges);
    vklSetFloat(context_, "intervalResolutionHint", resolution);
    vklCommit(context_);
  }

  VKLDevice device_;
  VKLVolume volume_;
  VKLSampler sampler_;
  VKLIntervalIteratorContext context_;
};

/// 4x4 rays and what they have gathered so far.
struct alignas(64) Packet {
  vkl_vvec3f16 origin, direction;
  std::array<int, kLanes> valid;
  std::array<std::array<float, kLanes>, 4> rgba{};
};

class Renderer {
 public:
  Renderer(const bench::Scene& scene, float resolution)
      : scene_(scene),
        table_(scene.transferFunction, scene.range, scene.step),
        rays_(scene.camera, scene.width, scene.height),
        volume_(scene, table_, resolution),
        iteratorBuffer_(vklGetIntervalIteratorSize16(volume_.context())),
        image_(scene.width, scene.height, 4) {}

  void render() {
    for (int y = 0; y < scene_.height; y += kEdge)
      for (int x = 0; x < scene_.width; x += kEdge) {
        Packet packet = packetAt(x, y);
        integrate(packet);
        store(packet, x, y);
      }
  }
  const Image& image() const { return image_; }

 private:
  Packet packetAt(int x, int y) const {
    Packet p;
    for (int lane = 0; lane < kLanes; ++lane) {
      const int px = x + lane % kEdge, py = y + lane / kEdge;
      const Ray ray = rays_.ray(px + 0.5, py + 0.5);
      p.valid[size_t(lane)] = px < scene_.width && py < scene_.height ? -1 : 0;
      p.origin.x[lane] = float(ray.origin.x);
      p.origin.y[lane] = float(ray.origin.y);
      p.origin.z[lane] = float(ray.origin.z);
      p.direction.x[lane] = float(ray.direction.x);
      p.direction.y[lane] = float(ray.direction.y);
      p.direction.z[lane] = float(ray.direction.z);
    }
    return p;
  }

  void integrate(Packet& p) {
    alignas(64) vkl_vrange1f16 whole;
    std::fill_n(whole.lower, kLanes, 0.0f);
    std::fill_n(whole.upper, kLanes, std::numeric_limits<float>::infinity());
    const VKLIntervalIterator16 iterator = vklInitIntervalIterator16(
        p.valid.data(), volume_.context(), &p.origin, &p.direction, &whole, nullptr, iteratorBuffer_.data());
    const auto alive = [](int lane) { return lane != 0; };
    while (std::any_of(p.valid.begin(), p.valid.end(), alive)) {
      VKLInterval16 interval;
      alignas(64) std::array<int, kLanes> found{};
      vklIterateInterval16(p.valid.data(), iterator, &interval, found.data());
      for (size_t i = 0; i < kLanes; ++i) p.valid[i] = p.valid[i] && found[i] ? -1 : 0;
      integrate(p, interval);
    }
  }

  // The lattice samples t = (k + 0.5) step of every ray in its interval [lower, upper).
  void integrate(Packet& p, const VKLInterval16& interval) {
    const float step = float(scene_.step);
    alignas(64) std::array<float, kLanes> k;
    for (size_t i = 0; i < kLanes; ++i) k[i] = std::ceil(interval.tRange.lower[i] / step - 0.5f);
    for (;;) {
      alignas(64) std::array<int, kLanes> active;
      alignas(64) vkl_vvec3f16 position;
      int any = 0;
      for (size_t i = 0; i < kLanes; ++i) {
        const float t = (k[i] + 0.5f) * step;
        active[i] = p.valid[i] && t < interval.tRange.upper[i] ? -1 : 0;
        any |= active[i];
        position.x[i] = p.origin.x[i] + t * p.direction.x[i];
        position.y[i] = p.origin.y[i] + t * p.direction.y[i];
        position.z[i] = p.origin.z[i] + t * p.direction.z[i];
        k[i] += 1;
      }
      if (!any) return;
      alignas(64) std::array<float, kLanes> samples{};
      vklComputeSample16(active.data(), volume_.sampler(), &position, samples.data(), 0, nullptr);
      composite(p, active, samples);
    }
  }

  void composite(Packet& p, const std::array<int, kLanes>& active,
                 const std::array<float, kLanes>& samples) const {
    for (size_t i = 0; i < kLanes; ++i) {
      if (!active[i]) continue;
      const std::array<float, 4> c = table_.classify(samples[i]);  // also outside the volume, where it is NaN
      const float transparency = 1 - p.rgba[3][i];
      for (size_t channel = 0; channel < 4; ++channel) p.rgba[channel][i] += transparency * c[channel];
      if (p.rgba[3][i] >= scene_.terminate) p.valid[i] = 0;
    }
  }

  void store(const Packet& p, int x, int y) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const int px = x + lane % kEdge, py = y + lane / kEdge;
      if (px >= scene_.width || py >= scene_.height) continue;
      for (size_t c = 0; c < 4; ++c) image_.pixel(px, py)[c] = p.rgba[c][size_t(lane)];
    }
  }

  bench::Scene scene_;
  ClassificationTable table_;
  RayGenerator rays_;
  VklVolume volume_;
  std::vector<char> iteratorBuffer_;
  Image image_;
};

}  // namespace

int main(int argc, char** argv) try {
  std::string path;
  int threads = 1;
  float resolution = 0.5f;
  CLI::App app("Open VKL as a driver of the peer comparison");
  app.add_option("scene", path)->required();
  app.add_option("--threads", threads)->check(CLI::Range(1, 1));
  app.add_option("--resolution", resolution)->check(CLI::Range(0.0, 1.0));
  CLI11_PARSE(app, argc, argv);
  Renderer renderer(bench::readScene(path), resolution);
  renderer.render();
  bench::serve(
      {{"name", "Open VKL"}, {"version", OPENVKL_DRIVER_VERSION}}, [&] { renderer.render(); },
      [&] { return renderer.image().data; });
  return 0;
} catch (const std::exception& e) {
  std::cerr << "openvkl_driver: " << e.what() << '\n';
  return 1;
}
