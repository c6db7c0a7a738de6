#include "app/frame_writer.h"

#include <chrono>
#include <utility>

namespace kairos {

FrameWriter::FrameWriter(const Camera& camera, const ExrOptions& options, int threads)
    : camera_(camera), options_(options), queue_(2) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

FrameWriter::~FrameWriter() {
  join();
}

void FrameWriter::submit(FrameToWrite frame) {
  if (!queue_.push({submitted_++, std::move(frame)})) rethrow();
}

void FrameWriter::finish() {
  join();
  rethrow();
}

void FrameWriter::join() {
  queue_.close();
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
  // After an error some frames behind the failed one may stand.
  for (auto& [number, written] : std::exchange(reports_, {})) {
    try {
      written();
    } catch (...) {
      if (!failure_) failure_ = std::current_exception();
    }
  }
}

void FrameWriter::rethrow() {
  std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

void FrameWriter::work() {
  while (auto item = queue_.pop()) {
    try {
      {
        std::lock_guard lock(mutex_);
        if (failure_) return;
      }
      const auto begin = std::chrono::steady_clock::now();
      write(item->frame);
      keepForReuse(item->frame);
      const double ms =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
      report(item->number, [written = std::move(item->frame.written), ms] { written(ms); });
    } catch (...) {
      std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      queue_.close();
    }
  }
}

// The PNG first: a frame whose EXR stands is complete.
void FrameWriter::write(const FrameToWrite& frame) const {
  if (frame.png) writePng(*frame.png, frame.rgba);
  std::vector<ExrChannel> channels;
  if (frame.depth) channels.push_back({"Z", &*frame.depth});
  for (const auto& [channel, image] : frame.aovs) channels.push_back({channel, &image});
  writeExr(frame.path, frame.rgba, channels, camera_, frame.metadata, options_);
}

void FrameWriter::keepForReuse(FrameToWrite& frame) {
  std::lock_guard lock(mutex_);
  spareImages_.push_back(std::move(frame.rgba));
}

Image FrameWriter::spareImage() {
  std::lock_guard lock(mutex_);
  if (spareImages_.empty()) return {};
  Image image = std::move(spareImages_.back());
  spareImages_.pop_back();
  return image;
}

void FrameWriter::report(size_t number, std::function<void()> written) {
  std::lock_guard lock(mutex_);
  reports_.emplace(number, std::move(written));
  for (auto next = reports_.find(nextReport_); next != reports_.end(); next = reports_.find(nextReport_)) {
    next->second();
    reports_.erase(next);
    ++nextReport_;
  }
}

}  // namespace kairos
