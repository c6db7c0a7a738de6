#include "app/progress_line.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <utility>

namespace kairos {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kRedrawSeconds = 0.1;

std::string clockTime(double seconds) {
  const auto total = int64_t(std::ceil(seconds));
  char text[32];
  if (total >= 3600)
    std::snprintf(text, sizeof text, "%lld:%02d:%02d", static_cast<long long>(total / 3600),
                  int(total / 60 % 60), int(total % 60));
  else
    std::snprintf(text, sizeof text, "%d:%02d", int(total / 60), int(total % 60));
  return text;
}

}  // namespace

ProgressLine::ProgressLine(std::string label, std::string unit, bool quiet)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      enabled_(!quiet && ::isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()) {}

ProgressLine::~ProgressLine() {
  finish();
}

void ProgressLine::update(int64_t done, int64_t total) {
  if (!enabled_) return;
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && done < total && Seconds(now - last_).count() < kRedrawSeconds) return;
  last_ = now;
  const double elapsed = Seconds(now - start_).count(), rate = elapsed > 0 ? double(done) / elapsed : 0;
  const double percent = total > 0 ? 100.0 * double(done) / double(total) : 100.0;
  std::fprintf(stderr, "\r\033[K%s %3.0f %%  %lld of %lld %s", label_.c_str(), percent,
               static_cast<long long>(done), static_cast<long long>(total), unit_.c_str());
  if (done > 0 && rate > 0)
    std::fprintf(stderr, "  %.1f %s/s  %s left", rate, unit_.c_str(),
                 clockTime(double(total - done) / rate).c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressLine::message(const std::string& line) {
  std::fprintf(stderr, "%s%s\n", drawn_ ? "\r\033[K" : "", line.c_str());
  drawn_ = false;
}

void ProgressLine::finish() {
  if (drawn_) std::fputc('\n', stderr);
  drawn_ = false;
}

}  // namespace kairos
