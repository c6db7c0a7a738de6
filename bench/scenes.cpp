#include "scenes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

namespace kairos::bench {
namespace {

constexpr size_t kVoxels = size_t(kEdge) * kEdge * kEdge;

// A lattice of random numbers, smoothly interpolated.
class Octave {
 public:
  Octave(int cells, uint32_t seed)
      : cells_(cells), values_(size_t(cells + 1) * size_t(cells + 1) * size_t(cells + 1)) {
    uint32_t state = seed;
    for (float& v : values_) {
      state = state * 1664525u + 1013904223u;
      v = float(state >> 8) * (1.0f / 16777216.0f);
    }
  }
  float operator()(int x, int y, int z) const {
    const auto place = [&](int voxel, int& cell) {
      const float at = float(voxel) * float(cells_) / kEdge;
      cell = int(at);
      const float t = at - float(cell);
      return t * t * (3 - 2 * t);
    };
    int i, j, k;
    const float fx = place(x, i), fy = place(y, j), fz = place(z, k);
    const auto lerp = [](float a, float b, float f) { return a + f * (b - a); };
    const auto row = [&](int jj, int kk) { return lerp(at(i, jj, kk), at(i + 1, jj, kk), fx); };
    return lerp(lerp(row(j, k), row(j + 1, k), fy), lerp(row(j, k + 1), row(j + 1, k + 1), fy), fz);
  }

 private:
  float at(int i, int j, int k) const {
    return values_[(size_t(k) * size_t(cells_ + 1) + size_t(j)) * size_t(cells_ + 1) + size_t(i)];
  }
  int cells_;
  std::vector<float> values_;
};

std::vector<float> noiseValues() {
  const Octave octaves[] = {{6, 7}, {12, 8}, {24, 9}, {48, 10}};
  std::vector<float> values(kVoxels);
  size_t n = 0;
  for (int z = 0; z < kEdge; ++z)
    for (int y = 0; y < kEdge; ++y)
      for (int x = 0; x < kEdge; ++x) {
        float sum = 0, weight = 1;
        for (const Octave& octave : octaves) {
          sum += weight * octave(x, y, z);
          weight *= 0.5f;
        }
        values[n++] = sum / 1.875f;
      }
  return values;
}

std::vector<uint8_t> quantised(const std::function<float(size_t, int, int, int)>& value) {
  std::vector<uint8_t> out(kVoxels);
  size_t n = 0;
  for (int z = 0; z < kEdge; ++z)
    for (int y = 0; y < kEdge; ++y)
      for (int x = 0; x < kEdge; ++x, ++n) out[n] = uint8_t(255 * std::clamp(value(n, x, y, z), 0.0f, 1.0f));
  return out;
}

const std::vector<float>& sharedNoise() {
  static const std::vector<float> values = noiseValues();
  return values;
}

// Collects changed voxels leaf by leaf; `changed(v)` says which, `amount` by how much (up or down, staying in
// range).
ChangedVoxels collect(const Field& field, int amount, const std::function<bool(const Vec3i&)>& changed) {
  ChangedVoxels changes;
  changes.values = makeVoxelArray(field.type());
  std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        auto& out = valuesAs<T>(changes.values);
        const T step = T(std::is_same_v<T, uint16_t> ? amount * 257 : amount);
        for (size_t l = 0; l < field.leafCount(); ++l) {
          ChangedLeaf leaf{field.leafOrigins[l], {}, out.size()};
          for (int i = 0; i < kLeafVoxels; ++i) {
            if (!changed(leaf.origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6})) continue;
            const T value = values[l * kLeafVoxels + size_t(i)];
            leaf.mask[size_t(i >> 6)] |= uint64_t(1) << (i & 63);
            out.push_back(value >= step ? T(value - step) : T(value + step));
          }
          if (leaf.count() > 0) changes.leaves.push_back(leaf);
        }
      },
      field.values);
  return changes;
}

TransferFunction transferFunction(ElementType type, double opacityScale) {
  const double full = type == ElementType::u16 ? 65535 : 255;
  std::vector<TransferFunction::ColourPoint> colours;
  std::vector<TransferFunction::OpacityPoint> opacities;
  for (int i = 0; i < 256; ++i) {
    const double t = i / 255.0, value = t * full;
    colours.push_back(
        {value, {std::min(1.5 * t, 1.0), std::clamp(1.6 * t - 0.3, 0.0, 1.0), 0.4 + 0.4 * std::sin(6 * t)}});
    opacities.push_back(
        {value, std::min(1.0, opacityScale * 0.25 * std::pow(std::max(0.0, (t - 0.12) / 0.88), 1.5))});
  }
  return {colours, opacities};
}

RenderSettings settingsWith(ElementType type, double opacityScale) {
  RenderSettings s;
  s.camera = {{128, -500, 300}, {128, 128, 128}, {0, 0, 1}, Camera::Projection::perspective, 28, 1};
  s.transferFunction = transferFunction(type, opacityScale);
  s.range = {0, type == ElementType::u16 ? 65535.0f : 255.0f};
  return s;
}

}  // namespace

Lattice lattice(ElementType type) {
  Lattice l;
  l.type = type;
  l.domain = {{0, 0, 0}, {kEdge, kEdge, kEdge}};
  l.dense = true;
  return l;
}

const std::vector<uint8_t>& noise() {
  static const std::vector<uint8_t> values =
      quantised([](size_t n, int, int, int) { return sharedNoise()[n]; });
  return values;
}

std::vector<uint8_t> plumeAt(float sway) {
  return quantised([sway](size_t n, int i, int j, int k) {
    const float x = float(i) / kEdge, y = float(j) / kEdge, z = float(k) / kEdge;
    if (z >= 0.92f) return 0.0f;
    const float r =
        std::hypot(x - 0.5f - 0.06f * std::sin(6 * z + sway), y - 0.5f - 0.06f * std::cos(5 * z + sway));
    return 1.4f * (1 - r / (0.07f + 0.16f * z)) * (0.35f + sharedNoise()[n]) - 0.15f;
  });
}

const std::vector<uint8_t>& plume() {
  static const std::vector<uint8_t> values = plumeAt(0);
  return values;
}

const std::vector<uint8_t>& fog() {
  static const std::vector<uint8_t> values =
      quantised([](size_t n, int, int, int) { return 0.3f + 0.4f * sharedNoise()[n]; });
  return values;
}

Field fieldOf(const std::vector<uint8_t>& values, ElementType type) {
  const Vec3i dims{kEdge, kEdge, kEdge};
  if (type == ElementType::u8) return fieldFromDense(values.data(), dims);
  if (type == ElementType::f32)
    return fieldFromDense(std::vector<float>(values.begin(), values.end()).data(), dims);
  std::vector<uint16_t> wide(values.size());
  std::transform(values.begin(), values.end(), wide.begin(), [](uint8_t v) { return uint16_t(v * 257); });
  return fieldFromDense(wide.data(), dims);
}

ChangedVoxels ballOfChange(const Field& field, const Vec3d& centre, double fraction, int amount) {
  const double radius = kEdge * std::cbrt(fraction * 3 / (4 * 3.14159265358979));
  return collect(field, amount, [&](const Vec3i& v) { return length(Vec3d(v) - centre) < radius; });
}

ChangedVoxels scatteredChange(const Field& field, int amount) {
  return collect(field, amount,
                 [](const Vec3i& v) { return (v.x & 3) == 0 && (v.y & 3) == 0 && (v.z & 3) == 0; });
}

RenderSettings settings(ElementType type) {
  return settingsWith(type, 1);
}
RenderSettings fogSettings(ElementType type) {
  return settingsWith(type, 0.05);
}
RenderSettings opaqueSettings(ElementType type) {
  return settingsWith(type, 12);
}

RendererOptions rendererOptions(Method method, int threads) {
  RendererOptions options;
  options.method = method;
  options.threads = threads;
  return options;
}

}  // namespace kairos::bench
