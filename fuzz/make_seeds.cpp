// Writes a small seed corpus for every fuzz target: make_seeds DIRECTORY.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "io/image_file.h"
#include "io/manifest.h"
#include "io/series.h"
#include "io/vdb_files.h"

namespace kairos {
namespace {

namespace fs = std::filesystem;

void save(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

std::string load(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void sequences(const fs::path& out) {
  for (ElementType type : {ElementType::u8, ElementType::u16, ElementType::f32}) {
    const fs::path made = out / "made" / std::string(name(type));
    test::writeSequence(made.string(), test::movingBlob(type, 3, 10), 2);
    const std::string id(name(type));
    const std::string manifest = load(made / "sequence.json");
    save(out / "manifest" / id, manifest.substr(0, manifest.rfind("\n\"checksum\"")));
    for (const fs::directory_entry& file : fs::directory_iterator(made)) {
      const std::string name = file.path().filename().string();
      if (!name.ends_with(".vdb")) continue;
      const char kind = char(int(type) + (name.starts_with("key") ? 3 : 0));
      save(out / "differential" / (id + name), kind + load(file.path()));
      save(out / "vdb_series" / (id + name), load(file.path()));
    }
  }
}

void simulations(const fs::path& out) {
  int number = 0;
  for (uint32_t packing :
       {openvdb::io::COMPRESS_NONE, openvdb::io::COMPRESS_ZIP, openvdb::io::COMPRESS_BLOSC})
    for (bool half : {false, true}) {
      const auto grid = test::blobGrid(openvdb::Coord(3, 4, 5), 3);
      grid->tree().addTile(1, openvdb::Coord(16, 0, 0), 2, true);
      grid->setSaveFloatAsHalf(half);
      auto vectors = openvdb::Vec3SGrid::create();
      vectors->setName("velocity");
      vectors->tree().setValueOn(openvdb::Coord(1), openvdb::Vec3s(1, 2, 3));
      test::writeVdb((out / "vdb_series" / std::to_string(number++)).string(), {vectors, grid},
                     packing | openvdb::io::COMPRESS_ACTIVE_MASK);
    }
}

void images(const fs::path& out) {
  fs::create_directories(out / "exr");
  fs::create_directories(out / "png");
  for (const auto& [width, height] : {std::pair(7, 5), {1, 1}, {40, 33}}) {
    Image image(width, height, 4);
    for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i % 97) / 97;
    Image depth(width, height, 1);
    const std::string id = std::to_string(width);
    for (ExrCompression c :
         {ExrCompression::none, ExrCompression::zips, ExrCompression::zip, ExrCompression::piz}) {
      const std::string file = (out / "exr" / (id + "." + std::to_string(int(c)) + ".exr")).string();
      writeExr(file, image, {{"Z", &depth}}, {}, {{"comments", "seed"}, {"kairos:step", 7}},
               {.half = width != 7, .compression = c});
    }
    writePng((out / "png" / (id + ".png")).string(), image);
  }
}

void small(const fs::path& out) {
  save(out / "raw_series/u8", std::string("\x02\x01\x03\x00", 4) + std::string(24, 'x'));
  save(out / "raw_series/f32", std::string("\x02\x01\x03\x82", 4) + std::string(96, 'y'));
  save(out / "transfer_function/rows", "# rows\n0 0 0 0 0\n0.5 1 0.5 0 0.25\n1e0 1 1 1 1\n");
  const char* const spaces[] = {"RGB", "HSV", "Lab", "Diverging", "Step"};
  for (const char* space : spaces)
    save(out / "transfer_function" / space,
         std::string(R"([{"ColorSpace": ")") + space + R"(", "Name": "x", "NanColor": [1, 1, 0],
 "RGBPoints": [0, 0.23, 0.3, 0.75, 0.5, 0.86, 0.86, 0.86, 1, 0.7, 0.02, 0.15],
 "Points": [0, 0, 0.5, 0, 0.4, 0.3, 0.4, 0.2, 1, 1, 0.5, 0]}])");
}

}  // namespace
}  // namespace kairos

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fuzz_seeds DIRECTORY\n", stderr);
    return 2;
  }
  const std::filesystem::path out = argv[1];
  kairos::small(out);
  kairos::images(out);
  kairos::sequences(out);
  kairos::simulations(out);
  return 0;
}
