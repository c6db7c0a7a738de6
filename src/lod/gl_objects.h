// GL objects that delete themselves, and the few ways in which this renderer makes them.
#pragma once

#include <string>
#include <utility>

#include "core/image.h"
#include "core/transfer_function.h"

namespace kairos {

/// Owns one GL object of any kind. The context it was made in must be current when it is destroyed.
class GlObject {
 public:
  using Deleter = void (*)(unsigned id);

  GlObject() = default;
  GlObject(unsigned id, Deleter deleter) : id_(id), deleter_(deleter) {}
  GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)), deleter_(other.deleter_) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(deleter_, other.deleter_);
    return *this;
  }
  ~GlObject() {
    if (id_) deleter_(id_);
  }

  unsigned id() const { return id_; }

 private:
  unsigned id_ = 0;
  Deleter deleter_ = nullptr;
};

GlObject makeTexture();
GlObject makeBuffer();
GlObject makeVertexArray();

/// Compiles and links. Throws GlError with the driver's message.
GlObject makeProgram(const std::string& vertexSource, const std::string& fragmentSource);

/// Throws GlError naming `what` when GL has recorded an error.
void checkGl(const char* what);

/// A framebuffer of width x height RGBA32F pixels. Anything less would cost 1e-2 of accuracy where hundreds
/// of slices are blended.
class Framebuffer {
 public:
  Framebuffer(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Makes it the target of drawing, viewport included, all pixels set to `value`.
  void begin(float value) const;
  /// Four channels; window row 0 becomes the image's row 0.
  Image read() const;

 private:
  int width_, height_;
  GlObject texture_, framebuffer_;
};

/// Uploads a classification table's nodes as an RGBA32F texture one texel high, read with texelFetch.
GlObject makeTableTexture(const ClassificationTable& table);

}  // namespace kairos
