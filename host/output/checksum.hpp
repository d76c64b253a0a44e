// CRC-64/XZ, the checksum of clrad's own files.
#pragma once
#include <cstddef>
#include <cstdint>

namespace clrad {

/// Reflected CRC with the polynomial of ECMA-182 (0x42F0E1EBA9EA3693). Every change inside a stretch of 64 bits is noticed
/// for certain, any other but for one in 2^64.
class Checksum {
 public:
  void add(const void* data, std::size_t bytes);
  std::uint64_t value() const { return ~state_; }

 private:
  std::uint64_t state_ = ~std::uint64_t(0);
};

}  // namespace clrad
