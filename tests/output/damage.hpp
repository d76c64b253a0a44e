// Archives that are broken on purpose.
#pragma once
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "output/checksum.hpp"

namespace clrad::test {

constexpr std::size_t header_bytes = 72;

/// In place, without the care of a real write: it is called thousands of times.
inline void overwrite(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc).write(bytes.data(), std::streamsize(bytes.size()));
}

/// The archive with its length and both checksums made to fit (their places are in host/output/archive.hpp).
inline std::string with_right_checksums(std::string archive) {
  const auto put = [&](std::size_t at, std::uint64_t value) { std::memcpy(archive.data() + at, &value, 8); };
  const auto checksum = [&](std::size_t first, std::size_t bytes) {
    Checksum sum;
    sum.add(archive.data() + first, bytes);
    return sum.value();
  };
  put(48, archive.size());
  put(56, checksum(header_bytes, archive.size() - header_bytes));
  put(64, checksum(0, 64));
  return archive;
}

}  // namespace clrad::test
