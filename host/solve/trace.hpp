// Columns from nothing: form factor x visible fraction of a patch at the vertices.
#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "solve/state.hpp"

namespace clrad {

/// A column to trace, [colour][vertex]; receives 0 where nothing arrives.
struct ColumnTask {
  std::uint32_t patch = 0;
  RealArray* column = nullptr;
};

/// Drops some more of the flags of vertices that face the shooter, by vertex - first.
using DropFlags = std::function<void(Array<std::uint32_t>&)>;

/// Traces columns at the vertices from `first` on; entries before stay as they are. Where shafts or `serial`
/// ask for samples, only twice does the host wait for an answer of the device, however many columns there are: so several of few vertices
/// each are traced together. Returns the rays it took.
std::uint64_t trace_columns(SolveState& state, std::span<const ColumnTask> tasks, std::uint32_t first,
                            const DropFlags& also = nullptr);

/// How many columns at the vertices from `first` on should be traced together: as many as fit a small part of the memory.
std::uint32_t columns_at_once(const SolveState& state, std::uint32_t first);

}  // namespace clrad
