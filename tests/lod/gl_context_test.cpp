#include "lod/gl_context.h"

#include <gmock/gmock.h>

#include "lod/gl_objects.h"
#include "lod/gl_test.h"

namespace kairos {
namespace {

using GlContextTest = test::GlTest;

TEST_F(GlContextTest, SaysWhichDriverItFound) {
  EXPECT_FALSE(context()->vendor().empty());
  EXPECT_FALSE(context()->renderer().empty());
  EXPECT_GE(context()->maxTextureEdge(), 256);
  EXPECT_GE(context()->maxImageEdge(), 1024);
}

TEST_F(GlContextTest, EveryPlatformWorksOrSaysWhatWasTried) {
  int usable = 0;
  for (const GlPlatform platform : {GlPlatform::hardware, GlPlatform::surfaceless, GlPlatform::software}) {
    try {
      const GlContext other(platform);
      ++usable;
      if (platform == GlPlatform::hardware) {
        EXPECT_FALSE(other.software()) << other.renderer();
      }
      if (platform == GlPlatform::software) {
        EXPECT_TRUE(other.software()) << other.renderer();
      }
    } catch (const GlError& error) {
      EXPECT_THAT(error.what(), testing::StartsWith("no OpenGL 3.3 context: "));
    }
  }
  context()->makeCurrent();
  EXPECT_GT(usable, 0);
}

TEST_F(GlContextTest, AFramebufferKeepsFullFloats) {
  const Framebuffer framebuffer(5, 3);
  framebuffer.begin(1.0f / 3);
  const Image image = framebuffer.read();
  ASSERT_EQ(image.data.size(), 60u);
  for (float v : image.data) EXPECT_EQ(v, 1.0f / 3);
}

TEST_F(GlContextTest, AShaderThatDoesNotCompileThrowsTheDriversMessage) {
  const std::string vertex = "#version 330 core\nvoid main() { gl_Position = vec4(0); }";
  EXPECT_NO_THROW(
      makeProgram(vertex, "#version 330 core\nout vec4 colour; void main() { colour = vec4(1); }"));
  try {
    makeProgram(vertex, "#version 330 core\nvoid main() { colour = vec4(1); }");
    FAIL() << "no error was thrown";
  } catch (const GlError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("colour"));
  }
}

}  // namespace
}  // namespace kairos
