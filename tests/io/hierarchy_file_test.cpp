#include "io/hierarchy_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

class HierarchyFile : public testing::Test {
 protected:
  test::TemporaryDirectory dir;
  const std::string path = dir.path() + "/levels";
  const StoredHierarchy hierarchy{{1.5f, -2, 3}, {0.25, 1e300}};

  std::string bytes() const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void overwrite(const std::string& bytes) const { std::ofstream(path, std::ios::binary) << bytes; }
};

TEST_F(HierarchyFile, ReadsWhatWasWritten) {
  writeHierarchy(path, 77, hierarchy);
  EXPECT_EQ(readHierarchy(path, 77), hierarchy);
  writeHierarchy(path, 78, {});
  EXPECT_EQ(readHierarchy(path, 78), StoredHierarchy{});
}

TEST_F(HierarchyFile, BelongsToOneIdentity) {
  writeHierarchy(path, 77, hierarchy);
  EXPECT_FALSE(readHierarchy(path, 78));
  EXPECT_FALSE(readHierarchy(path + "s", 77)) << "a missing file";
}

TEST_F(HierarchyFile, AnyDamageMakesItAbsent) {
  writeHierarchy(path, 77, hierarchy);
  const std::string whole = bytes();
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = char(damaged[i] ^ 0x40);
    overwrite(damaged);
    EXPECT_FALSE(readHierarchy(path, 77)) << "byte " << i;
    overwrite(whole.substr(0, i));
    EXPECT_FALSE(readHierarchy(path, 77)) << "cut at " << i;
  }
  overwrite(whole + "x");
  EXPECT_FALSE(readHierarchy(path, 77));
}

TEST_F(HierarchyFile, CannotBeWrittenWhereThereIsNoDirectory) {
  EXPECT_THROW(writeHierarchy(dir.path() + "/none/levels", 1, hierarchy), OutputError);
}

}  // namespace
}  // namespace kairos
