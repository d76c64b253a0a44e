// An archive as the fuzzer made it, but of the right length and with the right checksums.
#pragma once
#include "fuzz/targets.hpp"
#include "output/damage.hpp"

namespace clrad::fuzz {

inline std::string write_archive(const std::string& name, Bytes bytes) {
  std::string archive(bytes.begin(), bytes.end());
  if (archive.size() >= test::header_bytes) archive = test::with_right_checksums(std::move(archive));
  return write_case(name, {reinterpret_cast<const std::uint8_t*>(archive.data()), archive.size()});
}

}  // namespace clrad::fuzz
