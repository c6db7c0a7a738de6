// A headless OpenGL context through EGL: no window system, no display.
#pragma once

#include <string>

#include "core/error.h"

namespace kairos {

/// OpenGL or EGL is missing, or refused something.
class GlError : public Error {
 public:
  using Error::Error;
};

/// Where a context comes from. hardware: a GPU among EGL's devices. surfaceless: Mesa's platform without a
/// window system. software: EGL's software device (llvmpipe). automatic: the first of these that works.
enum class GlPlatform { automatic, hardware, surfaceless, software };

/// An OpenGL 3.3 core context, current in the thread that created it until it is destroyed. GL objects must
/// be destroyed before it. One thread uses it; several contexts in one thread take turns by `makeCurrent`.
class GlContext {
 public:
  /// Every device and platform of the kind asked for is tried, since any may be listed and yet fail. Throws
  /// GlError, saying what was tried and what each attempt met.
  explicit GlContext(GlPlatform platform = GlPlatform::automatic);
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  void makeCurrent() const;

  /// What GL says of itself.
  const std::string& vendor() const { return vendor_; }
  const std::string& renderer() const { return renderer_; }
  const std::string& version() const { return version_; }
  /// Is it a rasteriser on the CPU?
  bool software() const;
  /// Longest edge of a 3D texture in texels.
  int maxTextureEdge() const { return maxTextureEdge_; }
  /// Largest edge of a framebuffer in pixels.
  int maxImageEdge() const { return maxImageEdge_; }

 private:
  bool tryDisplay(void* display, const std::string& name, bool refuseSoftware, std::string& failures);
  void describe();

  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string vendor_, renderer_, version_;
  int maxTextureEdge_ = 0, maxImageEdge_ = 0;
};

}  // namespace kairos
