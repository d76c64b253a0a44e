#include "visibility/chop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "clrad/error.hpp"
#include "clrad/primitives.hpp"
#include "visibility/batch.hpp"
#include "visibility/bundle.hpp"
#include "visibility/grid.hpp"
#include "visibility/occluders.hpp"

namespace clrad {
namespace {

constexpr const char* chop_kernels = "visibility/chop.cl";

/// Cells in the first wave of grids that would take more than two (in others waves save less than their launches
/// cost), and rays in a batch: measured, see bench/visibility.cpp and bench/curves.cpp.
constexpr std::uint32_t usual_slab = 8;
constexpr std::uint32_t usual_batch = 1u << 17, usual_batch_on_gpu = 1u << 20;
constexpr std::uint32_t least_batch = 64;
/// Bytes a ray takes when nothing else is known: its ends and flags, four pieces, eight blocks of candidates.
constexpr std::uint64_t bytes_per_ray = 100 + 4 * 52 + 8 * 24;

/// The pieces of one stage of cutting.
struct Pieces {
  Array<std::uint32_t> ray, cell, counts;
  Array<float> t0, t1;
};

/// What the nearest hits of a batch need, kept from batch to batch.
struct Scratch {
  Array<float> ray_t, slot_t, least;
  Array<std::uint32_t> from, to, ray_triangle, doubt, doubtful, slot_triangle, positions, at;
  Pieces here, there;
  Allocation cut, pairs;
};

class Chop final : public ChopEngine {
 public:
  Chop(Device& device, std::span<const OccluderTriangle> triangles, const ChopOptions& options)
      : device_(device),
        options_(options),
        occluders_(device, triangles),
        grid_(device, occluders_, options.cells),
        packets_(device, std::max<std::uint64_t>(1, std::uint64_t(grid_.blocks) * grid_.width * 17),
                 "triangle packets"),
        packet_planes_(device, std::max<std::uint64_t>(1, std::uint64_t(grid_.blocks) * grid_.width),
                       "packet planes"),
        tally_items_(tally_items(device)),
        sums_(device, 3 * tally_items_, "visibility counts"),
        batch_sums_(device, 3 * tally_items_, "visibility counts of a batch"),
        bundles_(device, occluders_, grid_, packets_, packet_planes_, slab_of(grid_, options)) {
    const std::uint32_t lanes = grid_.blocks * grid_.width;
    device_.run(chop_kernels, "chop_packets", lanes, lanes, grid_.lanes, occluders_.triangles,
                occluders_.facets, packets_, packet_planes_);
    sums_.fill_zero();
    for (std::uint32_t a = 0; a < 3; ++a)
      if (grid_.cells[a] > 1) axes_.push_back(a);
  }

  std::string name() const override { return "chop"; }

  void occluded(const Segments& s, Array<std::uint32_t>& masks) override {
    check_segments(s);
    if (masks.size() < std::uint64_t(s.origin_count) * s.words_per_origin())
      throw UsageError("the array of visibility masks is smaller than the segments need");
    in_batches(s, [&](const Batch& b) { bundles_.occluded(s, b, masks, batch_sums_); });
  }

  void intersect_closest(const Segments& s, Array<std::uint32_t>& triangle, Array<float>& t) override {
    check_segments(s);
    if (triangle.size() < s.count() || t.size() < s.count())
      throw UsageError("the arrays of nearest hits are smaller than the segments need");
    in_batches(s, [&](const Batch& b) {
      trace(s, b);
      const auto stage = device_.stage("nearest hit of each ray");
      const std::uint64_t first =
          std::uint64_t(b.first_origin) * (s.samples ? s.samples : 1) + b.first_sample;
      device_.run(chop_kernels, "chop_results", b.rays(), b.rays(), first, scratch_.ray_t,
                  scratch_.ray_triangle, occluders_.input_index, triangle, t);
    });
  }

  VisibilityCounts counts() const override {
    VisibilityCounts c = counts_;
    const auto sums = sums_.download();
    for (std::uint32_t i = 0; i < tally_items_; ++i) {
      c.candidates += sums[i];
      c.exact += sums[tally_items_ + i];
      c.pieces += sums[2 * tally_items_ + i];
    }
    return c;
  }

  std::vector<RayPiece> pieces(const Segments& s) override {
    check_segments(s);
    std::vector<RayPiece> all;
    in_batches(s, [&](const Batch& b) {
      const std::uint64_t first =
          std::uint64_t(b.first_origin) * (s.samples ? s.samples : 1) + b.first_sample;
      trace(s, b, [&](std::uint32_t count) {
        const auto& p = scratch_.here;
        const auto ray = p.ray.download(0, count), cell = p.cell.download(0, count);
        const auto t0 = p.t0.download(0, count), t1 = p.t1.download(0, count);
        for (std::uint32_t i = 0; i < count; ++i)
          if (t0[i] <= t1[i])
            all.push_back({std::uint32_t(first + ray[i]),
                           {cell[i] & 1023u, cell[i] >> 10 & 1023u, cell[i] >> 20},
                           t0[i],
                           t1[i]});
      });
    });
    return all;
  }

  const Grid& grid() const override { return grid_; }
  void count_waves() override { bundles_.count_waves(); }
  const std::vector<WaveWork>& waves() const override { return bundles_.waves(); }

 private:
  Device& device_;
  ChopOptions options_;
  Occluders occluders_;
  Grid grid_;
  Array<float> packets_;
  Array<std::uint32_t> packet_planes_;
  std::uint32_t tally_items_;
  Array<std::uint64_t> sums_, batch_sums_;
  std::vector<std::uint32_t> axes_;  ///< that are cut: those with more than one cell
  BundleTracer bundles_;
  Scratch scratch_;
  VisibilityCounts counts_;
  std::uint32_t run_ = 1, pairs_ = 0;    ///< how ray numbers of the batch stand for its ends
  std::uint32_t smaller_ = 0xffffffffu;  ///< rays that fitted after a batch did not

  static std::uint32_t slab_of(const Grid& grid, const ChopOptions& options) {
    const std::uint32_t longest = std::max({grid.cells[0], grid.cells[1], grid.cells[2]});
    if (options.slab == 0xffffffffu) return 3 * usual_slab >= longest ? 0 : usual_slab;
    return options.slab >= longest ? 0 : options.slab;
  }

  template <class T>
  void need(Array<T>& array, std::uint64_t count, const char* what) {
    clrad::need(device_, array, count, what);
  }

  std::uint32_t batch_rays() const {
    // Ray numbers stay exact as floats.
    if (options_.rays_per_batch) return std::min({options_.rays_per_batch, smaller_, 1u << 24});
    const auto& ledger = *device_.ledger();
    const std::uint64_t left = ledger.limit - std::min(ledger.limit, ledger.held);
    const auto fits = std::uint32_t(std::min<std::uint64_t>(
        left / 2 / bytes_per_ray, device_.info().gpu ? usual_batch_on_gpu : usual_batch));
    // What the scratch of earlier batches holds is not `left`, but it is there.
    const auto held = rays_held();
    return std::max(std::min(std::max(fits, held), smaller_), least_batch);
  }

  std::uint32_t rays_held() const {
    return std::max(std::uint32_t(scratch_.ray_t.size() / 9 * 8), bundles_.rays_held());
  }

  /// Calls body for batch after batch; one that does not fit the memory is redone in halves.
  template <class Body>
  void in_batches(const Segments& s, Body body) {
    const std::uint32_t run = s.samples ? s.samples : 1;
    Batch b;
    while (b.first_origin < s.origin_count) {
      const std::uint32_t most = batch_rays();
      if (run <= most && b.first_sample == 0) {
        b.run = run;
        b.origins = std::min(most / run, s.origin_count - b.first_origin);
      } else {  // whole mask words of one origin
        b.run = std::min(std::max(most / 32 * 32, 32u), run - b.first_sample);
        b.origins = 1;
      }
      std::string trouble;
      try {
        batch_sums_.fill_zero();
        body(b);
        device_.run(chop_kernels, "chop_fold", 3 * tally_items_, 3 * tally_items_, batch_sums_, sums_);
      } catch (const MemoryError& e) {
        trouble = e.what();
      } catch (const UsageError& e) {  // more pieces or pairs than 32 bits can number
        trouble = e.what();
      }
      if (!trouble.empty()) {
        scratch_ = {};
        bundles_.release();
        if (b.rays() <= least_batch)
          throw MemoryError(fmt::format("{} (tracing only {} rays at a time)", trouble, b.rays()));
        smaller_ = b.rays() / 2;
        continue;
      }
      counts_.rays += b.rays();
      b.first_sample += b.run;
      if (b.first_sample >= run) {
        b.first_sample = 0;
        b.first_origin += b.origins;
      }
    }
    // Not at the cost of others: scratch that takes much of the budget is given back.
    if (rays_held() * bytes_per_ray > device_.ledger()->limit / 4) {
      device_.finish();
      scratch_ = {};
      bundles_.release();
    }
  }

  static const char* cut_name(std::uint32_t axis) {
    constexpr const char* names[] = {"chop rays along x", "chop rays along y", "chop rays along z",
                                     "allocate candidates"};
    return names[axis];
  }

  /// The nearest hits of a batch into scratch_.ray_t and ray_triangle. Nothing ends early here: how near a hit is
  /// to say is the same float formula for every engine, and a later voxel may hold one that it calls nearer.
  void trace(const Segments& s, const Batch& b, const std::function<void(std::uint32_t)>& look = nullptr) {
    const std::uint32_t rays = b.rays();
    {
      const auto stage = device_.stage("clip rays to the grid");
      need(scratch_.ray_t, rays, "nearest hits");
      need(scratch_.ray_triangle, rays, "nearest triangles");
      need_pieces(scratch_.here, rays);
      device_.fill_bytes(scratch_.ray_t.buffer(), 0x7f800000u, rays * 4ull);  // +infinity
      device_.fill_bytes(scratch_.ray_triangle.buffer(), CLRAD_NONE, rays * 4ull);
      auto& p = scratch_.here;
      run_ = b.run;
      pairs_ = s.samples == 0;
      const auto& active = s.active ? s.active->buffer() : s.origins->buffer();
      const std::uint32_t ends = pairs_ ? rays : b.run;
      need(scratch_.from, b.origins * 8ull, "ray origins");
      need(scratch_.to, ends * 8ull, "ray targets");
      device_.run(chop_kernels, "chop_ends", b.origins, b.origins, b.first_origin, *s.origins, active,
                  cl_uint(s.active != nullptr), scratch_.from);
      device_.run(chop_kernels, "chop_ends", ends, ends, pairs_ ? b.first_origin : b.first_sample, *s.targets,
                  active, cl_uint(pairs_ && s.active != nullptr), scratch_.to);
      device_.run(chop_kernels, "chop_rays", rays, rays, scratch_.from, scratch_.to, run_, pairs_,
                  grid_.frame, grid_.first_block, axes_.empty() ? 3u : axes_[0], p.ray, p.cell, p.t0, p.t1,
                  p.counts);
    }
    if (grid_.blocks == 0) return;
    const std::uint32_t pieces = cut(rays);
    if (look) look(pieces);
    test(rays, pieces);
  }

  void need_pieces(Pieces& p, std::uint32_t count) {
    need(p.ray, count, "ray pieces: rays");
    need(p.cell, count, "ray pieces: cells");
    need(p.t0, count, "ray pieces: begin");
    need(p.t1, count, "ray pieces: end");
    need(p.counts, count, "ray pieces: counts");
  }

  /// Cuts the rays of scratch_.here along every axis that has cells; returns how many pieces there are then,
  /// and leaves them in scratch_.here. scratch_.positions says where each ray's pieces begin.
  std::uint32_t cut(std::uint32_t rays) {
    std::uint32_t pieces = rays;
    for (std::size_t k = 0; k < axes_.size(); ++k) {
      const std::uint32_t axis = axes_[k], next = k + 1 < axes_.size() ? axes_[k + 1] : 3;
      const auto stage = device_.stage(cut_name(axis));
      allocate_into(device_, scratch_.here.counts.buffer(), pieces, scratch_.cut, "ray pieces");
      follow(rays, k == 0, scratch_.cut.offsets);
      const std::uint32_t total = scratch_.cut.total;
      auto &from = scratch_.here, &to = scratch_.there;
      need_pieces(to, total);
      device_.run(chop_kernels, "chop_cut", total, total, axis, next, scratch_.cut.offsets,
                  scratch_.cut.owner, scratch_.cut.rank, grid_.frame, grid_.first_block, scratch_.from,
                  scratch_.to, run_, pairs_, from.ray, from.cell, from.t0, from.t1, to.ray, to.cell, to.t0,
                  to.t1, to.counts);
      std::swap(from, to);
      pieces = total;
    }
    return pieces;
  }

  /// Takes positions from slots of one allocation to slots of the next.
  void follow(std::uint32_t rays, bool first, const Array<std::uint32_t>& offsets) {
    need(scratch_.positions, rays + 1ull, "first slots of rays");
    if (first)
      device_.copy(offsets.buffer(), scratch_.positions.buffer(), (rays + 1ull) * 4);
    else
      device_.run(chop_kernels, "chop_follow", rays + 1, rays + 1, offsets, scratch_.positions);
  }

  void test(std::uint32_t rays, std::uint32_t pieces) {
    auto& p = scratch_.here;
    {
      const auto stage = device_.stage("allocate candidates");
      allocate_into(device_, p.counts.buffer(), pieces, scratch_.pairs, "candidates");
      device_.run_local(chop_kernels, "chop_tally_candidates", tally_items_, tally_group(device_),
                        tally_items_, pieces, p.cell, p.t0, p.t1, p.counts, grid_.frame, grid_.held,
                        batch_sums_);
    }
    const std::uint32_t slots = scratch_.pairs.total;
    if (slots == 0) return;
    const auto &owner = scratch_.pairs.owner, &rank = scratch_.pairs.rank;
    need(scratch_.doubt, slots, "undecided candidates");
    need(scratch_.doubtful, slots, "undecided slots");
    need(scratch_.slot_t, slots, "candidate hits");
    need(scratch_.slot_triangle, slots, "candidate triangles");
    {
      const auto stage = device_.stage("intersect rays with candidates");
      device_.run(chop_kernels, "chop_test_nearest", slots, slots, owner, rank, p.ray, p.cell, grid_.frame,
                  grid_.first_block, packets_, grid_.lanes, packet_planes_, occluders_.triangles,
                  occluders_.facets, scratch_.from, scratch_.to, run_, pairs_, scratch_.slot_t,
                  scratch_.slot_triangle, scratch_.doubt);
    }
    {
      const auto stage = device_.stage("decide close candidates exactly");
      const std::uint32_t n = compact(device_, scratch_.doubt.buffer(), slots, scratch_.doubtful.buffer());
      device_.run(chop_kernels, "chop_exact_nearest", n, n, scratch_.doubtful, owner, rank, p.ray, p.cell,
                  grid_.frame, grid_.first_block, grid_.lanes, occluders_.triangles, occluders_.facets,
                  scratch_.from, scratch_.to, run_, pairs_, scratch_.doubt, scratch_.slot_t,
                  scratch_.slot_triangle);
      if (n)
        device_.run_local(chop_kernels, "chop_tally_exact", tally_items_, tally_group(device_), tally_items_,
                          n, scratch_.doubtful, scratch_.doubt, batch_sums_);
    }
    const auto stage = device_.stage("nearest hit of each ray");
    follow(rays, axes_.empty(), scratch_.pairs.offsets);
    need(scratch_.least, rays, "least hits");
    need(scratch_.at, rays, "least positions");
    segmented_reduce_min(device_, scratch_.slot_t.buffer(), scratch_.positions.buffer(),
                         scratch_.least.buffer(), scratch_.at.buffer(), rays);
    device_.run(chop_kernels, "chop_nearest", rays, rays, scratch_.positions, scratch_.least, scratch_.at,
                scratch_.slot_t, scratch_.slot_triangle, scratch_.ray_t, scratch_.ray_triangle);
  }
};

}  // namespace

std::unique_ptr<ChopEngine> make_chop(Device& device, std::span<const OccluderTriangle> triangles,
                                      const ChopOptions& options) {
  return std::make_unique<Chop>(device, triangles, options);
}

}  // namespace clrad
