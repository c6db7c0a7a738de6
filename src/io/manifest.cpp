#include "io/manifest.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "io/file_bytes.h"

namespace kairos {
namespace {

using nlohmann::json;

constexpr int kFormat = 1;
const std::string kChecksumKey = "\n\"checksum\": ";

json toJson(const Vec3d& v) {
  return {v.x, v.y, v.z};
}
json toJson(const Vec3i& v) {
  return {v.x, v.y, v.z};
}

// File and grid names of a simulation need not be UTF-8; in a manifest, what is not is replaced.
std::string dumped(const json& v) {
  return v.dump(-1, ' ', false, json::error_handler_t::replace);
}

json fileJson(uint64_t bytes, uint64_t hash) {
  return {{"bytes", bytes}, {"xxh64", hexOf(hash)}};
}

json toJson(const SequenceStep& s) {
  json entry = {{"step", s.step},
                {"changed", s.changedVoxels},
                {"active", s.activeVoxels},
                {"state", hexOf(s.stateChecksum)},
                {"range", {s.range.lo, s.range.hi}},
                {"non_finite", s.nonFinite}};
  if (s.key) entry["key"] = fileJson(s.keyBytes, s.keyHash);
  if (s.differential) entry["differential"] = fileJson(s.differentialBytes, s.differentialHash);
  return entry;
}

// Reads entries of a JSON object; every failure names the file and the entry.
class Entry {
 public:
  Entry(const std::string& path, const json& object, std::string name)
      : path_(path), object_(object), name_(std::move(name)) {
    if (!object.is_object()) fail("expected an object");
  }

  template <class T>
  T get(const char* key) const {
    const auto it = object_.find(key);
    if (it == object_.end()) fail(std::string("has no \"") + key + "\"");
    return convert<T>(*it, key);
  }
  template <class T>
  std::vector<T> list(const char* key, size_t count) const {
    const auto it = object_.find(key);
    if (it == object_.end() || !it->is_array() || (count > 0 && it->size() != count))
      fail(std::string("\"") + key + "\": expected an array" + (count ? " of " + std::to_string(count) : ""));
    std::vector<T> values;
    for (const json& v : *it) values.push_back(convert<T>(v, key));
    return values;
  }
  Entry object(const char* key) const {
    const auto it = object_.find(key);
    if (it == object_.end()) fail(std::string("has no \"") + key + "\"");
    return {path_, *it, name_ + key + ": "};
  }
  bool has(const char* key) const { return object_.contains(key); }
  uint64_t hex(const char* key) const {
    try {
      return valueOfHex(get<std::string>(key));
    } catch (const std::invalid_argument& e) {
      fail(std::string("\"") + key + "\": " + e.what());
    }
  }
  Vec3d vec3d(const char* key) const {
    const auto v = list<double>(key, 3);
    return {v[0], v[1], v[2]};
  }
  Vec3i vec3i(const char* key) const {
    const auto v = list<int64_t>(key, 3);
    constexpr int64_t kFarthest = int64_t(1) << 30;
    for (int64_t c : v)
      if (c < -kFarthest || c > kFarthest)
        fail(std::string("\"") + key + "\": expected voxel indices within +-2^30");
    return {int32_t(v[0]), int32_t(v[1]), int32_t(v[2])};
  }
  [[noreturn]] void fail(const std::string& problem) const { throw InputError(path_, name_ + problem); }

 private:
  template <class T>
  T convert(const json& v, const char* key) const {
    bool fits;
    if constexpr (std::is_same_v<T, bool>)
      fits = v.is_boolean();
    else if constexpr (std::is_same_v<T, std::string>)
      fits = v.is_string();
    else if constexpr (std::is_same_v<T, json>)
      fits = true;
    else if constexpr (std::is_unsigned_v<T>)
      fits = v.is_number_unsigned();
    else if constexpr (std::is_integral_v<T>)
      fits = v.is_number_integer();
    else
      fits = v.is_number();
    if (!fits)
      fail(std::string("\"") + key +
           "\" has the wrong type: " + v.dump(-1, ' ', true, json::error_handler_t::replace).substr(0, 60));
    return v.get<T>();
  }

  const std::string& path_;
  const json& object_;
  std::string name_;
};

ElementType elementTypeNamed(const Entry& root) {
  const auto type = root.get<std::string>("element_type");
  for (ElementType t : {ElementType::u8, ElementType::u16, ElementType::f32})
    if (type == name(t)) return t;
  root.fail("\"element_type\" is \"" + type.substr(0, 20) + "\", expected u8, u16 or f32");
}

Lattice latticeFrom(const Entry& root) {
  Lattice lattice;
  lattice.type = elementTypeNamed(root);
  lattice.background = root.get<double>("background");
  lattice.dense = root.get<bool>("dense");
  const Entry transform = root.object("world_from_index");
  lattice.worldFromIndex = {{transform.vec3d("x"), transform.vec3d("y"), transform.vec3d("z")},
                            transform.vec3d("origin")};
  const double volume = lattice.worldFromIndex.determinant();
  if (!std::isfinite(volume) || volume == 0) root.fail("\"world_from_index\" is singular");
  const Entry domain = root.object("domain");
  lattice.domain = {domain.vec3i("lo"), domain.vec3i("hi")};
  return lattice;
}

SequenceStep stepFrom(const Entry& entry) {
  SequenceStep s;
  s.step = entry.get<int64_t>("step");
  s.changedVoxels = entry.get<uint64_t>("changed");
  s.activeVoxels = entry.get<uint64_t>("active");
  s.stateChecksum = entry.hex("state");
  const auto range = entry.list<double>("range", 2);
  s.range = {float(range[0]), float(range[1])};
  s.nonFinite = entry.get<int64_t>("non_finite");
  s.key = entry.has("key");
  s.differential = entry.has("differential");
  if (s.key) {
    s.keyBytes = entry.object("key").get<uint64_t>("bytes");
    s.keyHash = entry.object("key").hex("xxh64");
  }
  if (s.differential) {
    s.differentialBytes = entry.object("differential").get<uint64_t>("bytes");
    s.differentialHash = entry.object("differential").hex("xxh64");
  }
  s.bytes = s.keyBytes + s.differentialBytes;
  return s;
}

void checkSteps(const SequenceManifest& m, const Entry& root) {
  if (m.steps.size() > m.inputs.size()) root.fail("\"steps\" has more entries than \"inputs\"");
  for (size_t i = 0; i < m.steps.size(); ++i) {
    const std::string where = "steps[" + std::to_string(i) + "]: ";
    if (i == 0 && !m.steps[i].key) root.fail(where + "the first step has no key frame");
    if (i > 0 && !m.steps[i].differential) root.fail(where + "has no differential file");
    if (i > 0 && m.steps[i].step <= m.steps[i - 1].step) root.fail(where + "the time steps do not increase");
  }
}

// The last entry is the XXH64 of all text before it.
void verifyChecksum(const std::string& path, const std::string& text) {
  const size_t at = text.rfind(kChecksumKey);
  if (at == std::string::npos)
    throw InputError(path, "is no complete sequence.json: it has no \"checksum\" at its end");
  const std::string expected = "\"" + hexOf(xxh64(std::span(text.data(), at))) + "\"\n}\n";
  if (text.compare(at + kChecksumKey.size(), std::string::npos, expected) != 0)
    throw InputError(path, "was damaged or edited: its checksum does not match");
}

SequenceManifest manifestFrom(const std::string& path, const json& document) {
  const Entry root(path, document, "");
  if (root.get<int64_t>("kairos_sequence") != kFormat)
    root.fail("\"kairos_sequence\" is " + std::to_string(root.get<int64_t>("kairos_sequence")) +
              ", expected " + std::to_string(kFormat));
  SequenceManifest m;
  m.lattice = latticeFrom(root);
  m.gridName = root.get<std::string>("grid");
  m.tolerance = root.get<double>("tolerance");
  m.keyEvery = int(root.get<int32_t>("key_every"));
  m.inputs = root.list<std::string>("inputs", 0);
  m.complete = root.get<bool>("complete");
  const auto steps = root.list<json>("steps", 0);
  for (size_t i = 0; i < steps.size(); ++i)
    m.steps.push_back(stepFrom(Entry(path, steps[i], "steps[" + std::to_string(i) + "]: ")));
  checkSteps(m, root);
  return m;
}

std::string numbered(const std::string& directory, const char* kind, int64_t step) {
  char name[48];
  std::snprintf(name, sizeof name, "%s.%04lld.vdb", kind, static_cast<long long>(step));
  return (std::filesystem::path(directory) / name).string();
}

}  // namespace

std::string manifestPath(const std::string& directory) {
  return (std::filesystem::path(directory) / "sequence.json").string();
}
std::string gridNameInFiles(const SequenceManifest& m) {
  return m.gridName.empty() ? "density" : json::parse(dumped(m.gridName)).get<std::string>();
}
std::string keyPathOf(const std::string& directory, int64_t step) {
  return numbered(directory, "key", step);
}
std::string differentialPathOf(const std::string& directory, int64_t step) {
  return numbered(directory, "diff", step);
}

std::string manifestText(const SequenceManifest& m) {
  const Affine& a = m.lattice.worldFromIndex;
  const std::pair<const char*, json> entries[] = {
      {"kairos_sequence", kFormat},
      {"complete", m.complete},
      {"grid", m.gridName},
      {"element_type", name(m.lattice.type)},
      {"background", m.lattice.background},
      {"dense", m.lattice.dense},
      {"world_from_index",
       {{"x", toJson(a.column[0])},
        {"y", toJson(a.column[1])},
        {"z", toJson(a.column[2])},
        {"origin", toJson(a.translation)}}},
      {"domain", {{"lo", toJson(m.lattice.domain.lo)}, {"hi", toJson(m.lattice.domain.hi)}}},
      {"tolerance", m.tolerance},
      {"key_every", m.keyEvery},
      {"inputs", m.inputs},
  };
  std::string text = "{\n";
  for (const auto& [key, value] : entries) text += "\"" + std::string(key) + "\": " + dumped(value) + ",\n";
  text += "\"steps\": [";
  for (size_t i = 0; i < m.steps.size(); ++i) text += (i ? ",\n  " : "\n  ") + dumped(toJson(m.steps[i]));
  text += "\n],";
  const std::string checksum = hexOf(xxh64(text));
  text.append(kChecksumKey).append("\"").append(checksum).append("\"\n}\n");
  return text;
}

std::string manifestDifference(const SequenceManifest& found, const SequenceManifest& wanted) {
  const auto differ = [](const char* what, const json& a, const json& b) {
    return std::string(what) + " " + dumped(a) + " instead of " + dumped(b);
  };
  const Lattice &a = found.lattice, &b = wanted.lattice;
  if (dumped(found.gridName) != dumped(wanted.gridName))
    return differ("grid", found.gridName, wanted.gridName);
  if (a.type != b.type) return differ("element type", name(a.type), name(b.type));
  if (a.background != b.background) return differ("background", a.background, b.background);
  if (a.dense != b.dense) return differ("dense", a.dense, b.dense);
  if (!(a.worldFromIndex == b.worldFromIndex)) return "another transform";
  if (!(a.domain == b.domain))
    return differ("domain", {toJson(a.domain.lo), toJson(a.domain.hi)},
                  {toJson(b.domain.lo), toJson(b.domain.hi)});
  if (found.tolerance != wanted.tolerance) return differ("tolerance", found.tolerance, wanted.tolerance);
  if (found.keyEvery != wanted.keyEvery) return differ("key_every", found.keyEvery, wanted.keyEvery);
  if (dumped(found.inputs) != dumped(wanted.inputs))
    return found.inputs.size() != wanted.inputs.size()
               ? differ("number of inputs", found.inputs.size(), wanted.inputs.size())
               : std::string("other input files");
  return {};
}

ValueRange SequenceManifest::range() const {
  if (steps.empty()) return {float(lattice.background), float(lattice.background)};
  ValueRange all = steps.front().range;
  for (const SequenceStep& s : steps) all = {std::min(all.lo, s.range.lo), std::max(all.hi, s.range.hi)};
  return all;
}

SequenceManifest readManifest(const std::string& directory) {
  const std::string path = manifestPath(directory);
  const std::vector<char> bytes = InputFile(path).readAll();
  const std::string text(bytes.begin(), bytes.end());
  verifyChecksum(path, text);
  try {
    return manifestFrom(path, json::parse(text));
  } catch (const json::exception& e) {
    throw InputError(path, std::string("is not valid JSON: ") + e.what());
  }
}

bool isSequence(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(manifestPath(path), error);
}

}  // namespace kairos
