#include "io/exr_header_check.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfPreviewImage.h>
#include <ImfStringAttribute.h>
#include <ImfStringVectorAttribute.h>
#include <ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "core/error.h"
#include "io/image_file.h"
#include "io/temporary_directory.h"

namespace kairos {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Image checkered(int width, int height) {
  Image image(width, height, 4);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = float(i % 3);
  return image;
}

// The value of the attribute `name` in the bytes of a file.
char* valueOf(std::string& bytes, const std::string& name, const std::string& type) {
  const std::string head = name + '\0' + type + '\0';
  const size_t at = bytes.find(head);
  EXPECT_NE(at, std::string::npos) << name;
  return bytes.data() + at + head.size() + 4;
}

template <class T>
void put(char* at, T value) {
  std::memcpy(at, &value, sizeof value);
}

// Black pixels for the channels R, G, B and A, all of them the same memory.
struct Black {
  Black(int width, int height) : values(size_t(width) * size_t(height), half(0.0f)) {
    for (const char* channel : {"R", "G", "B", "A"})
      frame.insert(channel,
                   Imf::Slice(Imf::HALF, reinterpret_cast<char*>(values.data()), 2, size_t(width) * 2));
  }
  std::vector<half> values;
  Imf::FrameBuffer frame;
};

class ExrHeaderCheck : public testing::Test {
 protected:
  ExrHeaderCheck() {
    writeExr(path(), checkered(7, 5), {}, {}, {{"comments", "as it is"}}, {});
    bytes_ = test::readBytes(path());
  }
  std::string path() const { return directory_ / "f.exr"; }

  // The header that OpenEXR's own writers start from.
  static Imf::Header header(int width, int height) {
    Imf::Header header(width, height);
    for (const char* channel : {"R", "G", "B", "A"})
      header.channels().insert(channel, Imf::Channel(Imf::HALF));
    return header;
  }
  std::string refusal() const {
    const std::string message = test::messageOf<InputError>([&] { checkExrHeader("f.exr", bytes_); });
    EXPECT_THAT(message, testing::StartsWith("f.exr: "));
    EXPECT_THROW(readImage(directory_.write("g.exr", bytes_)), InputError);
    EXPECT_THROW(readMetadata(directory_ / "g.exr"), InputError);
    return message;
  }

  const test::TemporaryDirectory directory_;
  std::string bytes_;
};

TEST_F(ExrHeaderCheck, EveryCompressionOfAConstantImageStands) {
  // The images that pack best: nothing that OpenEXR writes may be taken for a false claim.
  for (int compression = 0; compression < Imf::NUM_COMPRESSION_METHODS; ++compression)
    for (const auto& [width, height] : {std::pair(1, 1), {3000, 1}, {1, 3000}, {1024, 1024}}) {
      Imf::Header h = header(width, height);
      h.compression() = Imf::Compression(compression);
      {
        const Black black(width, height);
        Imf::OutputFile file(path().c_str(), h);
        file.setFrameBuffer(black.frame);
        file.writePixels(height);
      }
      EXPECT_NO_THROW(checkExrHeader(path(), test::readBytes(path()))) << compression << " " << width;
    }
}

TEST_F(ExrHeaderCheck, TilesPreviewsTextsAndSubsampledChannelsStand) {
  Imf::Header h = header(100, 70);
  h.channels() = Imf::ChannelList();
  h.channels().insert("Y", Imf::Channel(Imf::FLOAT));
  h.insert("list", Imf::StringVectorAttribute({"one", "", "three"}));
  h.setPreviewImage(Imf::PreviewImage(4, 3));
  std::vector<float> pixels(100 * 70, 0.5f);
  Imf::FrameBuffer frame;
  frame.insert("Y", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.data()), 4, 400));
  {
    Imf::Header tiled = h;
    tiled.setTileDescription(Imf::TileDescription(64, 32, Imf::RIPMAP_LEVELS));
    Imf::TiledOutputFile file(path().c_str(), tiled);
    file.setFrameBuffer(frame);
    for (int ly = 0; ly < file.numYLevels(); ++ly)
      for (int lx = 0; lx < file.numXLevels(); ++lx)
        file.writeTiles(0, file.numXTiles(lx) - 1, 0, file.numYTiles(ly) - 1, lx, ly);
  }
  EXPECT_EQ(readImage(path()).data[4 * 777], 0.5f);
  h.compression() = Imf::NO_COMPRESSION;
  h.channels().insert("RY", Imf::Channel(Imf::HALF, 2, 2));
  {
    Imf::OutputFile file(path().c_str(), h);
    file.setFrameBuffer(frame);
    file.writePixels(70);
  }
  EXPECT_NO_THROW(checkExrHeader(path(), test::readBytes(path())));
}

TEST_F(ExrHeaderCheck, EveryPartIsWalked) {
  std::vector<Imf::Header> headers(2, header(6, 4));
  for (size_t i = 0; i < 2; ++i) {
    headers[i].setName(i == 0 ? "first" : "second");
    headers[i].setType(Imf::SCANLINEIMAGE);
  }
  headers[1].insert("note", Imf::StringAttribute("of the second"));
  {
    const Black black(6, 4);
    Imf::MultiPartOutputFile file(path().c_str(), headers.data(), 2);
    for (int i = 0; i < 2; ++i) {
      Imf::OutputPart part(file, i);
      part.setFrameBuffer(black.frame);
      part.writePixels(4);
    }
  }
  bytes_ = test::readBytes(path());
  EXPECT_NO_THROW(checkExrHeader(path(), bytes_));
  put(valueOf(bytes_, "note", "string") - 4, uint32_t(1) << 31);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("note"), HasSubstr("2147483648")));
}

TEST_F(ExrHeaderCheck, AnAttributeBeyondTheEndIsNamed) {
  put(valueOf(bytes_, "comments", "string") - 4, uint32_t(0x7fffffff));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("\"comments\" claims 2147483647 bytes"), HasSubstr("are left")));
}

TEST_F(ExrHeaderCheck, AnAttributeOfAnotherSizeThanItsTypeIsRefused) {
  put(valueOf(bytes_, "pixelAspectRatio", "float") - 4, uint32_t(40));
  EXPECT_THAT(refusal(), HasSubstr("\"pixelAspectRatio\" has 40 bytes, expected 4"));
}

TEST_F(ExrHeaderCheck, WindowsChunksAndTilesMustFitTheBytes) {
  const std::string intact = bytes_;
  char* window = valueOf(bytes_, "dataWindow", "box2i");
  put(window + 8, 100'000);
  EXPECT_THAT(refusal(), HasSubstr("65536 x 65536"));
  put(window + 8, -1);
  EXPECT_THAT(refusal(), HasSubstr("65536 x 65536"));
  put(window + 8, 0);
  put(window + 12, 30'000);
  EXPECT_THAT(refusal(), HasSubstr("more lines or tiles"));
  put(window + 8, 60'000);
  EXPECT_THAT(refusal(), HasSubstr("more pixels"));
  bytes_ = intact;
  put(valueOf(bytes_, "channels", "chlist") + 2 + 8, 0);
  EXPECT_THAT(refusal(), HasSubstr("channel \"A\" has a sample for every 0 x 1"));
}

TEST_F(ExrHeaderCheck, APreviewIsAsLargeAsItsAttribute) {
  Imf::Header h = header(1, 1);
  h.setPreviewImage(Imf::PreviewImage(4, 3));
  Imf::OutputFile(path().c_str(), h);
  bytes_ = test::readBytes(path());
  put(valueOf(bytes_, "preview", "preview"), 60'000);
  put(valueOf(bytes_, "preview", "preview") + 4, 60'000);
  EXPECT_THAT(refusal(), HasSubstr("\"preview\" has 56 bytes"));
}

TEST_F(ExrHeaderCheck, ATextIsNoLongerThanItsAttribute) {
  Imf::Header h = header(1, 1);
  h.insert("list", Imf::StringVectorAttribute({"one", "two"}));
  Imf::OutputFile(path().c_str(), h);
  bytes_ = test::readBytes(path());
  put(valueOf(bytes_, "list", "stringvector"), 0x7fffffff);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("\"list\""), HasSubstr("2147483647")));
}

TEST_F(ExrHeaderCheck, DeepImagesAreRefused) {
  const std::string intact = bytes_;
  put(bytes_.data() + 4, uint32_t(2 | 1 << 11));  // version 2, not an image
  EXPECT_THAT(refusal(), HasSubstr("is a deep image"));
  bytes_ = intact;
  std::string type = std::string("type\0string\0\x0c\0\0\0deepscanline", 28);
  bytes_.insert(8, type);
  EXPECT_THAT(refusal(), HasSubstr("is a deep image"));
}

TEST_F(ExrHeaderCheck, EveryTruncationOfTheHeaderIsAnError) {
  const std::string intact = bytes_;
  const size_t pixels = intact.size() - 100;
  for (size_t length = 0; length < pixels; ++length) {
    bytes_ = intact.substr(0, length);
    EXPECT_THROW(readImage(directory_.write("g.exr", bytes_)), InputError) << length;
  }
}

}  // namespace
}  // namespace kairos
