#include "solve/krylov.hpp"

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

constexpr const char* krylov_kernels = "solve/krylov.cl";
constexpr std::uint32_t block = 1024;  // BLOCK of krylov.cl

// One band's least-squares problem: the Hessenberg matrix under Givens rotations.
struct Band {
  double norm = 0, residual = 0;  // of the right-hand side; what is left of it
  std::vector<std::vector<double>> column;
  std::vector<double> cosine, sine, right{0};
  bool done = false;

  // A new column, with what orthogonalisation left of its vector.
  void add(std::vector<double> h, double left) {
    h.push_back(left);
    for (std::size_t k = 0; k < cosine.size(); ++k) {
      const double a = cosine[k] * h[k] + sine[k] * h[k + 1];
      h[k + 1] = cosine[k] * h[k + 1] - sine[k] * h[k];
      h[k] = a;
    }
    const std::size_t last = h.size() - 2;
    const double length = std::hypot(h[last], h[last + 1]);
    cosine.push_back(length > 0 ? h[last] / length : 1);
    sine.push_back(length > 0 ? h[last + 1] / length : 0);
    h[last] = length;
    h.pop_back();
    column.push_back(std::move(h));
    right.push_back(-sine[last] * right[last]);
    right[last] *= cosine[last];
    residual = std::abs(right.back());
  }

  std::vector<double> weights() const {
    std::vector<double> y(column.size(), 0);
    for (std::size_t k = column.size(); k-- > 0;) {
      double sum = right[k];
      for (std::size_t j = k + 1; j < column.size(); ++j) sum -= column[j][k] * y[j];
      y[k] = column[k][k] != 0 ? sum / column[k][k] : 0;
    }
    return y;
  }
};

class Gmres {
 public:
  Gmres(SolveState& state, std::uint32_t steps)
      : state_(state),
        size_(std::uint64_t(state.bands) * state.patches),
        blocks_((state.patches + block - 1) / block),
        basis_(state.device, size_ * (steps + 1), "directions of the solver"),
        vector_(state.device, size_, "a vector of the solver"),
        partial_(state.device, std::uint64_t(steps + 1) * state.bands * blocks_, "dot products"),
        factor_(state.device, std::uint64_t(steps + 1) * state.bands, "factors of vectors"),
        weight_(state.device, shares(state), "area shares") {}

  RealArray& vector() { return vector_; }

  void apply(std::uint32_t k) {
    state_.device.run(krylov_kernels, "apply", size_, state_.patch_columns, state_.colours,
                      state_.patch_of_slot_device, state_.slot_of_patch_device,
                      std::uint32_t(state_.patch_of_slot.size()), state_.loss, state_.coupling, basis_,
                      k * size_, vector_, state_.patches, state_.bands);
  }

  // [k][band] products of the first `count` vectors of `with` with the vector.
  std::vector<double> dots(const RealArray& with, std::uint32_t count) {
    const std::uint64_t sums = std::uint64_t(count) * state_.bands * blocks_;
    state_.device.run(krylov_kernels, "dots", sums, with, count, vector_, weight_, partial_, blocks_,
                      state_.patches, state_.bands);
    const std::vector<double> partial = partial_.download(0, sums);
    std::vector<double> result(std::size_t(count) * state_.bands, 0);
    for (std::size_t i = 0; i < partial.size(); ++i) result[i / blocks_] += partial[i];
    return result;
  }
  std::vector<double> norms() {
    std::vector<double> squares = dots(vector_, 1);
    for (double& x : squares) x = std::sqrt(x);
    return squares;
  }

  void subtract(const std::vector<double>& factor, std::uint32_t count) {
    factor_.upload(factor);
    state_.device.run(krylov_kernels, "subtract", size_, vector_, basis_, factor_, count, state_.patches,
                      state_.bands);
  }
  // basis[k] = factor[band] x from.
  void scale(const RealArray& from, const std::vector<double>& factor, RealArray& to, std::uint64_t at) {
    factor_.upload(factor);
    state_.device.run(krylov_kernels, "scale", size_, from, factor_, state_.slot_of_patch_device, to, at,
                      state_.patches, state_.bands);
  }
  void add_to_basis(const std::vector<double>& factor, std::uint32_t k) {
    scale(vector_, factor, basis_, k * size_);
  }
  void combine(const std::vector<double>& factor, std::uint32_t count, RealArray& sum) {
    factor_.upload(factor);
    state_.device.run(krylov_kernels, "combine", size_, basis_, factor_, count, sum, state_.patches,
                      state_.bands);
  }
  const RealArray& basis() const { return basis_; }

 private:
  static std::vector<double> shares(const SolveState& state) {
    std::vector<double> share;
    double all = 0;
    for (std::uint32_t p = 0; p < state.patches; ++p) {
      share.push_back(state.mesh.patches[p].area_m2 * state.exposed[p]);
      all += share.back();
    }
    for (double& s : share) s /= all;
    return share;
  }

  SolveState& state_;
  std::uint64_t size_;
  std::uint32_t blocks_;
  RealArray basis_, vector_, partial_, factor_, weight_;
};

}  // namespace

double solve_by_gmres(SolveState& state, const RealArray& rhs, RealArray& solution, double scale,
                      double least, double relative, std::uint32_t steps,
                      const std::function<bool(double)>& goes_on) {
  Gmres gmres(state, steps);
  const std::uint32_t bands = state.bands;
  std::vector<Band> band(bands);
  gmres.scale(rhs, std::vector<double>(bands, 1 / scale), gmres.vector(), 0);
  const std::vector<double> norm = gmres.norms();
  std::vector<double> factor(bands);
  for (std::uint32_t b = 0; b < bands; ++b) {
    band[b].norm = band[b].residual = band[b].right[0] = norm[b];
    factor[b] = norm[b] > 0 ? 1 / norm[b] : 0;
  }
  gmres.add_to_basis(factor, 0);
  const auto all_done = [&] {
    for (Band& b : band)
      b.done |= !(b.residual > std::max(least / scale, relative * b.norm)) || !std::isfinite(b.residual);
    return std::all_of(band.begin(), band.end(), [](const Band& b) { return b.done; });
  };
  // The largest residual of a band as a share of its right-hand side; NaN where something is not finite.
  const auto share_left = [&] {
    double worst = 0;
    for (const Band& b : band) {
      const double left = b.norm > 0 ? b.residual / b.norm : b.norm;
      worst = left > worst || std::isnan(left) ? left : worst;
      if (std::isnan(worst)) break;
    }
    return worst;
  };
  std::uint32_t step = 0;
  while (step < steps && !all_done()) {
    if (step > 0 && goes_on) {
      const double left = share_left();
      if (!goes_on(std::isfinite(left) ? left : 1)) break;
    }
    gmres.apply(step++);
    // Gram and Schmidt, twice: once leaves too much in float.
    std::vector<double> h(std::size_t(step) * bands, 0);
    for (int pass = 0; pass < 2; ++pass) {
      const std::vector<double> along = gmres.dots(gmres.basis(), step);
      gmres.subtract(along, step);
      for (std::size_t i = 0; i < h.size(); ++i) h[i] += along[i];
    }
    const std::vector<double> left = gmres.norms();
    for (std::uint32_t b = 0; b < bands; ++b) {
      factor[b] = 0;
      if (band[b].done) continue;
      std::vector<double> of_band;
      for (std::uint32_t k = 0; k < step; ++k) of_band.push_back(h[std::size_t(k) * bands + b]);
      band[b].add(of_band, left[b]);
      if (left[b] > 0) factor[b] = 1 / left[b];
    }
    gmres.add_to_basis(factor, step);
  }
  std::vector<double> weights(std::size_t(std::max(step, 1u)) * bands, 0);
  for (std::uint32_t b = 0; b < bands; ++b) {
    const std::vector<double> y = band[b].weights();
    for (std::size_t k = 0; k < y.size(); ++k) weights[k * bands + b] = y[k] * scale;
  }
  gmres.combine(weights, std::max(step, 1u), solution);
  return share_left();
}

}  // namespace clrad
