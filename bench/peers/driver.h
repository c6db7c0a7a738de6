// A scene of the peer comparison, and the protocol between compare_frames.py and a driver, C++'s side of both
// (driver.py is Python's and explains the commands).
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/error.h"
#include "core/image.h"
#include "core/transfer_function.h"
#include "io/transfer_function_file.h"

namespace kairos::bench {

/// A dense volume, voxel (i, j, k) at world (i, j, k), and how it is looked at.
struct Scene {
  std::string raw, type;  // type: u8 or f32
  Vec3i dims;
  TransferFunction transferFunction;  // opacity over one world unit
  ValueRange range;
  Camera camera;
  int width, height;
  double step;      // world units between samples
  float terminate;  // opacity at which rays end
};

/// Throws InputError when the scene, or a file it names, cannot be read.
inline Scene readScene(const std::string& path) try {
  std::ifstream file(path);
  if (!file) throw InputError(path, "cannot be opened");
  const nlohmann::json json = nlohmann::json::parse(file);
  const std::string folder = path.substr(0, path.find_last_of('/') + 1);
  const auto vector = [](const nlohmann::json& v) { return Vec3d{v.at(0), v.at(1), v.at(2)}; };
  const nlohmann::json &dims = json.at("dims"), &range = json.at("value_range"), &camera = json.at("camera");
  return {.raw = folder + json.at("raw").get<std::string>(),
          .type = json.at("type"),
          .dims = {dims.at(0), dims.at(1), dims.at(2)},
          .transferFunction = readTransferFunction(folder + json.at("transfer").get<std::string>()),
          .range = {range.at(0), range.at(1)},
          .camera = {.eye = vector(camera.at("eye")),
                     .target = vector(camera.at("target")),
                     .up = vector(camera.at("up")),
                     .verticalFovDegrees = camera.at("fov")},
          .width = json.at("size").at(0),
          .height = json.at("size").at(1),
          .step = json.at("step"),
          .terminate = json.at("terminate")};
} catch (const nlohmann::json::exception& e) {
  throw InputError(path, e.what());
}

/// The scene's voxels, x fastest. Throws InputError when the file is too short.
template <class T>
std::vector<T> readVoxels(const Scene& scene) {
  std::vector<T> values(size_t(scene.dims.x) * size_t(scene.dims.y) * size_t(scene.dims.z));
  std::ifstream file(scene.raw, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(values.data()), std::streamsize(values.size() * sizeof(T))))
    throw InputError(scene.raw, "cannot be read, or is shorter than its dimensions say");
  return values;
}

/// Raw float32, as the protocol wants images.
inline void writeRaw(const std::string& path, const std::vector<float>& rgba) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(rgba.data()), std::streamsize(rgba.size() * sizeof(float)));
  if (!file.flush()) throw OutputError(path, "cannot be written");
}

/// Describes itself and answers commands until the input ends. `frame` renders; `image` is what it rendered,
/// premultiplied RGBA, top row first.
inline void serve(const nlohmann::json& description, const std::function<void()>& frame,
                  const std::function<std::vector<float>()>& image) {
  std::cout << description.dump() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "frame") {
      const auto begin = std::chrono::steady_clock::now();
      frame();
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
      std::cout << took.count() << std::endl;
    } else if (line.starts_with("image ")) {
      writeRaw(line.substr(6), image());
      std::cout << "done" << std::endl;
    } else {
      throw OptionError("standard input", "found \"" + line + "\", expected frame or image FILE");
    }
  }
}

}  // namespace kairos::bench
