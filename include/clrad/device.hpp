/// The thin trio of device, program and buffer: choose an OpenCL device, launch kernels by file and name,
/// hold typed arrays inside a memory budget, and account the time of each named stage.
#pragma once
#include <CL/opencl.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <typeindex>
#include <vector>

#include "clrad/error.hpp"

namespace clrad {

enum class Precision { float32, float64 };

/// How a primitive splits its work: big blocks per work-item (CPUs) or work-group trees in local memory
/// (GPUs). The answer is the same to the bit.
enum class Shape { automatic, blocks, trees };

struct DeviceInfo {
  unsigned index = 0;  ///< what --device takes
  std::string name, platform, driver, version;
  bool gpu = false;
  bool fp64 = false;
  unsigned compute_units = 0;
  std::uint64_t memory_bytes = 0;
  std::uint64_t largest_buffer_bytes = 0;
};

struct DeviceOptions {
  std::string device{};  ///< index or part of a name; empty: the first GPU, else the first device
  unsigned cores = 0;    ///< compute units of a sub-device; 0: all
  Precision precision = Precision::float32;
  std::uint64_t memory_bytes = 0;  ///< most that buffers may take at a time; 0: half of the device's memory
  Shape shape = Shape::automatic;
  unsigned work_group_size = 0;  ///< 0: 64 on CPUs, 128 on GPUs
  unsigned packet_width = 0;     ///< 1, 4, 8 or 16 rays a work-item; 0: 16 on CPUs, 1 on GPUs
};

/// All OpenCL devices, in platform order. Empty when there is no platform.
std::vector<DeviceInfo> list_devices();

/// What one named stage took.
struct StageProfile {
  std::string name;
  std::uint64_t launches = 0;
  double seconds = 0;       ///< on the device, from events
  std::uint64_t bytes = 0;  ///< of all arrays made in it, one after the other
};

class Device;

/// Bytes held by live arrays of one device; shared by them and by it.
struct MemoryLedger {
  std::uint64_t limit = 0, held = 0, peak = 0;
};

/// A device buffer that counts against Device's memory budget as long as it lives.
class RawArray {
 public:
  RawArray() = default;
  /// Throws DeviceError that names `what` when the budget or the device does not have the bytes. With `values` given, that
  /// many bytes of them are in it; unlike a write this does not wait for what was enqueued.
  RawArray(Device& device, std::uint64_t bytes, std::string_view what, const void* values = nullptr);
  ~RawArray();
  RawArray(RawArray&& other) noexcept;
  RawArray& operator=(RawArray&& other) noexcept;
  RawArray(const RawArray&) = delete;
  RawArray& operator=(const RawArray&) = delete;

  const cl::Buffer& buffer() const { return buffer_; }
  std::uint64_t bytes() const { return bytes_; }

 protected:
  Device* device_ = nullptr;
  cl::Buffer buffer_;
  std::uint64_t bytes_ = 0;

 private:
  std::shared_ptr<MemoryLedger> ledger_;
  void release() noexcept;
};

/// A kernel argument of type REAL: float or double, as the device's precision says.
struct Real {
  double value;
};

/// A kernel argument: bytes of local memory.
struct LocalBytes {
  std::size_t bytes;
};

class Device {
 public:
  explicit Device(const DeviceOptions& options = {});
  /// On a host application's own context and queue (in-order; with profiling enabled, or stage times stay 0).
  Device(const cl::Context& context, const cl::Device& device, const cl::CommandQueue& queue,
         const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceInfo& info() const;
  const DeviceOptions& options() const;  ///< with nothing left automatic or 0
  const cl::Context& context() const;
  const cl::CommandQueue& queue() const;
  const std::shared_ptr<MemoryLedger>& ledger() const;

  /// Launches kernel `name` of `kernels/<file>` over `items` work-items. The global size is rounded up to
  /// whole work-groups, so a kernel guards `if (get_global_id(0) >= n) return;`. local = 0:
  /// options().work_group_size, which the kernel also knows as CLRAD_WORK_GROUP. items = 0 launches nothing.
  template <class... Args>
  void run(const char* file, const char* name, std::uint64_t items, const Args&... args) {
    run_local(file, name, items, 0, args...);
  }
  template <class... Args>
  void run_local(const char* file, const char* name, std::uint64_t items, unsigned local,
                 const Args&... args) {
    if (items == 0) return;
    cl::Kernel& k = kernel(file, name);
    cl_uint index = 0;
    (set_arg(k, index++, args), ...);
    enqueue(k, name, items, local);
  }

  /// Waits for all that was enqueued.
  void finish();

  /// What has gone into compiling and loading kernels so far, at their first use.
  double loading_seconds() const;

  /// While the object lives, launches count for the stage `name`, and errors mention it. Stages nest; the
  /// innermost counts.
  class Stage {
   public:
    Stage(Device& device, std::string_view name);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

   private:
    Device& device_;
  };
  [[nodiscard]] Stage stage(std::string_view name) { return Stage(*this, name); }
  std::string_view current_stage() const;

  /// Stages that launched or allocated anything, in the order of their first beginning. Waits for the queue.
  std::vector<StageProfile> profile();
  void reset_profile();

  /// For arrays: transfers that count for the current stage. Blocking.
  void read(const cl::Buffer& from, std::uint64_t offset_bytes, std::uint64_t bytes, void* to);
  /// The bytes are at `to` after the next read() or finish(): several transfers cost one wait.
  void read_later(const cl::Buffer& from, std::uint64_t offset_bytes, std::uint64_t bytes, void* to);
  void write(const cl::Buffer& to, std::uint64_t offset_bytes, std::uint64_t bytes, const void* from);
  /// Device to device; in order with the launches, not blocking.
  void copy(const cl::Buffer& from, const cl::Buffer& to, std::uint64_t bytes, std::uint64_t from_offset = 0,
            std::uint64_t to_offset = 0);
  void fill_bytes(const cl::Buffer& buffer, std::uint32_t pattern, std::uint64_t bytes,
                  std::uint64_t offset = 0);

  /// The T that this device keeps for as long as it lives, made at the first call: scratch that outlives one call.
  template <class T>
  T& kept() {
    auto& slot = kept_[typeid(T)];
    if (!slot) slot = std::make_shared<T>();
    return *static_cast<T*>(slot.get());
  }
  /// Gives the kept T back.
  template <class T>
  void drop_kept() {
    kept_.erase(typeid(T));
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::map<std::type_index, std::shared_ptr<void>> kept_;  // after impl_: goes first

  friend class RawArray;
  void note_array(std::uint64_t bytes);
  cl::Kernel& kernel(const char* file, const char* name);
  void enqueue(cl::Kernel& kernel, const char* name, std::uint64_t items, unsigned local);

  void set_arg(cl::Kernel& k, cl_uint i, const RawArray& a) { k.setArg(i, a.buffer()); }
  void set_arg(cl::Kernel& k, cl_uint i, const cl::Buffer& b) { k.setArg(i, b); }
  void set_arg(cl::Kernel& k, cl_uint i, LocalBytes l) { k.setArg(i, l.bytes, nullptr); }
  void set_arg(cl::Kernel& k, cl_uint i, Real r) {
    if (options().precision == Precision::float64)
      k.setArg(i, r.value);
    else
      k.setArg(i, static_cast<float>(r.value));
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void set_arg(cl::Kernel& k, cl_uint i, T value) {
    static_assert(sizeof(T) == 4 || sizeof(T) == 8, "kernel scalars are 32 or 64 bits");
    k.setArg(i, value);
  }
};

/// `count` values of T on the device. T is what the kernel sees: uint32_t, float, a struct of
/// kernels/shared/types.h.
template <class T>
class Array : public RawArray {
 public:
  Array() = default;
  Array(Device& device, std::uint64_t count, std::string_view what)
      : RawArray(device, count * sizeof(T), what), count_(count) {}
  Array(Device& device, std::span<const T> values, std::string_view what)
      : RawArray(device, values.size_bytes(), what, values.data()), count_(values.size()) {}

  std::uint64_t size() const { return count_; }
  void upload(std::span<const T> values, std::uint64_t at = 0) {
    if (!values.empty()) device_->write(buffer_, at * sizeof(T), values.size_bytes(), values.data());
  }
  std::vector<T> download(std::uint64_t at, std::uint64_t count) const {
    std::vector<T> values(count);
    if (count) device_->read(buffer_, at * sizeof(T), count * sizeof(T), values.data());
    return values;
  }
  std::vector<T> download() const { return download(0, count_); }
  T at(std::uint64_t i) const { return download(i, 1)[0]; }
  void fill_zero() { device_->fill_bytes(buffer_, 0, bytes()); }

 private:
  std::uint64_t count_ = 0;
};

/// `count` numbers of the device's precision; the host side is always double.
class RealArray : public RawArray {
 public:
  RealArray() = default;
  RealArray(Device& device, std::uint64_t count, std::string_view what);
  RealArray(Device& device, std::span<const double> values, std::string_view what);

  std::uint64_t size() const { return count_; }
  void upload(std::span<const double> values, std::uint64_t at = 0);
  std::vector<double> download(std::uint64_t at, std::uint64_t count) const;
  std::vector<double> download() const { return download(0, count_); }
  void fill_zero();

 private:
  std::uint64_t count_ = 0;
};

}  // namespace clrad
