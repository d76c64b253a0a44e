/// The scene `hall`: a hall of columns with plinth, swelling shaft and capital.
#pragma once
#include "model.hpp"

namespace make_scene {

/// A column has 18 triangles a side and 24.
Model hall(int columns, int sides);

}  // namespace make_scene
