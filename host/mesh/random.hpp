// Random numbers by hand: the distributions of the standard library differ from one to the next.
#pragma once
#include <cstdint>
#include <random>

namespace clrad {

/// The same numbers from the same seed on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}
  double unit() { return double(bits_() >> 11) * 0x1p-53; }  ///< in [0, 1)

 private:
  std::mt19937_64 bits_;
};

}  // namespace clrad
