// Typed errors. Libraries throw them; only `main` catches. Every message says what was found, what was
// expected, and names the file, option or voxel concerned.
#pragma once

#include <stdexcept>
#include <string>

namespace kairos {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An option or argument outside its range: `--step 0: expected a number in [0.001, 1000]`.
class OptionError : public Error {
 public:
  OptionError(const std::string& option, const std::string& problem) : Error(option + ": " + problem) {}
};

/// A file that is missing, damaged, or not what it should be.
class InputError : public Error {
 public:
  InputError(const std::string& file, const std::string& problem) : Error(file + ": " + problem) {}
};

/// A file or directory that cannot be written.
class OutputError : public Error {
 public:
  OutputError(const std::string& file, const std::string& problem) : Error(file + ": " + problem) {}
};

/// Changed voxels that do not belong to the state they are applied to.
class StateError : public Error {
 public:
  using Error::Error;
};

/// The user asked to stop (Ctrl-C); what was finished stays.
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted") {}
};

}  // namespace kairos
