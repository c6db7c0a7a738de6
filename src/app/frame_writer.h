// Writing behind: finished frames become files while the next ones are rendered.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/bounded_queue.h"
#include "core/camera.h"
#include "core/image.h"
#include "io/image_file.h"

namespace kairos {

/// The value of "kairos:step": an int, or a double for numbers beyond it, such as dates with a time of day.
inline MetadataValue stepEntry(int64_t step) {
  if (std::in_range<int>(step)) return int(step);
  return double(step);
}

struct FrameToWrite {
  std::string path;                // of the EXR file
  std::optional<std::string> png;  // of its PNG
  Image rgba;
  std::optional<Image> depth;
  std::vector<std::pair<std::string, Image>> aovs;  // further channels by name
  Metadata metadata;
  std::function<void(double writeMs)> written;  // called after its files stand, in the order of submission
};

/// Writes frames in threads of its own, from a short queue. After the first error nothing more is written;
/// the error reaches the caller at the next `submit` or at `finish`.
class FrameWriter {
 public:
  FrameWriter(const Camera& camera, const ExrOptions& options, int threads);
  /// Writes what was submitted; errors are dropped (`finish` reports them).
  ~FrameWriter();

  /// Waits while the queue is full.
  void submit(FrameToWrite frame);
  /// The image of a frame already written, whose memory the next frame can take; an empty one while there is
  /// none.
  Image spareImage();
  /// Returns when everything submitted is written.
  void finish();

 private:
  struct Numbered {
    size_t number;
    FrameToWrite frame;
  };

  void work();
  void write(const FrameToWrite& frame) const;
  void keepForReuse(FrameToWrite& frame);
  void report(size_t number, std::function<void()> written);
  void join();
  void rethrow();

  Camera camera_;
  ExrOptions options_;
  BoundedQueue<Numbered> queue_;
  size_t submitted_ = 0;
  std::mutex mutex_;
  std::exception_ptr failure_;
  std::vector<Image> spareImages_;
  size_t nextReport_ = 0;
  std::map<size_t, std::function<void()>> reports_;  // of frames written before an earlier one
  std::vector<std::thread> threads_;
};

}  // namespace kairos
