#include "core/progress.h"

#include <gtest/gtest.h>

#include <thread>

namespace kairos {
namespace {

TEST(StopFlag, ThrowsOnlyAfterARequest) {
  StopFlag stop;
  EXPECT_FALSE(stop.requested());
  EXPECT_NO_THROW(stop.check());
  std::thread([&] { stop.request(); }).join();
  EXPECT_TRUE(stop.requested());
  EXPECT_THROW(stop.check(), Interrupted);
}

}  // namespace
}  // namespace kairos
