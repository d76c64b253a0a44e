/// The scene `office`: desks with chairs, screens, books and lamps.
#pragma once
#include "model.hpp"

namespace make_scene {

/// About 500 triangles a desk.
Model office(int desks);

}  // namespace make_scene
