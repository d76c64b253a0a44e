/// Visibility where nothing can stand between: what effects/occlusion.cpp proves of convex rooms.
#pragma once
#include <memory>

#include "clrad/visibility.hpp"

namespace clrad {

/// Every segment is free, and meets nothing.
std::unique_ptr<VisibilityEngine> make_open(Device& device);

}  // namespace clrad
