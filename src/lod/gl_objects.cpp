#include "lod/gl_objects.h"

#include <epoxy/gl.h>

#include <vector>

#include "lod/gl_context.h"

namespace kairos {
namespace {

GlObject compile(GLenum kind, const std::string& source) {
  GlObject shader(glCreateShader(kind), [](unsigned id) { glDeleteShader(id); });
  const char* text = source.c_str();
  glShaderSource(shader.id(), 1, &text, nullptr);
  glCompileShader(shader.id());
  GLint compiled = 0;
  glGetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
  if (compiled) return shader;
  char log[2048] = "";
  glGetShaderInfoLog(shader.id(), sizeof log, nullptr, log);
  throw GlError(std::string(kind == GL_VERTEX_SHADER ? "vertex" : "fragment") +
                " shader does not compile: " + log);
}

}  // namespace

GlObject makeTexture() {
  GLuint id = 0;
  glGenTextures(1, &id);
  return {id, [](unsigned texture) { glDeleteTextures(1, &texture); }};
}

GlObject makeBuffer() {
  GLuint id = 0;
  glGenBuffers(1, &id);
  return {id, [](unsigned buffer) { glDeleteBuffers(1, &buffer); }};
}

GlObject makeVertexArray() {
  GLuint id = 0;
  glGenVertexArrays(1, &id);
  return {id, [](unsigned array) { glDeleteVertexArrays(1, &array); }};
}

GlObject makeProgram(const std::string& vertexSource, const std::string& fragmentSource) {
  const GlObject vertex = compile(GL_VERTEX_SHADER, vertexSource);
  const GlObject fragment = compile(GL_FRAGMENT_SHADER, fragmentSource);
  GlObject program(glCreateProgram(), [](unsigned id) { glDeleteProgram(id); });
  for (const GlObject* shader : {&vertex, &fragment}) glAttachShader(program.id(), shader->id());
  glLinkProgram(program.id());
  for (const GlObject* shader : {&vertex, &fragment}) glDetachShader(program.id(), shader->id());
  GLint linked = 0;
  glGetProgramiv(program.id(), GL_LINK_STATUS, &linked);
  if (linked) return program;
  char log[2048] = "";
  glGetProgramInfoLog(program.id(), sizeof log, nullptr, log);
  throw GlError(std::string("shaders do not link: ") + log);
}

void checkGl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw GlError(std::string(what) + (error == GL_OUT_OF_MEMORY
                                         ? ": not enough graphics memory"
                                         : ": OpenGL error " + std::to_string(unsigned(error))));
}

Framebuffer::Framebuffer(int width, int height) : width_(width), height_(height), texture_(makeTexture()) {
  glBindTexture(GL_TEXTURE_2D, texture_.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, width, height, 0, GL_RGBA, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  GLuint id = 0;
  glGenFramebuffers(1, &id);
  framebuffer_ = GlObject(id, [](unsigned framebuffer) { glDeleteFramebuffers(1, &framebuffer); });
  glBindFramebuffer(GL_FRAMEBUFFER, id);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.id(), 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GlError("no RGBA32F framebuffer of " + std::to_string(width) + "x" + std::to_string(height));
  checkGl("creating the framebuffer");
}

void Framebuffer::begin(float value) const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, width_, height_);
  const GLfloat colour[] = {value, value, value, value};
  glClearBufferfv(GL_COLOR, 0, colour);
}

Image Framebuffer::read() const {
  Image image(width_, height_, 4);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, image.data.data());
  checkGl("reading the image");
  return image;
}

GlObject makeTableTexture(const ClassificationTable& table) {
  GlObject texture = makeTexture();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  // The copy of the last node comes along: the node after any other can be fetched.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, table.nodeCount() + 1, 1, 0, GL_RGBA, GL_FLOAT, table.nodes());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  checkGl("uploading the transfer function");
  return texture;
}

}  // namespace kairos
