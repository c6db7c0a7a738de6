// From INPUT arguments to the files of a series and their time steps.
#include <glob.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <set>

#include "core/error.h"
#include "io/input_series.h"

namespace kairos {
namespace {

namespace fs = std::filesystem;

struct Candidate {
  std::string path;
  std::optional<int64_t> step;  // that the file's name or the pattern states
};

bool isDigit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

std::optional<int64_t> numberOf(const std::string& digits) {
  constexpr size_t kMaxDigits = 18;  // of a 64-bit number
  if (digits.empty() || digits.size() > kMaxDigits) return std::nullopt;
  return std::stoll(digits);
}

std::optional<int64_t> lastNumber(const std::string& text) {
  const auto last = std::find_if(text.rbegin(), text.rend(), isDigit);
  const auto first = std::find_if_not(last, text.rend(), isDigit);
  return numberOf(std::string(first.base(), last.base()));
}

// The extension is no place for a number ("jet.0012.u8"), unless it is nothing but one ("jet.0012").
std::optional<int64_t> stepOfName(const std::string& path) {
  const fs::path file(path);
  const std::string extension = file.extension().string();
  const bool numeric = extension.size() > 1 && std::all_of(extension.begin() + 1, extension.end(), isDigit);
  return lastNumber((numeric ? file.filename() : file.stem()).string());
}

// "a2" before "a10": runs of digits compare as numbers.
bool naturalLess(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (isDigit(a[i]) && isDigit(b[j])) {
      size_t iEnd = i, jEnd = j;
      while (iEnd < a.size() && isDigit(a[iEnd])) ++iEnd;
      while (jEnd < b.size() && isDigit(b[jEnd])) ++jEnd;
      while (i + 1 < iEnd && a[i] == '0') ++i;
      while (j + 1 < jEnd && b[j] == '0') ++j;
      if (iEnd - i != jEnd - j) return iEnd - i < jEnd - j;
      if (const int c = a.compare(i, iEnd - i, b, j, jEnd - j); c != 0) return c < 0;
      i = iEnd;
      j = jEnd;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

std::vector<std::string> expandGlob(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> paths;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0)
    for (size_t i = 0; i < found.gl_pathc; ++i) paths.emplace_back(found.gl_pathv[i]);
  ::globfree(&found);
  return paths;
}

std::string lowerCase(std::string text) {
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::vector<Candidate> filesOfDirectory(const std::string& directory) {
  std::vector<Candidate> vdb, raw;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string(),
                      extension = lowerCase(entry.path().extension().string());
    if (name.starts_with('.') || !entry.is_regular_file()) continue;
    if (extension == ".vdb") vdb.push_back({entry.path().string(), stepOfName(name)});
    if (extension == ".raw") raw.push_back({entry.path().string(), stepOfName(name)});
  }
  if (!vdb.empty() && !raw.empty())
    throw InputError(directory,
                     "holds .vdb and .raw files; name the ones to read, for example " + directory + "/*.vdb");
  if (vdb.empty() && raw.empty()) throw InputError(directory, "is a directory without .vdb or .raw files");
  return vdb.empty() ? raw : vdb;
}

// A pattern with `####` or `%04d` for the time step; `*` and `?` have their usual meaning beside it.
class StepPattern {
 public:
  explicit StepPattern(const std::string& pattern) {
    for (size_t i = 0; i < pattern.size();) i = addToken(pattern, i);
  }

  bool hasPlace() const { return hasPlace_; }
  /// A glob that matches at least the files meant.
  const std::string& glob() const { return glob_; }
  /// The digits of the last place when `path` matches, else nothing.
  std::optional<std::string> digitsOf(const std::string& path) const {
    std::string digits;
    if (!matches(0, path, 0, digits)) return std::nullopt;
    return digits;
  }

 private:
  struct Token {
    enum Kind { literal, anyCharacter, anyRun, place } kind;
    char character = 0;
    size_t width = 0;
  };

  size_t addToken(const std::string& pattern, size_t i) {
    if (pattern[i] == '#') {
      const size_t end = std::min(pattern.find_first_not_of('#', i), pattern.size());
      addPlace(end - i);
      return end;
    }
    if (pattern[i] == '%') {
      size_t end = i + 1;
      while (end < pattern.size() && isDigit(pattern[end])) ++end;
      if (end < pattern.size() && pattern[end] == 'd' && end - i <= 3) {
        addPlace(end > i + 1 ? std::stoul(pattern.substr(i + 1, end - i - 1)) : 1);
        return end + 1;
      }
    }
    const char c = pattern[i];
    glob_ += c;
    tokens_.push_back({c == '*' ? Token::anyRun : c == '?' ? Token::anyCharacter : Token::literal, c});
    return i + 1;
  }

  void addPlace(size_t width) {
    hasPlace_ = true;
    glob_ += "[0-9]*";
    tokens_.push_back({Token::place, 0, std::max<size_t>(width, 1)});
  }

  bool matches(size_t t, const std::string& path, size_t at, std::string& digits) const {
    if (t == tokens_.size()) return at == path.size();
    const Token& token = tokens_[t];
    if (token.kind == Token::anyRun) {
      for (size_t end = at; !matches(t + 1, path, end, digits); ++end)
        if (end >= path.size() || path[end] == '/') return false;
      return true;
    }
    if (token.kind == Token::place) return matchesPlace(t, path, at, digits);
    const bool fits =
        at < path.size() && (token.kind == Token::literal ? path[at] == token.character : path[at] != '/');
    return fits && matches(t + 1, path, at + 1, digits);
  }

  // At least the width's digits; more only for numbers that do not fit into it.
  bool matchesPlace(size_t t, const std::string& path, size_t at, std::string& digits) const {
    const size_t width = tokens_[t].width;
    for (size_t n = 0; at + n < path.size() && isDigit(path[at + n]);) {
      ++n;
      if (n < width || (n > width && path[at] == '0') || !matches(t + 1, path, at + n, digits)) continue;
      if (digits.empty()) digits = path.substr(at, n);  // places to the right were filled first
      return true;
    }
    return false;
  }

  std::vector<Token> tokens_;
  std::string glob_;
  bool hasPlace_ = false;
};

std::vector<Candidate> filesOfPattern(const std::string& input, const StepPattern& pattern) {
  std::vector<Candidate> files;
  for (const std::string& path : expandGlob(pattern.glob()))
    if (const auto digits = pattern.digitsOf(path); digits && fs::is_regular_file(path))
      files.push_back({path, numberOf(*digits)});
  if (files.empty()) throw InputError(input, "no file matches this pattern");
  return files;
}

std::vector<Candidate> filesOfGlob(const std::string& input) {
  std::vector<Candidate> files;
  for (const std::string& path : expandGlob(input))
    if (fs::is_regular_file(path)) files.push_back({path, stepOfName(path)});
  if (files.empty()) throw InputError(input, "no file matches this pattern");
  return files;
}

// A name that exists is taken as it is, even when it looks like a pattern.
std::vector<Candidate> filesOf(const std::string& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (fs::is_directory(status)) return filesOfDirectory(input);
  if (fs::exists(status)) {
    if (!fs::is_regular_file(status)) throw InputError(input, "is not a regular file");
    return {{input, stepOfName(input)}};
  }
  const StepPattern pattern(input);
  if (pattern.hasPlace()) return filesOfPattern(input, pattern);
  if (input.find_first_of("*?[") != std::string::npos) return filesOfGlob(input);
  throw InputError(input, "no such file or directory");
}

// Do all files state a step, each a different one?
bool stepsAreUsable(const std::vector<Candidate>& files) {
  std::set<int64_t> seen;
  return std::all_of(files.begin(), files.end(),
                     [&](const Candidate& f) { return f.step && seen.insert(*f.step).second; });
}

}  // namespace

std::vector<StepFile> findStepFiles(const std::vector<std::string>& inputs) {
  std::vector<Candidate> files;
  for (const std::string& input : inputs) {
    try {
      const std::vector<Candidate> more = filesOf(input);
      files.insert(files.end(), more.begin(), more.end());
    } catch (const fs::filesystem_error& e) {
      throw InputError(input, "cannot be read: " + e.code().message());
    }
  }
  if (files.empty()) throw InputError("INPUT", "no files given");
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return naturalLess(a.path, b.path); });
  files.erase(
      std::unique(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path == b.path; }),
      files.end());
  const bool usable = stepsAreUsable(files);
  std::vector<StepFile> steps;
  for (size_t i = 0; i < files.size(); ++i)
    steps.push_back({files[i].path, usable ? *files[i].step : int64_t(i)});
  std::sort(steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.step < b.step; });
  return steps;
}

}  // namespace kairos
