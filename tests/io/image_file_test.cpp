#include "io/image_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/srgb.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::HasSubstr;

Image gradient(int width, int height) {
  Image image(width, height, 4);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i % 97) / 128;
  return image;
}

Camera lookingDownY(Camera::Projection projection) {
  Camera camera;
  camera.eye = {1, -10, 2};
  camera.target = {1, 0, 2};
  camera.up = {0, 0, 1};
  camera.projection = projection;
  camera.verticalFovDegrees = 40;
  camera.imageHeight = 6;
  return camera;
}

class ExrFile : public testing::Test {
 protected:
  void write(const Image& image, const ExrOptions& options, const Metadata& metadata = {},
             const std::vector<ExrChannel>& channels = {}) {
    writeExr(path(), image, channels, camera_, metadata, options);
  }
  std::string path() const { return directory_ / "f.exr"; }
  test::TemporaryDirectory directory_;
  Camera camera_ = lookingDownY(Camera::Projection::perspective);
};

TEST_F(ExrFile, FloatsComeBackExactlyWithEveryCompression) {
  const Image image = gradient(33, 21);
  for (ExrCompression compression :
       {ExrCompression::none, ExrCompression::zips, ExrCompression::zip, ExrCompression::piz}) {
    write(image, {false, compression, 25});
    EXPECT_EQ(readImage(path()), image);
  }
}

// OpenEXR's own reader, which knows nothing of how the chunks were made.
TEST_F(ExrFile, TheBlankMarginIsLeftOut) {
  Image image(40, 50, 4);
  for (int y = 7; y < 41; ++y)
    for (int x = 3; x < 30; ++x) image.pixel(x, y)[(x + y) % 4] = float(x * y) / 512;
  for (bool half : {true, false})
    for (ExrCompression compression :
         {ExrCompression::none, ExrCompression::zips, ExrCompression::zip, ExrCompression::piz}) {
      write(image, {half, compression, 25});
      EXPECT_EQ(readImage(path()).width, 40);
      const Imf::InputFile file(path().c_str());
      EXPECT_EQ(file.header().displayWindow(), Imath::Box2i({0, 0}, {39, 49}));
      EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({3, 7}, {29, 40}));
      if (half) continue;  // rounded
      EXPECT_EQ(readImage(path()), image);
    }
}

TEST_F(ExrFile, BlankImagesAreStoredAsOnePixel) {
  for (ExrCompression compression : {ExrCompression::none, ExrCompression::zip, ExrCompression::piz}) {
    write(Image(40, 50, 4), {true, compression, 25});
    EXPECT_EQ(readImage(path()), Image(40, 50, 4));
  }
}

TEST_F(ExrFile, AChannelKeepsItsPixelsWhereTheColourIsBlank) {
  Image depth(6, 5, 1);
  depth.pixel(5, 4)[0] = 3;
  Image image(6, 5, 4);
  image.pixel(1, 1)[3] = 1;
  write(image, {}, {{"a name of more than 31 characters is long", 1}}, {{"Z", &depth}});
  Imf::InputFile file(path().c_str());
  EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({1, 1}, {5, 4}));
  Image back(6, 5, 1);
  Imf::FrameBuffer frame;
  frame.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(back.data.data()), sizeof(float),
                               6 * sizeof(float)));
  file.setFrameBuffer(frame);
  file.readPixels(1, 4);
  EXPECT_EQ(back, depth);
  EXPECT_EQ(readImage(path()), image);
}

TEST(ReadImage, ShowsTheDisplayWindow) {
  // Overscan: pixels outside the display window belong to no image.
  const test::TemporaryDirectory directory;
  Imf::Header header(Imath::Box2i({10, 10}, {13, 12}), Imath::Box2i({8, 11}, {11, 20}));
  for (const char* name : {"R", "G", "B"}) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  std::vector<float> values(4 * 10);
  for (size_t i = 0; i < values.size(); ++i) values[i] = float(i);
  char* base = reinterpret_cast<char*>(values.data() - 8 - 11 * 4);
  Imf::FrameBuffer frame;
  for (const char* name : {"R", "G", "B"})
    frame.insert(name, Imf::Slice(Imf::FLOAT, base, sizeof(float), 4 * sizeof(float)));
  {
    Imf::OutputFile file((directory / "f.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(10);
  }
  const Image image = readImage(directory / "f.exr");
  ASSERT_EQ(image.width, 4);
  ASSERT_EQ(image.height, 3);
  EXPECT_EQ(image.pixel(0, 0)[3], 0);  // above the data window
  EXPECT_EQ(image.pixel(0, 1)[0], 2);
  EXPECT_EQ(image.pixel(1, 2)[0], 7);
  EXPECT_EQ(image.pixel(1, 2)[3], 1);
  EXPECT_EQ(image.pixel(2, 2)[3], 0);  // right of it
}

TEST_F(ExrFile, HalvesComeBackRounded) {
  Image image = gradient(8, 8);
  image.data[5] = 0.1f;
  write(image, {});
  const Image back = readImage(path());
  EXPECT_NEAR(back.data[5], 0.1f, 1e-4);
  EXPECT_NE(back.data[5], 0.1f);
  EXPECT_EQ(back.data[6], image.data[6]);
}

TEST_F(ExrFile, AnExtraChannelIsFloatAndKeepsItsName) {
  const Image image = gradient(5, 4);
  Image depth(5, 4, 1);
  for (size_t i = 0; i < depth.data.size(); ++i) depth.data[i] = 1.1f * float(i);
  write(image, {}, {}, {{"Z", &depth}});
  Imf::InputFile file(path().c_str());
  ASSERT_NE(file.header().channels().findChannel("Z"), nullptr);
  EXPECT_EQ(file.header().channels().findChannel("Z")->type, Imf::FLOAT);
  EXPECT_EQ(file.header().channels().findChannel("R")->type, Imf::HALF);
  EXPECT_EQ(readImage(path()).width, 5);
}

TEST_F(ExrFile, MetadataComeBack) {
  write(gradient(4, 4), {},
        {{"comments", std::string("kairos render ...")}, {"kairos:step", 21}, {"kairos:rmse", 0.25f}});
  const Metadata metadata = readMetadata(path());
  EXPECT_EQ(std::get<int>(metadata.at("kairos:step")), 21);
  EXPECT_EQ(std::get<float>(metadata.at("kairos:rmse")), 0.25f);
  Imf::InputFile file(path().c_str());
  EXPECT_EQ(Imf::comments(file.header()), "kairos render ...");
  EXPECT_EQ(double(Imf::framesPerSecond(file.header())), 25.0);
}

TEST_F(ExrFile, WorldToCameraHasTheViewAlongPositiveZ) {
  write(gradient(16, 12), {});
  Imf::InputFile file(path().c_str());
  const Imath::V3f p = Imath::V3f(2, 0, 5) * Imf::worldToCamera(file.header());
  EXPECT_NEAR(p.x, 1, 1e-5);   // right
  EXPECT_NEAR(p.y, 3, 1e-5);   // up
  EXPECT_NEAR(p.z, 10, 1e-5);  // in front
}

TEST_F(ExrFile, WorldToNdcFindsThePixelOfEveryRay) {
  for (auto projection : {Camera::Projection::perspective, Camera::Projection::orthographic}) {
    camera_ = lookingDownY(projection);
    const int width = 30, height = 20;
    write(gradient(width, height), {});
    Imf::InputFile file(path().c_str());
    const RayGenerator rays(camera_, width, height);
    for (auto [x, y] : {std::pair{0.5, 0.5}, {15.0, 10.0}, {29.0, 3.0}}) {
      const Ray ray = rays.ray(x, y);
      const Vec3d p = ray.origin + ray.direction * 7.0;
      const Imath::V3f ndc = Imath::V3f(float(p.x), float(p.y), float(p.z)) * Imf::worldToNDC(file.header());
      EXPECT_NEAR(ndc.x, x / width, 1e-5);
      EXPECT_NEAR(ndc.y, y / height, 1e-5);
    }
  }
}

TEST_F(ExrFile, ImpossibleImagesAndPlacesAreErrorsThatLeaveNothing) {
  Image wrong(3, 3, 1);
  EXPECT_THROW(write(Image(), {}), OutputError);
  EXPECT_THROW(write(gradient(4, 4), {}, {}, {{"Z", &wrong}}), OutputError);
  EXPECT_THROW(writeExr(directory_ / "none/f.exr", gradient(4, 4), {}, camera_, {}, {}), OutputError);
  EXPECT_TRUE(directory_.names().empty());
}

TEST(PngFile, ShowsTheImageOverBlackInSrgb) {
  const test::TemporaryDirectory directory;
  Image image(3, 1, 4);
  image.data = {0.5f, 0.25f, 0, 0.5f, 2, -1, 1, 1, 0, 0, 0, 0};
  writePng(directory / "f.png", image);
  const Image back = readImage(directory / "f.png");
  ASSERT_EQ(back.width, 3);
  EXPECT_NEAR(back.data[0], 0.5f, 0.005);
  EXPECT_NEAR(back.data[1], 0.25f, 0.005);
  EXPECT_EQ(back.data[3], 1);
  EXPECT_EQ(back.data[4], 1);
  EXPECT_EQ(back.data[5], 0);
  EXPECT_EQ(directory.names(), std::vector<std::string>{"f.png"});
}

TEST(PngFile, FailsWithoutADirectory) {
  EXPECT_THROW(writePng("/nonexistent/f.png", gradient(2, 2)), OutputError);
}

TEST(ReadImage, SaysWhatIsWrong) {
  const test::TemporaryDirectory directory;
  EXPECT_THAT(test::messageOf<InputError>([] { readImage("/nonexistent/f.exr"); }),
              HasSubstr("/nonexistent/f.exr"));
  EXPECT_THROW(readImage(directory.write("f.exr", "no image")), InputError);
  EXPECT_THROW(readMetadata(directory.write("f.png", "no image")), InputError);
}

void putBigEndian(std::string& bytes, size_t at, uint32_t value) {
  for (size_t i = 0; i < 4; ++i) bytes[at + i] = char(value >> (24 - 8 * i));
}

// Of PNG chunks (ISO 3309).
uint32_t crc32(std::string_view bytes) {
  uint32_t crc = ~0u;
  for (char byte : bytes) {
    crc ^= uint8_t(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0u);
  }
  return ~crc;
}

TEST(ReadImage, RefusesMorePixelsThanItsBytesCanHold) {
  // Headers that claim so many would cost gigabytes before the missing pixels are missed.
  const test::TemporaryDirectory directory;
  writePng(directory / "f.png", gradient(7, 5));
  std::string png = test::readBytes(directory / "f.png");
  putBigEndian(png, 16, 60000);
  putBigEndian(png, 20, 60000);
  putBigEndian(png, 29, crc32(std::string_view(png).substr(12, 17)));
  EXPECT_THAT(test::messageOf<InputError>([&] { readImage(directory.write("g.png", png)); }),
              HasSubstr("more pixels than its bytes can hold"));

  // OpenEXR itself misses the table of chunks, one for 32 rows; here it is long enough for 4000 rows of
  // 60000.
  writeExr(directory / "f.exr", gradient(7, 5), {}, lookingDownY(Camera::Projection::perspective), {},
           {.compression = ExrCompression::piz});
  std::string exr = test::readBytes(directory / "f.exr") + std::string(1000, '\0');
  const std::string_view attribute("dataWindow\0box2i\0", 17);
  const size_t at = exr.find(attribute);
  ASSERT_NE(at, std::string::npos);
  const int32_t highest[] = {59999, 3999};
  exr.replace(at + attribute.size() + 4 + 8, sizeof highest, reinterpret_cast<const char*>(highest),
              sizeof highest);
  EXPECT_THAT(test::messageOf<InputError>([&] { readImage(directory.write("g.exr", exr)); }),
              HasSubstr("more pixels than its bytes can hold"));
}

}  // namespace
}  // namespace kairos
