#include "app/frame_store.h"

#include <sys/types.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace kairos {
namespace {

constexpr const char* kName = "temporary file of exact frames";

}  // namespace

FrameStore::FrameStore(int width, int height) : file_(std::tmpfile()), image_(width, height, 4) {
  if (!file_) throw OutputError(kName, std::string("cannot be made: ") + std::strerror(errno));
}

void FrameStore::seek(size_t index) {
  const uint64_t bytes = image_.data.size() * sizeof(float);
  if (::fseeko(file_.get(), off_t(index * bytes), SEEK_SET) != 0)
    throw InputError(kName, std::string("cannot be positioned: ") + std::strerror(errno));
}

void FrameStore::append(const Image& image) {
  seek(count_);
  const size_t values = image_.data.size();
  if (std::fwrite(image.data.data(), sizeof(float), values, file_.get()) != values ||
      std::fflush(file_.get()) != 0)
    throw OutputError(kName, std::string("cannot be written: ") + std::strerror(errno));
  ++count_;
}

const Image& FrameStore::read(size_t index) {
  seek(index);
  const size_t values = image_.data.size();
  if (std::fread(image_.data.data(), sizeof(float), values, file_.get()) != values)
    throw InputError(kName, "ends early");
  return image_;
}

}  // namespace kairos
