#include "visibility/bundle.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace clrad {
namespace {

constexpr const char* bundle_kernels = "visibility/bundle.cl";

const char* cut_name(std::uint32_t axis) {
  constexpr const char* names[] = {"chop rays along x", "chop rays along y", "chop rays along z"};
  return names[axis];
}

}  // namespace

BundleTracer::BundleTracer(Device& device, const Occluders& occluders, const Grid& grid,
                           const Array<float>& packets, const Array<std::uint32_t>& packet_planes,
                           std::uint32_t slab)
    : device_(device),
      occluders_(occluders),
      grid_(grid),
      packets_(packets),
      packet_planes_(packet_planes),
      slab_(slab) {
  for (std::uint32_t a = 0; a < 3; ++a)
    if (grid_.cells[a] > 1) axes_.push_back(a);
}

void BundleTracer::release() {
  scratch_ = {};
  rays_held_ = 0;
}

void BundleTracer::need_pieces(Pieces& p, std::uint32_t count, bool last) {
  need(device_, p.bundle, count, "ray pieces: bundles");
  need(device_, p.cell, count, "ray pieces: cells");
  need(device_, p.low, count, "ray pieces: first cells");
  need(device_, p.counts, count, "ray pieces: counts");
  need(device_, p.t, last ? 1 : std::uint64_t(count) * 2 * width(), "ray pieces: begin and end");
}

void BundleTracer::upload_ends(const Segments& s, const Batch& b) {
  const auto& active = s.active ? s.active->buffer() : s.origins->buffer();
  const cl_uint chosen = s.active != nullptr;
  need(device_, scratch_.from, b.origins * 8ull, "ray origins");
  device_.run("visibility/chop.cl", "chop_ends", b.origins, b.origins, b.first_origin, *s.origins, active,
              chosen, scratch_.from);
  if (pairs_) {
    need(device_, scratch_.to, b.origins * 8ull, "ray targets");
    device_.run("visibility/chop.cl", "chop_ends", b.origins, b.origins, b.first_origin, *s.targets, active,
                chosen, scratch_.to);
  } else {
    const std::uint32_t lanes = (b.run + width() - 1) / width() * width();
    need(device_, scratch_.to, lanes * 8ull, "ray targets");
    device_.run(bundle_kernels, "bundle_targets", lanes, lanes, b.run, b.first_sample, *s.targets,
                scratch_.to);
  }
}

void BundleTracer::occluded(const Segments& s, const Batch& b, Array<std::uint32_t>& masks,
                            Array<std::uint64_t>& sums) {
  run_ = b.run;
  pairs_ = s.samples == 0;
  const std::uint32_t bundles = b.origins * (pairs_ ? 1 : (b.run + width() - 1) / width());
  {
    const auto stage = device_.stage("clip rays to the grid");
    need(device_, scratch_.blocked, bundles, "blocked rays");
    need(device_, scratch_.windows, bundles, "cells of a wave");
    need(device_, scratch_.needs, bundles, "waves of rays");
    need(device_, scratch_.flags, slab_ ? bundles : 1, "ray flags");
    need(device_, scratch_.alive, slab_ ? bundles : 1, "rays alive");
    device_.fill_bytes(scratch_.blocked.buffer(), 0, bundles * 4ull);
    upload_ends(s, b);
  }
  std::uint32_t count = grid_.blocks == 0 ? 0 : bundles;
  for (std::uint32_t wave = 0; count > 0; ++wave) {
    if (wave > 0) {
      const auto stage = device_.stage("drop blocked rays");
      device_.run(bundle_kernels, "bundle_alive", bundles, bundles, wave, run_, pairs_, scratch_.needs,
                  scratch_.blocked, scratch_.flags);
      count = compact(device_, scratch_.flags.buffer(), bundles, scratch_.alive.buffer());
      if (counts_waves_ && count == 0) count_wave(wave, bundles);
      if (count == 0) break;
    }
    start_wave(count, wave);
    if (counts_waves_) count_wave(wave, bundles);
    const std::uint32_t pieces = cut(count);
    if (counts_waves_ && pieces > 0)
      for (const std::uint32_t lanes : scratch_.here.low.download(0, pieces))
        waves_[wave].pieces += std::uint64_t(std::popcount(lanes));
    test(pieces, sums);
    if (slab_ == 0) break;
  }
  {
    const auto stage = device_.stage("pack visibility masks");
    const std::uint32_t words = (b.run + 31) / 32;
    device_.run(bundle_kernels, "bundle_masks", b.origins * words, b.origins * words, b.first_origin,
                b.first_sample / 32, words, s.words_per_origin(), b.run, scratch_.blocked, masks);
  }
  rays_held_ = std::max(rays_held_, b.rays());
}

void BundleTracer::start_wave(std::uint32_t count, std::uint32_t wave) {
  const auto stage = device_.stage("clip rays to the grid");
  auto& p = scratch_.here;
  need_pieces(p, count, axes_.empty());
  device_.run(bundle_kernels, "bundle_wave", count, count, wave > 0 ? scratch_.alive : scratch_.blocked,
              cl_uint(wave > 0), wave, slab_, scratch_.from, scratch_.to, run_, pairs_, grid_.frame,
              grid_.first_block, axes_.empty() ? 3u : axes_[0], scratch_.blocked, scratch_.windows,
              scratch_.needs, p.bundle, p.cell, p.low, p.t, p.counts);
}

/// Cuts the bundles of scratch_.here along every axis that has cells; returns how many pieces there are then,
/// and leaves them in scratch_.here.
std::uint32_t BundleTracer::cut(std::uint32_t bundles) {
  std::uint32_t pieces = bundles;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const std::uint32_t axis = axes_[k], next = k + 1 < axes_.size() ? axes_[k + 1] : 3;
    const auto stage = device_.stage(cut_name(axis));
    auto &from = scratch_.here, &to = scratch_.there;
    allocate_into(device_, from.counts.buffer(), pieces, scratch_.cut, "ray pieces");
    pieces = scratch_.cut.total;
    need_pieces(to, pieces, next == 3);
    device_.run(bundle_kernels, "bundle_cut", pieces, pieces, axis, next, scratch_.cut.owner,
                scratch_.cut.rank, scratch_.from, scratch_.to, run_, pairs_, grid_.frame, grid_.first_block,
                scratch_.windows, from.bundle, from.cell, from.low, from.t, to.bundle, to.cell, to.low, to.t,
                to.counts);
    std::swap(from, to);
  }
  return pieces;
}

void BundleTracer::test(std::uint32_t pieces, Array<std::uint64_t>& sums) {
  auto& p = scratch_.here;
  {
    const auto stage = device_.stage("allocate candidates");
    allocate_into(device_, p.counts.buffer(), pieces, scratch_.pairs, "candidates");
    const std::uint32_t items = tally_items(device_);
    device_.run_local(bundle_kernels, "bundle_tally", items, tally_group(device_), items, pieces, p.cell,
                      p.low, grid_.frame, grid_.held, sums);
  }
  const auto stage = device_.stage("intersect rays with candidates");
  const std::uint32_t slots = scratch_.pairs.total;
  device_.run(bundle_kernels, "bundle_test", slots, slots, scratch_.pairs.owner, scratch_.pairs.rank,
              p.bundle, p.cell, p.low, grid_.frame, grid_.first_block, packets_, grid_.lanes, packet_planes_,
              occluders_.triangles, scratch_.from, scratch_.to, run_, pairs_, scratch_.blocked, sums,
              tally_items(device_));
}

/// The rays that wave `wave` is for, and those of them that an earlier one blocked; after start_wave, or instead
/// of it where all are blocked.
void BundleTracer::count_wave(std::uint32_t wave, std::uint32_t bundles) {
  const auto needs = scratch_.needs.download(0, bundles);
  const auto blocked = scratch_.blocked.download(0, bundles);
  const std::uint32_t groups = (run_ + width() - 1) / width();
  WaveWork work;
  for (std::uint32_t b = 0; b < bundles; ++b) {
    if (needs[b] <= wave) continue;
    work.rays += pairs_ ? 1 : std::min(run_ - b % groups * width(), width());
    work.blocked += std::uint64_t(std::popcount(blocked[b]));
  }
  if (work.rays == 0) return;
  if (waves_.size() <= wave) waves_.resize(wave + 1);
  waves_[wave].rays += work.rays;
  waves_[wave].blocked += work.blocked;
}

}  // namespace clrad
