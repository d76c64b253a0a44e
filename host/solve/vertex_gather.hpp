// Light gathered anew at vertices and in the middles of edges, for sensors that see it (host/solve/sensor.cpp).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "solve/sensor.hpp"

namespace clrad {

/// Rays as from sensors (Way), fewer of them, from the vertices and from the middles of edges: what comes to a sensor by one surface is then off by what
/// the mesh says of light after two more, and no longer by what the averages of patches hide of the first; and next to the edges of
/// walls, where this falls steeply, it is interpolated by parabolas. Where sensors see most the rays are more: one next to a wall may see
/// little but two vertices. Where patches are so many that each vertex would hardly get a ray the mesh shows that itself.
/// Returns the square of the error that all this leaves at sensors, [sensor * bands + band]; nothing where light is not gathered anew.
std::vector<double> gather_at_vertices(Device& device, const Solution& solution, Surroundings& around,
                                       VisibilityEngine& engine, Way way, std::span<const Point> sensors,
                                       const Glass* glass, Lights* lights, const LampLight& lamps);

/// A number in proportion to the rays that this sends from the vertices of a mesh of that size, of which a share is `uncovered`, for `rays`
/// from each of the sensors: two to four times as many. 0: light is not gathered anew there.
double rays_at_vertices(const MeshSize& mesh, double uncovered, std::uint64_t sensors, std::uint32_t rays);

/// What gathering at sensors takes, in rays of a sensor: those, the vertices', which are cheaper, a form factor for each of all these places
/// and each patch, and launches. From 45 solves of the reference's rooms: within a fifth but for two.
double gather_work(const MeshSize& mesh, double uncovered, std::uint64_t sensors, std::uint32_t rays);

/// gather_bytes() of the vertices.
double vertex_gather_bytes(const Device& device, const MeshSize& mesh, double uncovered, double bands,
                           std::uint64_t sensors, std::uint32_t rays);

}  // namespace clrad
