#include "clrad/device.hpp"

#include <fmt/format.h>

#include <chrono>
#include <map>
#include <optional>
#include <set>

#include "device/choose.hpp"
#include "device/program.hpp"

namespace clrad {

namespace {
using Clock = std::chrono::steady_clock;

// Adds the time that it lives.
class Loading {
 public:
  explicit Loading(double& seconds) : seconds_(seconds) {}
  ~Loading() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;

 private:
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};
}  // namespace

struct Device::Impl {
  cl::Device device;
  DeviceInfo info;
  DeviceOptions options;
  cl::Context context;
  cl::CommandQueue queue;
  std::shared_ptr<MemoryLedger> ledger = std::make_shared<MemoryLedger>();
  std::map<std::string, cl::Program> programs;
  std::map<std::string, cl::Kernel> kernels;
  std::set<std::pair<cl_kernel, std::uint64_t>> launched;  // with which sizes of work-groups
  double loading_seconds = 0;

  std::vector<StageProfile> stages;
  std::vector<std::size_t> stack;  // indices into stages
  std::vector<std::pair<std::size_t, cl::Event>> pending;
  bool profiling = true;

  void open(const DeviceOptions& wanted) {
    options = resolve_options(wanted, info);
    ledger->limit = options.memory_bytes;
    profiling = queue.getInfo<CL_QUEUE_PROPERTIES>() & CL_QUEUE_PROFILING_ENABLE;
  }

  std::size_t stage_index(std::string_view name) {
    for (std::size_t i = 0; i < stages.size(); ++i)
      if (stages[i].name == name) return i;
    stages.push_back({std::string(name)});
    return stages.size() - 1;
  }

  std::size_t current() { return stack.empty() ? stage_index("other") : stack.back(); }

  void record(const cl::Event& event) {
    const std::size_t stage = current();
    ++stages[stage].launches;
    if (!profiling) return;
    pending.emplace_back(stage, event);
    if (pending.size() >= 1024) harvest();
  }

  void harvest() {
    if (pending.empty()) return;
    queue.finish();
    for (auto& [stage, event] : pending)
      stages[stage].seconds += 1e-9 * double(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                             event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
    pending.clear();
  }

  void read(const cl::Buffer& from, std::uint64_t offset, std::uint64_t bytes, void* to, cl_bool blocking) {
    if (bytes == 0) return;
    try {
      queue.enqueueReadBuffer(from, blocking, offset, bytes, to);
    } catch (const cl::Error& e) {
      fail(e, fmt::format("reading {} bytes", bytes));
    }
  }

  [[noreturn]] void fail(const cl::Error& e, std::string_view doing) const {
    const std::string stage =
        stack.empty() ? "" : fmt::format(" while trying to {}", stages[stack.back()].name);
    std::string hint;
    if (e.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || e.err() == CL_OUT_OF_RESOURCES ||
        e.err() == CL_OUT_OF_HOST_MEMORY)
      hint = "; the device is out of memory: try a smaller --memory, a coarser mesh or fewer samples";
    throw DeviceError(fmt::format("{} failed ({}, OpenCL error {}){} on {}{}", doing, e.what(), e.err(),
                                  stage, info.name, hint));
  }
};

Device::Device(const DeviceOptions& options) : impl_(std::make_unique<Impl>()) {
  auto chosen = choose_device(options);
  impl_->device = chosen.device;
  impl_->info = chosen.info;
  try {
    impl_->context = cl::Context(chosen.device);
    impl_->queue = cl::CommandQueue(impl_->context, chosen.device, cl::QueueProperties::Profiling);
  } catch (const cl::Error& e) {
    impl_->fail(e, "opening the device");
  }
  impl_->open(options);
}

Device::Device(const cl::Context& context, const cl::Device& device, const cl::CommandQueue& queue,
               const DeviceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = device;
  impl_->info = describe_device(device, 0);
  impl_->context = context;
  impl_->queue = queue;
  impl_->open(options);
}

Device::~Device() {
  if (impl_->queue()) clFinish(impl_->queue());  // not cl::CommandQueue::finish: a destructor must not throw
}

const DeviceInfo& Device::info() const {
  return impl_->info;
}
const DeviceOptions& Device::options() const {
  return impl_->options;
}
const cl::Context& Device::context() const {
  return impl_->context;
}
const cl::CommandQueue& Device::queue() const {
  return impl_->queue;
}
const std::shared_ptr<MemoryLedger>& Device::ledger() const {
  return impl_->ledger;
}

cl::Kernel& Device::kernel(const char* file, const char* name) {
  const std::string key = fmt::format("{}:{}", file, name);
  if (auto found = impl_->kernels.find(key); found != impl_->kernels.end()) return found->second;
  const Loading loading(impl_->loading_seconds);
  auto program = impl_->programs.find(file);
  if (program == impl_->programs.end())
    program =
        impl_->programs
            .emplace(file, build_program(impl_->context, impl_->device, impl_->info, impl_->options, file))
            .first;
  try {
    return impl_->kernels.emplace(key, cl::Kernel(program->second, name)).first->second;
  } catch (const cl::Error& e) {
    impl_->fail(e, fmt::format("finding kernel {} in kernels/{}", name, file));
  }
}

void Device::enqueue(cl::Kernel& kernel, const char* name, std::uint64_t items, unsigned local) {
  const std::uint64_t group = local ? local : impl_->options.work_group_size;
  const std::uint64_t global = (items + group - 1) / group * group;
  // Some drivers compile or load a kernel for a size of work-groups only when it is first launched.
  std::optional<Loading> loading;
  if (impl_->launched.emplace(kernel(), group).second) loading.emplace(impl_->loading_seconds);
  try {
    cl::Event event;
    impl_->queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(global), cl::NDRange(group), nullptr,
                                      &event);
    impl_->record(event);
  } catch (const cl::Error& e) {
    impl_->fail(e, fmt::format("launching {}", name));
  }
}

void Device::note_array(std::uint64_t bytes) {
  if (!impl_->stack.empty()) impl_->stages[impl_->current()].bytes += bytes;
}

double Device::loading_seconds() const {
  return impl_->loading_seconds;
}

void Device::finish() {
  try {
    impl_->queue.finish();
  } catch (const cl::Error& e) {
    impl_->fail(e, "waiting for the device");
  }
}

Device::Stage::Stage(Device& device, std::string_view name) : device_(device) {
  device.impl_->stack.push_back(device.impl_->stage_index(name));
}
Device::Stage::~Stage() {
  device_.impl_->stack.pop_back();
}

std::string_view Device::current_stage() const {
  return impl_->stack.empty() ? std::string_view() : impl_->stages[impl_->stack.back()].name;
}

std::vector<StageProfile> Device::profile() {
  impl_->harvest();
  std::vector<StageProfile> launched;
  for (const auto& stage : impl_->stages)
    if (stage.launches || stage.bytes) launched.push_back(stage);
  return launched;
}

void Device::reset_profile() {
  impl_->harvest();
  for (auto& stage : impl_->stages) stage.launches = 0, stage.seconds = 0, stage.bytes = 0;
}

void Device::read(const cl::Buffer& from, std::uint64_t offset, std::uint64_t bytes, void* to) {
  impl_->read(from, offset, bytes, to, CL_TRUE);
}

void Device::read_later(const cl::Buffer& from, std::uint64_t offset, std::uint64_t bytes, void* to) {
  impl_->read(from, offset, bytes, to, CL_FALSE);
}

void Device::write(const cl::Buffer& to, std::uint64_t offset, std::uint64_t bytes, const void* from) {
  if (bytes == 0) return;
  try {
    impl_->queue.enqueueWriteBuffer(to, CL_TRUE, offset, bytes, from);
  } catch (const cl::Error& e) {
    impl_->fail(e, fmt::format("writing {} bytes", bytes));
  }
}

void Device::copy(const cl::Buffer& from, const cl::Buffer& to, std::uint64_t bytes,
                  std::uint64_t from_offset, std::uint64_t to_offset) {
  if (bytes == 0) return;
  try {
    cl::Event event;
    impl_->queue.enqueueCopyBuffer(from, to, from_offset, to_offset, bytes, nullptr, &event);
    impl_->record(event);
  } catch (const cl::Error& e) {
    impl_->fail(e, fmt::format("copying {} bytes", bytes));
  }
}

void Device::fill_bytes(const cl::Buffer& buffer, std::uint32_t pattern, std::uint64_t bytes,
                        std::uint64_t offset) {
  if (bytes == 0) return;
  try {
    cl::Event event;
    impl_->queue.enqueueFillBuffer(buffer, pattern, offset, bytes, nullptr, &event);
    impl_->record(event);
  } catch (const cl::Error& e) {
    impl_->fail(e, fmt::format("filling {} bytes", bytes));
  }
}

}  // namespace clrad
