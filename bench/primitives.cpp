/// Primitives against a device-to-device copy of the same bytes, and scan and sort against Boost.Compute's,
/// one after the other in the same run. Every result is compared with the host's before it is timed.
///     bench_primitives [-o FILE] [--device D] [--cores N] [--shape blocks|trees] [--work-group N] [--values
///     N] [--repeats N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "clrad/primitives.hpp"

#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#endif
#define BOOST_COMPUTE_USE_CPP11
#define BOOST_DISABLE_ASSERTS
#include <boost/compute/algorithm/exclusive_scan.hpp>
#include <boost/compute/algorithm/sort_by_key.hpp>
#include <boost/compute/command_queue.hpp>
#include <boost/compute/context.hpp>
#include <boost/compute/core.hpp>
#include <boost/compute/iterator/buffer_iterator.hpp>
#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif

namespace {

using namespace clrad;
using Clock = std::chrono::steady_clock;
using Uints = std::vector<std::uint32_t>;
namespace compute = boost::compute;

struct Times {
  std::vector<double> ms;
  static double middle(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v.size() % 2 ? v[v.size() / 2] : 0.5 * (v[v.size() / 2 - 1] + v[v.size() / 2]);
  }
  double median() const { return middle(ms); }
  double min() const { return *std::min_element(ms.begin(), ms.end()); }
  double mad() const {
    std::vector<double> deviation;
    for (const double t : ms) deviation.push_back(std::abs(t - median()));
    return middle(deviation);
  }
};

/// One contestant: `prepare` is not timed and restores what `work` overwrites; both end with the queue empty.
struct Contestant {
  std::string name;
  std::function<void()> prepare, work;
  Times times;
};

/// All in turn, `repeats` rounds after two of warm-up.
void race(std::vector<Contestant*> contestants, unsigned repeats) {
  for (unsigned round = 0; round < repeats + 2; ++round)
    for (Contestant* c : contestants) {
      if (c->prepare) c->prepare();
      const auto start = Clock::now();
      c->work();
      const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
      if (round >= 2) c->times.ms.push_back(ms);
    }
}

[[noreturn]] void wrong(const std::string& what) {
  fmt::print(stderr, "bench_primitives: {} gives a wrong result; nothing is timed\n", what);
  std::exit(1);
}

nlohmann::json to_json(const Times& t) {
  return {{"ms_median", t.median()}, {"ms_min", t.min()}, {"ms_mad", t.mad()}};
}

struct Settings {
  std::string out = "out/bench/primitives.json";
  DeviceOptions device;
  std::uint64_t values = 16u << 20;
  unsigned repeats = 15;
};

Settings parse(int argc, char** argv) {
  Settings s;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (i + 1 >= argc) throw UsageError("option " + option + " needs a value");
    const std::string value = argv[++i];
    if (option == "-o")
      s.out = value;
    else if (option == "--device")
      s.device.device = value;
    else if (option == "--cores")
      s.device.cores = unsigned(std::stoul(value));
    else if (option == "--work-group")
      s.device.work_group_size = unsigned(std::stoul(value));
    else if (option == "--shape")
      s.device.shape = value == "trees" ? Shape::trees : Shape::blocks;
    else if (option == "--values")
      s.values = std::stoull(value);
    else if (option == "--repeats")
      s.repeats = unsigned(std::stoul(value));
    else
      throw UsageError("no option " + option);
  }
  return s;
}

class Bench {
 public:
  explicit Bench(const Settings& settings)
      : settings_(settings), device_(settings.device), n_(settings.values) {
    const DeviceOptions& used = device_.options();
    report_ = {{"schema", "clrad-bench-1"},
               {"benchmark", "primitives"},
               {"device",
                {{"name", device_.info().name},
                 {"platform", device_.info().platform},
                 {"driver", device_.info().driver},
                 {"version", device_.info().version}}},
               {"options",
                {{"shape", used.shape == Shape::trees ? "trees" : "blocks"},
                 {"work_group_size", used.work_group_size},
                 {"cores", used.cores},
                 {"repeats", settings.repeats}}},
               {"values", n_},
               {"rows", nlohmann::json::array()}};
    fmt::print("{} ({}), {}, work-group {}, {} values, median of {}\n\n", device_.info().name,
               device_.info().driver, used.shape == Shape::trees ? "trees" : "blocks", used.work_group_size,
               n_, settings.repeats);
    fmt::print("{:<24}{:>10}{:>10}{:>9}{:>10}{:>10}{:>10}{:>10}\n", "", "ms median", "ms min", "ms MAD",
               "copy ms", "x copy", "Boost ms", "x Boost");
  }

  void all() {
    scan();
    segmented_scans();
    segmented_reduces();
    allocation();
    compaction();
    sort();
    const std::filesystem::path path(settings_.out);
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << report_.dump(2) << '\n';
    fmt::print(
        "\nx copy: time / time of a device-to-device copy of the same bytes; x Boost: time / Boost.Compute's "
        "time\n{}\n",
        settings_.out);
  }

 private:
  Settings settings_;
  Device device_;
  std::uint64_t n_;
  nlohmann::json report_;
  std::mt19937 random_{1};

  Array<std::uint32_t> array(const Uints& values) {
    return Array<std::uint32_t>(device_, std::span<const std::uint32_t>(values), "benchmark");
  }
  Array<std::uint32_t> array(std::uint64_t n) { return Array<std::uint32_t>(device_, n, "benchmark"); }

  Uints random_values(std::uint64_t n, std::uint32_t below) {
    Uints values(n);
    for (auto& v : values) v = random_() % below;
    return values;
  }

  /// Times clrad's work beside a copy of `bytes` and, where there is one, a peer.
  void row(const std::string& name, std::uint64_t bytes, std::function<void()> prepare,
           std::function<void()> work, std::function<void()> peer_prepare = {},
           std::function<void()> peer = {}) {
    const Array<std::uint32_t> from(device_, bytes / 4, "copy"), to(device_, bytes / 4, "copy");
    const auto finished = [&](std::function<void()> f) {
      return [this, f] {
        if (f) f();
        device_.finish();
      };
    };
    Contestant mine{"clrad", finished(prepare), finished(work), {}};
    Contestant copy{"copy", {}, finished([&] { device_.copy(from.buffer(), to.buffer(), bytes); }), {}};
    Contestant other{"Boost.Compute", finished(peer_prepare), finished(peer), {}};
    std::vector<Contestant*> all{&copy, &mine};
    if (peer) all.push_back(&other);
    race(all, settings_.repeats);
    nlohmann::json r = to_json(mine.times);
    r["name"] = name;
    r["copy_bytes"] = bytes;
    r["copy"] = to_json(copy.times);
    r["ratio_to_copy"] = mine.times.median() / copy.times.median();
    if (peer) {
      r["boost_compute"] = to_json(other.times);
      r["ratio_to_boost_compute"] = mine.times.median() / other.times.median();
    }
    report_["rows"].push_back(r);
    fmt::print("{:<24}{:>10.3f}{:>10.3f}{:>9.3f}{:>10.3f}{:>10.2f}", name, mine.times.median(),
               mine.times.min(), mine.times.mad(), copy.times.median(),
               mine.times.median() / copy.times.median());
    if (peer)
      fmt::print("{:>10.3f}{:>10.2f}", other.times.median(), mine.times.median() / other.times.median());
    fmt::print("\n");
  }

  compute::command_queue boost_queue() const { return compute::command_queue(device_.queue()()); }
  static compute::buffer_iterator<compute::uint_> begin(const Array<std::uint32_t>& a, std::uint64_t at = 0) {
    return {compute::buffer(a.buffer()()), at};
  }

  void scan() {
    const Uints values = random_values(n_, 200);
    const auto in = array(values), out = array(n_), peer_out = array(n_);
    Uints want(n_);
    std::exclusive_scan(values.begin(), values.end(), want.begin(), 0u);
    auto queue = boost_queue();
    const auto mine = [&] { scan_uint(device_, Sum::exclusive, in.buffer(), out.buffer(), n_); };
    const auto peer = [&] { compute::exclusive_scan(begin(in), begin(in, n_), begin(peer_out), queue); };
    mine();
    if (out.download() != want) wrong("scan_uint");
    peer();
    if (peer_out.download() != want) wrong("Boost.Compute's exclusive_scan");
    row("scan", n_ * 4, {}, mine, {}, peer);
  }

  void segmented_scans() {
    const Uints values = random_values(n_, 200), heads = [&] {
      Uints h(n_);
      for (auto& x : h) x = random_() % 16 == 0;
      return h;
    }();
    const auto in = array(values), marks = array(heads), out = array(n_);
    Uints want = values;
    for (std::uint64_t i = 1; i < n_; ++i)
      if (!heads[i]) want[i] += want[i - 1];
    const auto mine = [&] {
      segmented_scan_uint(device_, Op::sum, in.buffer(), marks.buffer(), out.buffer(), n_);
    };
    mine();
    if (out.download() != want) wrong("segmented_scan_uint");
    row("segmented scan", n_ * 8, {}, mine);
  }

  void segmented_reduces() {
    std::vector<float> values(n_);
    for (auto& v : values) v = float(random_() % 100000);
    Uints offsets{0};
    while (offsets.back() < n_)
      offsets.push_back(std::uint32_t(std::min<std::uint64_t>(n_, offsets.back() + random_() % 33)));
    const std::uint64_t segments = offsets.size() - 1;
    const Array<float> in(device_, std::span<const float>(values), "benchmark"),
        out(device_, segments, "benchmark");
    const auto at = array(offsets), index = array(segments);
    std::vector<float> want(segments, std::numeric_limits<float>::infinity());
    Uints want_index(segments, 0xffffffffu);
    for (std::uint64_t s = 0; s < segments; ++s)
      for (std::uint32_t i = offsets[s]; i < offsets[s + 1]; ++i)
        if (values[i] < want[s]) want[s] = values[i], want_index[s] = i;
    const auto min = [&] {
      segmented_reduce_min(device_, in.buffer(), at.buffer(), out.buffer(), index.buffer(), segments);
    };
    min();
    if (out.download() != want || index.download() != want_index) wrong("segmented_reduce_min");
    row("segmented reduce min", n_ * 4, {}, min);
    const auto sum = [&] { segmented_reduce_sum(device_, in.buffer(), at.buffer(), out.buffer(), segments); };
    sum();
    const auto sums = out.download();
    for (std::uint64_t s = 0; s < segments; ++s) {  // integers below 2^24: exact in any order
      float exact = 0;
      for (std::uint32_t i = offsets[s]; i < offsets[s + 1]; ++i) exact += values[i];
      if (sums[s] != exact) wrong("segmented_reduce_sum");
    }
    row("segmented reduce sum", n_ * 4, {}, sum);
  }

  void allocation() {
    const std::uint64_t requesters = n_ / 4;
    const auto one = [&](const std::string& name, const Uints& counts) {
      const auto from = array(counts);
      Allocation allocation;
      const auto mine = [&] { allocate_into(device_, from.buffer(), counts.size(), allocation); };
      mine();
      const Uints owner = allocation.owner.download(), rank = allocation.rank.download();
      std::uint64_t slot = 0;
      for (std::uint32_t i = 0; i < counts.size(); ++i)
        for (std::uint32_t k = 0; k < counts[i]; ++k, ++slot)
          if (owner[slot] != i || rank[slot] != k) wrong("allocate");
      if (slot != allocation.total) wrong("allocate");
      row(name, 8ull * allocation.total, {}, mine);
    };
    one("allocate 0 to 7 each", random_values(requesters, 8));
    Uints few(requesters, 0);
    few[requesters / 2] = std::uint32_t(n_);
    one("allocate one of many", few);
  }

  void compaction() {
    Uints flags(n_);
    for (auto& f : flags) f = random_() % 2;
    const auto from = array(flags), indices = array(n_);
    Uints want;
    for (std::uint32_t i = 0; i < n_; ++i)
      if (flags[i]) want.push_back(i);
    const auto mine = [&] { compact(device_, from.buffer(), n_, indices.buffer()); };
    mine();
    if (indices.download(0, want.size()) != want) wrong("compact");
    row("compact half", n_ * 4, {}, mine);
  }

  void sort() {
    const std::uint64_t n = n_ / 4;
    Uints keys(n), order(n);
    for (auto& k : keys) k = random_();
    std::iota(order.begin(), order.end(), 0u);
    const auto from = array(keys), positions = array(order), k = array(n), v = array(n);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    auto queue = boost_queue();
    const auto restore = [&] {
      device_.copy(from.buffer(), k.buffer(), n * 4);
      device_.copy(positions.buffer(), v.buffer(), n * 4);
    };
    const auto mine = [&] { radix_sort(device_, k.buffer(), v.buffer(), n); };
    const auto peer = [&] { compute::sort_by_key(begin(k), begin(k, n), begin(v), queue); };
    restore();
    mine();
    if (v.download() != order) wrong("radix_sort");
    restore();
    peer();
    const Uints peer_keys = k.download();
    if (!std::is_sorted(peer_keys.begin(), peer_keys.end())) wrong("Boost.Compute's sort_by_key");
    row("radix sort, n / 4 pairs", n * 8, restore, mine, restore, peer);
  }
};

}  // namespace

int main(int argc, char** argv) {
  try {
    Bench(parse(argc, argv)).all();
    return 0;
  } catch (const UsageError& e) {
    fmt::print(stderr, "bench_primitives: {}\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "bench_primitives: {}\n", e.what());
    return 1;
  }
}
