// Readers survive damage: every truncation point of a small file and random byte flips give an InputError
// (or, where the flip hits a plain value of a format without checksums, another value), never a crash, a hang
// or another error.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "core/error.h"
#include "io/file_bytes.h"
#include "io/input_series.h"
#include "io/manifest.h"
#include "io/sequence.h"
#include "io/series.h"
#include "io/temporary_directory.h"
#include "io/transfer_function_file.h"
#include "io/vdb_files.h"

namespace kairos {
namespace {

constexpr int kFlips = 10000;

struct Outcome {
  int refused = 0, accepted = 0;
};

// A file, the way to read it, and what happens when it is damaged.
class Victim {
 public:
  Victim(std::string path, std::function<void()> read)
      : path_(std::move(path)), bytes_(test::readBytes(path_)), read_(std::move(read)) {
    read_();  // intact, it is read
  }
  ~Victim() { write(bytes_); }

  Outcome truncateEverywhere() {
    Outcome outcome;
    for (size_t length = bytes_.size(); length-- > 0;) {
      std::filesystem::resize_file(path_, length);
      attempt(outcome);
    }
    write(bytes_);
    return outcome;
  }

  // Changes one to four bytes; a quarter of them in the first 2000, where headers stand.
  Outcome flip(int times, uint32_t seed) {
    std::mt19937 random(seed);
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&](size_t at, char byte) { file.seekp(std::streamoff(at)).put(byte); };
    Outcome outcome;
    for (int i = 0; i < times; ++i) {
      std::vector<size_t> places(1 + random() % 4);
      for (size_t& place : places) {
        place = random() % (random() % 4 == 0 ? std::min<size_t>(2000, bytes_.size()) : bytes_.size());
        put(place, char(bytes_[place] ^ char(1 + random() % 255)));
      }
      file.flush();
      attempt(outcome);
      for (size_t place : places) put(place, bytes_[place]);
    }
    return outcome;
  }

  size_t size() const { return bytes_.size(); }

 private:
  void attempt(Outcome& outcome) {
    try {
      read_();
      ++outcome.accepted;
    } catch (const InputError&) {
      ++outcome.refused;
    }
  }

  void write(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), std::streamsize(bytes.size()));
  }

  std::string path_, bytes_;
  std::function<void()> read_;
};

class DamagedSequence : public testing::Test {
 protected:
  DamagedSequence() { test::writeSequence(directory_.path(), test::movingBlob(ElementType::u8, 3, 12)); }

  // Everything that is left must be refused: these files carry checksums.
  static void expectAllRefused(Victim victim) {
    EXPECT_EQ(victim.truncateEverywhere().accepted, 0);
    const Outcome flips = victim.flip(kFlips, 1);
    EXPECT_EQ(flips.accepted, 0);
    EXPECT_GT(flips.refused, kFlips * 9 / 10);
  }
  test::TemporaryDirectory directory_;
};

TEST_F(DamagedSequence, ManifestIsRefused) {
  expectAllRefused({directory_ / "sequence.json", [&] { readManifest(directory_.path()); }});
}

TEST_F(DamagedSequence, KeyFrameIsRefused) {
  const SequenceReader reader(directory_.path());
  expectAllRefused({reader.keyPath(0), [&] { reader.readKey(0); }});
}

TEST_F(DamagedSequence, DifferentialFileIsRefused) {
  const SequenceReader reader(directory_.path());
  expectAllRefused({reader.differentialPath(1), [&] { reader.readChanges(1); }});
}

// Its decoder reads floats and nothing else.
TEST_F(DamagedSequence, FilesOfAnotherGridTypeAreRefused) {
  SequenceManifest manifest = readManifest(directory_.path());
  const SequenceReader reader(directory_.path());
  const auto retyped = [&](const std::string& path, const std::string& type) {
    std::string bytes = test::readBytes(path);
    const std::string found = "Tree_float_5_4_3";
    bytes.replace(bytes.find(found), found.size(), type);
    std::ofstream(path, std::ios::binary) << bytes;
    return xxh64(bytes);
  };
  for (const char* type : {"Tree_int32_5_4_3", "Tree_space_5_4_3"}) {
    std::filesystem::remove(directory_ / "sequence.json");  // else it is there already, finished
    test::writeSequence(directory_.path(), test::movingBlob(ElementType::u8, 3, 12));
    manifest.steps[0].keyHash = retyped(reader.keyPath(0), type);
    manifest.steps[1].differentialHash = retyped(reader.differentialPath(1), type);
    directory_.write("sequence.json", manifestText(manifest));
    const SequenceReader damaged(directory_.path());
    for (const auto& read : {std::function<void()>([&] { damaged.readKey(0); }),
                             std::function<void()>([&] { damaged.readChanges(1); })})
      EXPECT_NE(test::messageOf<InputError>(read).find("expected float"), std::string::npos) << type;
  }
}

TEST(DamagedRawFile, TruncationIsRefusedAndFlipsAreOtherVoxels) {
  const test::TemporaryDirectory directory;
  const std::string path = directory.write("s_1.raw", std::string(6 * 5 * 4 * 4, 'x'));
  Victim victim(path, [&] {
    InputSeries::open({path}, {"", RawFormat{{6, 5, 4}, ElementType::f32, {1, 1, 1}}})->read(0);
  });
  EXPECT_EQ(victim.truncateEverywhere().accepted, 0);
  EXPECT_EQ(victim.flip(kFlips, 2).refused, 0);
}

TEST(DamagedTransferFunction, IsRefusedOrAnotherFunction) {
  const test::TemporaryDirectory directory;
  const std::string json =
      directory.write("a.json", R"([{"ColorSpace": "Diverging", "Name": "x", "NanColor": [1, 1, 0],
 "RGBPoints": [0, 0.23, 0.3, 0.75, 0.5, 0.86, 0.86, 0.86, 1, 0.7, 0.02, 0.15],
 "Points": [0, 0, 0.5, 0, 0.4, 0.3, 0.4, 0.2, 1, 1, 0.5, 0]}])");
  const std::string rows = directory.write("b.txt", "# rows\n0 0 0 0 0\n0.5 1 0.5 0 0.25\n1e0 1 1 1 1\n");
  for (const std::string& path : {json, rows}) {
    Victim victim(path, [&] { readTransferFunction(path); });
    EXPECT_GT(victim.truncateEverywhere().refused, 0);
    EXPECT_GT(victim.flip(kFlips, 3).refused, kFlips / 10);
  }
}

class DamagedVdb : public testing::TestWithParam<uint32_t> {};

// Blob, tile and inactive values, beside a grid of another type; whole series are opened and read.
TEST_P(DamagedVdb, IsRefusedOrHoldsOtherValues) {
  const test::TemporaryDirectory directory;
  const std::string path = directory / "s_0001.vdb";
  const auto grid = test::blobGrid(openvdb::Coord(3, 4, 5), 6);
  grid->tree().setValueOff(openvdb::Coord(3, 4, 5), 7);
  grid->tree().addTile(1, openvdb::Coord(16, 0, 0), 2, true);
  grid->setSaveFloatAsHalf(GetParam() == openvdb::io::COMPRESS_ACTIVE_MASK);
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->tree().setValueOn(openvdb::Coord(1), openvdb::Vec3s(1, 2, 3));
  test::writeVdb(path, {vectors, grid}, GetParam());
  Victim victim(path, [&] { InputSeries::open({path}, {})->read(0); });
  const Outcome truncations = victim.truncateEverywhere();
  EXPECT_EQ(truncations.accepted, 0);
  EXPECT_EQ(truncations.refused, int(victim.size()));
  const Outcome flips = victim.flip(kFlips, GetParam());
  EXPECT_GT(flips.refused, 0);
}

// Uncompressed files hold every tile value of every node, 160 kB a tree: too many truncation points, so ZIP
// for "all".
INSTANTIATE_TEST_SUITE_P(Compressions, DamagedVdb,
                         testing::Values(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK,
                                         openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK,
                                         uint32_t(openvdb::io::COMPRESS_ACTIVE_MASK),
                                         uint32_t(openvdb::io::COMPRESS_ZIP)));

}  // namespace
}  // namespace kairos
