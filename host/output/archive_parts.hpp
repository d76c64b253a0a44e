// Scene and mesh as sections of an archive, for every kind of archive that holds them.
#pragma once
#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"
#include "output/archive.hpp"

namespace clrad {

void add_scene(ArchiveWriter& archive, const Scene& scene);
void add_mesh(ArchiveWriter& archive, const Mesh& mesh);

/// As written, to the bit. Throw InputError naming the file when sections are missing, or when an index points outside
/// what it indexes: what comes back can be used without further checks.
Scene read_scene(ArchiveReader& archive);
Mesh read_mesh(ArchiveReader& archive, const Scene& scene);

}  // namespace clrad
