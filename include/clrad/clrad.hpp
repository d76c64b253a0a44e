/// All of clrad's public interface.
#pragma once
#include "clrad/device.hpp"
#include "clrad/error.hpp"
#include "clrad/frame.hpp"
#include "clrad/mesh.hpp"
#include "clrad/options.hpp"
#include "clrad/output.hpp"
#include "clrad/primitives.hpp"
#include "clrad/scene.hpp"
#include "clrad/solution.hpp"
#include "clrad/solver.hpp"
#include "clrad/view_factors.hpp"
#include "clrad/visibility.hpp"
