/// Errors that clrad throws. Each says what happened, where, and what to do; the command line maps the kinds
/// to its exit codes.
#pragma once
#include <stdexcept>
#include <string>

namespace clrad {

/// Base of all of clrad's errors.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The program or the device failed: no platform, a kernel that does not build, too little memory. Exit
/// code 1.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// Memory ran out: the budget of --memory, or the device's own.
class MemoryError : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// An option that does not exist, is out of range or contradicts another. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Input that cannot be used; what() begins with `file:line:` or `file: node N, primitive M:`. Exit code 3.
class InputError : public Error {
 public:
  using Error::Error;
};

}  // namespace clrad
