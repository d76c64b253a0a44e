#include "output/checksum.hpp"

#include <array>

namespace clrad {
namespace {

// Eight bytes at a time ("slicing"): row k holds the effect of a byte that k more bytes follow.
using Tables = std::array<std::array<std::uint64_t, 256>, 8>;

Tables make_tables() {
  constexpr std::uint64_t reflected_polynomial = 0xC96C5795D7870F42u;
  Tables tables{};
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    std::uint64_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? reflected_polynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint64_t crc = tables[k - 1][byte];
      tables[k][byte] = crc >> 8 ^ tables[0][crc & 0xff];
    }
  return tables;
}

}  // namespace

void Checksum::add(const void* data, std::size_t bytes) {
  static const Tables tables = make_tables();
  const unsigned char* at = static_cast<const unsigned char*>(data);
  std::uint64_t crc = state_;
  for (; bytes >= 8; bytes -= 8, at += 8) {
    for (int k = 0; k < 8; ++k) crc ^= std::uint64_t(at[k]) << (8 * k);
    std::uint64_t next = 0;
    for (std::size_t k = 0; k < 8; ++k) next ^= tables[7 - k][crc >> (8 * k) & 0xff];
    crc = next;
  }
  for (; bytes > 0; --bytes, ++at) crc = crc >> 8 ^ tables[0][(crc ^ *at) & 0xff];
  state_ = crc;
}

}  // namespace clrad
