#include <fmt/format.h>

#include "clrad/error.hpp"
#include "clrad/visibility.hpp"
#include "visibility/chop.hpp"
#include "visibility/serial.hpp"

namespace clrad {

std::vector<std::string> engine_names() {
  return {"serial", "chop"};
}

std::unique_ptr<VisibilityEngine> make_engine(const std::string& name, Device& device,
                                              std::span<const OccluderTriangle> triangles) {
  if (name == "serial") return make_serial(device, triangles);
  if (name == "chop") return make_chop(device, triangles);
  throw UsageError(fmt::format("there is no visibility engine \"{}\"; choose one of: {}", name,
                               fmt::join(engine_names(), ", ")));
}

}  // namespace clrad
