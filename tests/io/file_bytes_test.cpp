#include "io/file_bytes.h"

#include <gtest/gtest.h>

#include <string_view>

#include "io/temporary_directory.h"

namespace kairos {
namespace {

uint64_t hashOf(std::string_view text) {
  return xxh64(std::span(text.data(), text.size()));
}

TEST(FileBytes, HashIsXxh64) {
  EXPECT_EQ(hashOf(""), 0xef46db3751d8e999ull);
  EXPECT_EQ(hashOf("a"), 0xd24ec4f1a98c6e5bull);
  EXPECT_EQ(hashOf("abc"), 0x44bc2cf5ad770999ull);
  EXPECT_EQ(hashOf("Nobody inspects the spammish repetition"), 0xfbcea83c8a378bf1ull);
}

TEST(FileBytes, HexIsSixteenDigitsAndComesBack) {
  EXPECT_EQ(hexOf(0xab), "00000000000000ab");
  EXPECT_EQ(valueOfHex("fedcba9876543210"), 0xfedcba9876543210ull);
  EXPECT_THROW(valueOfHex("FEDCBA9876543210"), std::invalid_argument);
  EXPECT_THROW(valueOfHex("1234"), std::invalid_argument);
}

TEST(ByteReader, ReadsAcrossItsBuffer) {
  const test::TemporaryDirectory directory;
  std::string bytes(200000, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = char(i * 7 + i / 256);
  const InputFile file(directory.write("f", bytes));
  ByteReader reader(file);
  reader.skip(65530);
  std::string part(70000, '\0');
  reader.read(part.data(), part.size());
  EXPECT_EQ(part, bytes.substr(65530, 70000));
  reader.seek(3);
  EXPECT_EQ(reader.get<char>(), bytes[3]);
  EXPECT_EQ(reader.remaining(), bytes.size() - 4);
}

TEST(ByteReader, RefusesToReadBehindTheEnd) {
  const std::string bytes = "\x05\0\0\0abc";
  ByteReader reader("f", std::span(bytes.data(), 7));
  EXPECT_THROW(reader.getString(), InputError);
  EXPECT_THROW(reader.skip(4), InputError);
  EXPECT_THROW(reader.seek(8), InputError);
}

TEST(InputFile, NamesWhatItCannotOpen) {
  EXPECT_THROW(InputFile("/nonexistent/f"), InputError);
  EXPECT_THROW(InputFile("/tmp"), InputError);
  EXPECT_THROW(InputFile("/dev/zero"), InputError);
}

}  // namespace
}  // namespace kairos
