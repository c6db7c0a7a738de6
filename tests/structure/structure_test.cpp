// The architecture, read from the include lines: which folder may use which, and where each outside library
// may be seen.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace kairos {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

struct Include {
  std::string file;  // relative to src/
  int line;
  std::string header;  // as written, without its delimiters
  bool quoted;
};

using Includes = std::vector<Include>;

std::string firstComponent(const std::string& path) {
  return path.substr(0, path.find('/'));
}

void appendIncludes(std::istream& source, const std::string& file, Includes& includes) {
  std::string text;
  for (int line = 1; std::getline(source, text); ++line) {
    const auto hash = text.find_first_not_of(" \t");
    if (hash == std::string::npos || text[hash] != '#') continue;
    const auto word = text.find_first_not_of(" \t", hash + 1);
    if (word == std::string::npos || text.compare(word, 7, "include") != 0) continue;
    const auto open = text.find_first_of("<\"", word + 7);
    if (open == std::string::npos) continue;
    const bool quoted = text[open] == '"';
    const auto close = text.find(quoted ? '"' : '>', open + 1);
    includes.push_back({file, line, text.substr(open + 1, close - open - 1), quoted});
  }
}

std::vector<fs::path> sourceFiles(const fs::path& root) {
  static const std::set<std::string> kExtensions{".h", ".hpp", ".cpp", ".cc"};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    if (entry.is_regular_file() && kExtensions.count(entry.path().extension().string()))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

const fs::path& sourceRoot() {
  static const fs::path root = fs::path(KAIROS_SOURCE_DIR) / "src";
  return root;
}

const Includes& includesOfTheTree() {
  static const Includes includes = [] {
    Includes found;
    for (const fs::path& path : sourceFiles(sourceRoot())) {
      std::ifstream source(path);
      appendIncludes(source, path.lexically_relative(sourceRoot()).generic_string(), found);
    }
    return found;
  }();
  return includes;
}

std::string describe(const Include& include) {
  return "src/" + include.file + ":" + std::to_string(include.line) + " includes " + include.header;
}

// core <- volume <- raycast <- diff <- tcdvrm; core, volume <- io; core, volume <- lod; plot stands alone; app
// uses everything.
const std::map<std::string, std::set<std::string>>& allowedArrows() {
  static const std::map<std::string, std::set<std::string>> arrows{
      {"core", {}},
      {"volume", {"core"}},
      {"raycast", {"core", "volume"}},
      {"diff", {"core", "volume", "raycast"}},
      {"tcdvrm", {"core", "volume", "raycast", "diff"}},
      {"io", {"core", "volume"}},
      {"lod", {"core", "volume"}},
      {"plot", {}},
      {"app", {"core", "volume", "raycast", "diff", "tcdvrm", "io", "lod", "plot"}}};
  return arrows;
}

// Only quoted includes lead within the tree, and each names its header from src/ on.
std::vector<std::string> forbiddenArrows(const Includes& includes) {
  std::vector<std::string> violations;
  for (const Include& include : includes) {
    if (!include.quoted) continue;
    const std::string from = firstComponent(include.file), to = firstComponent(include.header);
    const auto rule = allowedArrows().find(from);
    const bool allowed = rule != allowedArrows().end() && (from == to || rule->second.count(to));
    if (!allowed) violations.push_back(describe(include));
  }
  return violations;
}

// Beginnings of an outside library's headers, and the folders that may include them.
struct OutsideLibrary {
  std::vector<std::string> prefixes;
  std::set<std::string> folders;
};

const std::vector<OutsideLibrary>& outsideLibraries() {
  static const std::vector<OutsideLibrary> libraries{
      {{"openvdb/", "nanovdb/", "OpenEXR/", "Imf", "Imath/", "OpenImageIO/", "png.h", "blosc.h", "zlib.h", "libdeflate.h",
        "hdf5", "H5"},
       {"io"}},
      {{"nlohmann/"}, {"io", "app"}},
      {{"CLI/"}, {"app"}},
      {{"epoxy/", "EGL/", "GL/", "GLES", "GLFW/"}, {"lod"}},
      // Libraries never print: they return, throw, or report progress.
      {{"iostream"}, {"app"}}};
  return libraries;
}

bool beginsWith(const std::string& text, const std::string& prefix) {
  return text.rfind(prefix, 0) == 0;
}

std::vector<std::string> misplacedLibraries(const Includes& includes) {
  std::vector<std::string> violations;
  for (const Include& include : includes)
    for (const OutsideLibrary& library : outsideLibraries()) {
      const bool names =
          std::any_of(library.prefixes.begin(), library.prefixes.end(),
                      [&](const std::string& prefix) { return beginsWith(include.header, prefix); });
      if (names && !library.folders.count(firstComponent(include.file)))
        violations.push_back(describe(include));
    }
  return violations;
}

TEST(Structure, FoldersUseOnlyTheFoldersBelowThem) {
  EXPECT_THAT(forbiddenArrows(includesOfTheTree()), IsEmpty());
}

TEST(Structure, OutsideLibrariesStayInTheFolderThatOwnsThem) {
  EXPECT_THAT(misplacedLibraries(includesOfTheTree()), IsEmpty());
}

TEST(Structure, EveryQuotedIncludeNamesAHeaderFromTheSourceRootOn) {
  std::vector<std::string> missing;
  for (const Include& include : includesOfTheTree())
    if (include.quoted && !fs::is_regular_file(sourceRoot() / include.header))
      missing.push_back(describe(include));
  EXPECT_THAT(missing, IsEmpty());
}

TEST(Structure, TheCheckSeesTheIncludesOfEveryFolder) {
  std::map<std::string, int> quoted;
  for (const Include& include : includesOfTheTree()) quoted[firstComponent(include.file)] += include.quoted;
  for (const auto& entry : fs::directory_iterator(sourceRoot()))
    if (entry.is_directory()) {
      EXPECT_GT(quoted[entry.path().filename().string()], 0) << "no include seen in " << entry.path();
    }
  for (const char* folder : {"core", "volume", "io", "raycast", "diff", "tcdvrm", "app"})
    EXPECT_GT(quoted[folder], 0) << "no include seen in src/" << folder;
}

TEST(Structure, TheCheckReportsPlantedViolations) {
  std::istringstream upwards(
      "#pragma once\n#include <vector>\n#  include \"diff/differential_renderer.h\"\n");
  std::istringstream format("#include <openvdb/openvdb.h>\n#include \"volume/field.h\"\n");
  std::istringstream unknownFolder("#include \"core/vec3.h\"\n");
  Includes planted;
  appendIncludes(upwards, "volume/planted.h", planted);
  appendIncludes(format, "raycast/planted.cpp", planted);
  appendIncludes(unknownFolder, "util/planted.cpp", planted);
  EXPECT_THAT(forbiddenArrows(planted),
              testing::ElementsAre("src/volume/planted.h:3 includes diff/differential_renderer.h",
                                   "src/util/planted.cpp:1 includes core/vec3.h"));
  EXPECT_THAT(misplacedLibraries(planted),
              testing::ElementsAre("src/raycast/planted.cpp:1 includes openvdb/openvdb.h"));
}

}  // namespace
}  // namespace kairos
