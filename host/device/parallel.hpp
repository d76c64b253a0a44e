// Loops of the host over many cores, where work is not the device's.
#pragma once
#include <algorithm>
#include <cstddef>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

#include "clrad/device.hpp"

namespace clrad {

/// Cores that the host may use beside the device: those the device was told to use, else all of the machine.
inline unsigned host_cores(const Device& device) {
  const unsigned all = std::max(1u, std::thread::hardware_concurrency());
  return device.options().cores ? std::min(device.options().cores, all) : all;
}

/// Calls work(begin, end, part) for `parts` ranges that together are [0, count), each on a thread of its own. An exception of the
/// first range that has one is thrown again when all have ended. At least one part.
template <class Work>
void in_parallel(std::size_t count, unsigned parts, Work work) {
  std::vector<std::exception_ptr> failed(parts);
  std::vector<std::thread> threads;
  const auto run = [&](unsigned part) {
    try {
      work(count * part / parts, count * (part + 1) / parts, part);
    } catch (...) {
      failed[part] = std::current_exception();
    }
  };
  for (unsigned part = 1; part < parts; ++part) {
    try {
      threads.emplace_back(run, part);
    } catch (const std::system_error&) {  // no more threads to be had
      run(part);
    }
  }
  run(0);
  for (std::thread& t : threads) t.join();
  for (const std::exception_ptr& e : failed)
    if (e) std::rethrow_exception(e);
}

}  // namespace clrad
