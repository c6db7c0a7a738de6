// One line of progress on stderr: a percentage, a rate and an ETA, redrawn in place; nothing where stderr is
// no terminal.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace kairos {

class ProgressLine {
 public:
  /// `unit` names what is counted, for example "frames". `quiet` switches it off.
  ProgressLine(std::string label, std::string unit, bool quiet);
  ~ProgressLine();  // ends the line
  void update(int64_t done, int64_t total);
  /// Prints a whole line (a warning, say) without damaging the progress line.
  void message(const std::string& line);
  void finish();

 private:
  std::string label_, unit_;
  bool enabled_, drawn_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace kairos
