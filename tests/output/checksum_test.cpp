#include "output/checksum.hpp"

#include <gtest/gtest.h>

#include <string>

namespace clrad {
namespace {

std::uint64_t checksum(const std::string& text, std::size_t split = 0) {
  Checksum sum;
  sum.add(text.data(), split);
  sum.add(text.data() + split, text.size() - split);
  return sum.value();
}

// The check value that catalogues of CRCs give for CRC-64/XZ.
TEST(Checksum, IsCrc64Xz) {
  EXPECT_EQ(checksum("123456789"), 0x995DC9BBDF1939FAu);
  EXPECT_EQ(checksum(""), 0u);
}

TEST(Checksum, SameWhateverThePieces) {
  std::string text;
  for (int i = 0; i < 67; ++i) text.push_back(char(i * 37));
  // Bit by bit, from the definition.
  std::uint64_t crc = ~std::uint64_t(0);
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xC96C5795D7870F42u : crc >> 1;
  }
  for (std::size_t split = 0; split <= text.size(); ++split) EXPECT_EQ(checksum(text, split), ~crc) << split;
}

}  // namespace
}  // namespace clrad
