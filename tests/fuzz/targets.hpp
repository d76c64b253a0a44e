// What the fuzzers feed: each takes the bytes of a file as a user could hand it in and runs the program's own reader over
// it. The only ways out are success, with a result that can be used, and an InputError or UsageError; anything else is a
// finding. fuzzer.cpp makes a libFuzzer program of each, seeds_test.cpp runs all of them over the committed seeds.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace clrad::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// An OBJ file; where a line `#### a.mtl` follows, what comes after it stands beside it as a.mtl.
void obj(Bytes bytes);
/// A GLB file by its magic number, else glTF.
void gltf(Bytes bytes);
/// A file of sensors.
void sensors(Bytes bytes);
/// Archives, with length and checksums made to fit, so that what they guard is reached.
void checkpoint(Bytes bytes);
void solution(Bytes bytes);
/// Words of a command line, one a line.
void options(Bytes bytes);

/// What must not happen; not derived from clrad::Error.
struct Finding : std::logic_error {
  using std::logic_error::logic_error;
};
inline void require(bool holds, const std::string& what) {
  if (!holds) throw Finding(what);
}
/// Messages are one line, and name the file.
void require_message(const std::string& message, const std::string& path);

/// A file of this process's own, in memory where the system has such a folder.
std::string write_case(const std::string& name, Bytes bytes);
std::string case_path(const std::string& name);

}  // namespace clrad::fuzz
