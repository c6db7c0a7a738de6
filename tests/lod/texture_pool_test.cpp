#include "lod/texture_pool.h"

#include <vector>

#include "lod/gl_test.h"

namespace kairos {
namespace {

class TexturePoolTest : public test::GlTest {
 protected:
  static constexpr uint64_t kCube = 8 * 8 * 8 * 4;
  static inline const Vec3i kSize{8, 8, 8};
};

TEST_F(TexturePoolTest, NeverExceedsItsBudgetAndEvictsTheLeastRecentlyUsed_L5) {
  TexturePool pool(TexelFormat::r32f, 3 * kCube);
  for (uint64_t key = 0; key < 3; ++key) pool.acquire(key, kSize);
  EXPECT_EQ(pool.bytes(), 3 * kCube);
  pool.acquire(0, kSize);  // 1 is now the oldest
  pool.acquire(3, kSize);
  EXPECT_TRUE(pool.resident(0) && pool.resident(2) && pool.resident(3));
  EXPECT_FALSE(pool.resident(1));
  EXPECT_EQ(pool.bytes(), 3 * kCube);
  EXPECT_EQ(pool.counters().evicted, 1u);
}

TEST_F(TexturePoolTest, ReusesAnObjectOfEqualSize_L5) {
  TexturePool pool(TexelFormat::r32f, 2 * kCube);
  const unsigned first = pool.acquire(0, kSize);
  pool.acquire(1, kSize);
  EXPECT_EQ(pool.acquire(2, kSize), first);
  EXPECT_EQ(pool.counters().created, 2u);
  EXPECT_EQ(pool.counters().reused, 1u);
  pool.acquire(3, {8, 8, 16});  // as large as both others: nothing fits, nothing has its size
  EXPECT_EQ(pool.counters().created, 3u);
  EXPECT_EQ(pool.counters().evicted, 3u);
  EXPECT_EQ(pool.bytes(), 2 * kCube);
}

TEST_F(TexturePoolTest, AResidentTextureIsFoundAgainWithoutAnUpload_L5) {
  TexturePool pool(TexelFormat::r32f, 2 * kCube);
  const std::vector<float> texels(512, 0.5f);
  const unsigned texture = pool.acquire(7, kSize);
  pool.upload(7, {{0, 0, 0}, kSize}, texels.data());
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_TRUE(pool.resident(7));
    EXPECT_EQ(pool.acquire(7, kSize), texture);
  }
  EXPECT_EQ(pool.counters().uploads, 1u);
  EXPECT_EQ(pool.counters().bytesUploaded, kCube);
  EXPECT_EQ(pool.counters().created, 1u);
}

TEST_F(TexturePoolTest, CountsPartialUploadsByTheirOwnSize) {
  TexturePool pool(TexelFormat::r16, kCube);
  const std::vector<uint16_t> texels(512, 77);
  pool.acquire(1, kSize);
  EXPECT_EQ(pool.bytes(), kCube / 2);
  pool.upload(1, {{2, 2, 2}, {5, 4, 3}}, texels.data());
  EXPECT_EQ(pool.counters().bytesUploaded, 3u * 2 * 1 * 2);
}

TEST_F(TexturePoolTest, ATextureLargerThanTheBudgetIsRefused) {
  TexturePool pool(TexelFormat::r32f, kCube - 1);
  EXPECT_THROW(pool.acquire(0, kSize), GlError);
  EXPECT_EQ(pool.bytes(), 0u);
}

TEST_F(TexturePoolTest, ClearingEmptiesIt) {
  TexturePool pool(TexelFormat::r32f, 4 * kCube);
  for (uint64_t key = 0; key < 4; ++key) pool.acquire(key, kSize);
  pool.clear();
  EXPECT_EQ(pool.bytes(), 0u);
  EXPECT_FALSE(pool.resident(2));
}

}  // namespace
}  // namespace kairos
