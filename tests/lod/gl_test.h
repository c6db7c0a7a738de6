// Tests that need OpenGL: one context for the whole program; skipped with the reason where there is none,
// which REQUIRE_GL=1 in the environment turns into a failure.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "lod/gl_context.h"

namespace kairos::test {

class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    if (context()) return context()->makeCurrent();
    const char* required = std::getenv("REQUIRE_GL");
    if (required && std::string(required) == "1") FAIL() << reason();
    GTEST_SKIP() << reason();
  }

  static const GlContext* context() { return shared().context.get(); }
  static const std::string& reason() { return shared().reason; }

 private:
  struct Shared {
    std::unique_ptr<GlContext> context;
    std::string reason;
  };
  static const Shared& shared() {
    // Never destroyed: drivers may be unloaded before static destructors run.
    static const Shared& instance = *new Shared(open());
    return instance;
  }
  static Shared open() {
    try {
      return {std::make_unique<GlContext>(), {}};
    } catch (const GlError& error) {
      return {nullptr, error.what()};
    }
  }
};

}  // namespace kairos::test
