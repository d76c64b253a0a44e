// One libFuzzer program for each function of targets.hpp, which CLRAD_FUZZ_TARGET names.
#include "fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  clrad::fuzz::CLRAD_FUZZ_TARGET({data, size});
  return 0;
}
