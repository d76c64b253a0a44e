// Near patches light a vertex by their elements.
#pragma once
#include "solve/state.hpp"

namespace clrad {

class NearBalance;

/// near[band][vertex]: what irradiance at every vertex from `first` on lacks of what patches closer than two of their sides bring: their
/// average becomes the average of their pieces (elements, at most 64 a patch) as the vertex sees them, each piece varying as
/// its corners do. 0 before `first`, and everywhere with more than 16 bands. `balance`, where there is one, is told of each patch.
/// Columns that are not kept are traced again where they are near.
RealArray near_field(SolveState& state, const Solution& solution, std::uint32_t first = 0,
                     NearBalance* balance = nullptr);

/// Low and high corner of the box around each patch [frame units], [patch][6], and how near to it receivers have its near field, [patch].
std::vector<double> patch_boxes(const Mesh& mesh);
std::vector<double> near_field_reaches(const Mesh& mesh);

/// Adds that to the irradiance of the vertices, and what other surfaces get instead (near_balance.hpp). Patch averages, energy and
/// convergence stay as they are.
void gather_near_field(SolveState& state, const Solution& solution);

}  // namespace clrad
