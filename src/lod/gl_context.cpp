#include "lod/gl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <span>

namespace kairos {
namespace {

bool lists(const char* extensions, const char* name) {
  return extensions && std::strstr(extensions, name);
}

std::string eglProblem(const char* call) {
  char code[16];
  std::snprintf(code, sizeof code, "0x%04x", unsigned(eglGetError()));
  return std::string(call) + " failed with " + code;
}

// Empty when the context came to be; otherwise why not.
std::string createContext(EGLDisplay display, EGLContext& context) {
  if (!eglInitialize(display, nullptr, nullptr)) return eglProblem("eglInitialize");
  if (!eglBindAPI(EGL_OPENGL_API)) return eglProblem("eglBindAPI(EGL_OPENGL_API)");
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  for (const char* needed : {"EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"})
    if (!lists(extensions, needed)) return std::string(needed) + " is missing";
  constexpr EGLint kAttributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                    3,
                                    EGL_CONTEXT_MINOR_VERSION,
                                    3,
                                    EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                    EGL_NONE};
  context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes);
  if (context == EGL_NO_CONTEXT) return eglProblem("eglCreateContext (OpenGL 3.3 core)");
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return {};
  const std::string problem = eglProblem("eglMakeCurrent");
  eglDestroyContext(display, context);
  return problem;
}

struct Device {
  EGLDeviceEXT handle;
  bool software;
};

std::span<const Device> listDevices(std::array<Device, 16>& devices) {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!lists(client, "EGL_EXT_platform_device") ||
      !(lists(client, "EGL_EXT_device_enumeration") || lists(client, "EGL_EXT_device_base")))
    return {};
  EGLDeviceEXT handles[16];
  EGLint count = 0;
  if (!eglQueryDevicesEXT(16, handles, &count)) return {};
  for (EGLint i = 0; i < count; ++i)
    devices[size_t(i)] = {
        handles[i], lists(eglQueryDeviceStringEXT(handles[i], EGL_EXTENSIONS), "EGL_MESA_device_software")};
  return {devices.data(), size_t(count)};
}

std::string glText(GLenum name) {
  const auto* text = reinterpret_cast<const char*>(glGetString(name));
  return text ? text : "unknown";
}

}  // namespace

GlContext::GlContext(GlPlatform platform) {
  // Without this question epoxy would end the program where libEGL is missing.
  if (!epoxy_has_egl()) throw GlError("no OpenGL context: libEGL is not installed");
  std::string failures;
  std::array<Device, 16> storage;
  const auto devices = listDevices(storage);
  const auto tryDevices = [&](bool software) {
    for (size_t i = 0; i < devices.size(); ++i)
      if (devices[i].software == software &&
          tryDisplay(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i].handle, nullptr),
                     "device " + std::to_string(i) + (software ? " (software)" : ""), !software, failures))
        return true;
    return false;
  };
  const auto wanted = [&](GlPlatform p) { return platform == GlPlatform::automatic || platform == p; };
  if (wanted(GlPlatform::hardware) && tryDevices(false)) return;
  if (wanted(GlPlatform::surfaceless)) {
    if (!lists(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless"))
      failures += "; surfaceless: EGL_MESA_platform_surfaceless is missing";
    else if (tryDisplay(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr),
                        "surfaceless", false, failures))
      return;
  }
  if (wanted(GlPlatform::software) && tryDevices(true)) return;
  throw GlError("no OpenGL 3.3 context: " +
                (failures.empty() ? std::string("EGL has no such device") : failures.substr(2)));
}

bool GlContext::tryDisplay(void* display, const std::string& name, bool refuseSoftware,
                           std::string& failures) {
  if (display == EGL_NO_DISPLAY) {
    failures += "; " + name + ": " + eglProblem("eglGetPlatformDisplay");
    return false;
  }
  EGLContext context = EGL_NO_CONTEXT;
  const std::string problem = createContext(display, context);
  if (!problem.empty()) {
    failures += "; " + name + ": " + problem;
    return false;
  }
  display_ = display;
  context_ = context;
  describe();
  if (!refuseSoftware || !software()) return true;
  failures += "; " + name + ": turned out to be " + renderer_;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  return false;
}

void GlContext::describe() {
  vendor_ = glText(GL_VENDOR);
  renderer_ = glText(GL_RENDERER);
  version_ = glText(GL_VERSION);
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &maxTextureEdge_);
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &maxImageEdge_);
}

// The display stays initialised: EGL shares it between all contexts of the process.
GlContext::~GlContext() {
  if (eglGetCurrentContext() == context_)
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

void GlContext::makeCurrent() const {
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
    throw GlError(eglProblem("eglMakeCurrent"));
}

bool GlContext::software() const {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"})
    if (renderer_.find(name) != std::string::npos) return true;
  return false;
}

}  // namespace kairos
