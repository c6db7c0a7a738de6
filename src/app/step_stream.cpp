#include "app/step_stream.h"

#include <chrono>
#include <utility>

namespace kairos {

StepStream::StepStream(StepSource& source, size_t first, size_t last)
    : source_(source), thread_([this, first, last] { load(first, last); }) {}

StepStream::~StepStream() {
  queue_.close();
  thread_.join();
}

std::unique_ptr<LoadedStep> StepStream::next() {
  if (auto step = queue_.pop()) return std::move(*step);
  if (failure_) std::rethrow_exception(failure_);
  return nullptr;
}

void StepStream::load(size_t first, size_t last) {
  try {
    for (size_t index = first; index <= last; ++index) {
      const auto begin = std::chrono::steady_clock::now();
      auto step = std::make_unique<LoadedStep>(index == first ? source_.start(index) : source_.next());
      step->loadMs =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
      if (!queue_.push(std::move(step))) return;
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.close();
}

}  // namespace kairos
