#include "solve/order.hpp"

#include <algorithm>

#include "clrad/primitives.hpp"

namespace clrad {

Array<std::uint32_t> in_order(Device& device, const PointArray& receivers) {
  const auto stage = device.stage("put receivers in order");
  const auto count = std::uint32_t(receivers.size());
  Array<std::uint32_t> keys(device, std::max(count, 1u), "Morton codes"),
      order(device, std::max(count, 1u), "order of receivers");
  device.run("solve/order.cl", "order_keys", count, receivers, count, keys, order);
  radix_sort(device, keys.buffer(), order.buffer(), count, 30);
  return order;
}

}  // namespace clrad
