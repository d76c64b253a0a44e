#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "clrad/device.hpp"

namespace clrad {
namespace {

constexpr std::uint64_t least_room = 16;

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MiB", double(bytes) / (1 << 20));
}

}  // namespace

RawArray::RawArray(Device& device, std::uint64_t bytes, std::string_view what, const void* values)
    : device_(&device), bytes_(bytes), ledger_(device.ledger()) {
  // An array of nothing still needs a buffer that a kernel argument can name.
  const std::uint64_t room = std::max(bytes, least_room);
  if (ledger_->held + room > ledger_->limit) {
    const auto left = ledger_->limit - std::min(ledger_->limit, ledger_->held);
    throw MemoryError(fmt::format(
        "too little memory for {}: it takes {}, {} of the {} allowed by --memory are left; use a coarser "
        "mesh or allow more",
        what, mebibytes(room), mebibytes(left), mebibytes(ledger_->limit)));
  }
  if (room > device.info().largest_buffer_bytes)
    throw MemoryError(fmt::format("{} takes {} in one buffer; {} allows {}", what, mebibytes(room),
                                  device.info().name, mebibytes(device.info().largest_buffer_bytes)));
  try {
    std::array<char, least_room> padded{};
    if (values != nullptr && bytes > 0 && bytes < room) {  // OpenCL copies as many bytes as the buffer has
      std::memcpy(padded.data(), values, bytes);
      values = padded.data();
    }
    const bool copied = values != nullptr && bytes > 0;
    buffer_ = cl::Buffer(device.context(), CL_MEM_READ_WRITE | (copied ? CL_MEM_COPY_HOST_PTR : 0), room,
                         copied ? const_cast<void*>(values) : nullptr);
  } catch (const cl::Error& e) {
    throw MemoryError(fmt::format("the device has no memory left for {}: {} (OpenCL error {})", what,
                                  mebibytes(room), e.err()));
  }
  ledger_->held += room;
  ledger_->peak = std::max(ledger_->peak, ledger_->held);
  device.note_array(bytes);
}

RawArray::~RawArray() {
  release();
}

void RawArray::release() noexcept {
  if (ledger_) ledger_->held -= std::max(bytes_, least_room);
  ledger_.reset();
  buffer_ = cl::Buffer();
}

RawArray::RawArray(RawArray&& other) noexcept
    : device_(other.device_),
      buffer_(std::exchange(other.buffer_, {})),
      bytes_(other.bytes_),
      ledger_(std::exchange(other.ledger_, nullptr)) {}

RawArray& RawArray::operator=(RawArray&& other) noexcept {
  if (this != &other) {
    release();
    device_ = other.device_;
    buffer_ = std::exchange(other.buffer_, {});
    bytes_ = other.bytes_;
    ledger_ = std::exchange(other.ledger_, nullptr);
  }
  return *this;
}

namespace {
std::uint64_t real_bytes(const Device& device) {
  return device.options().precision == Precision::float64 ? 8 : 4;
}

// The bytes of `values` as the device has them.
struct Reals {
  std::span<const double> wide;
  std::vector<float> narrow;
  const void* data() const { return narrow.empty() ? static_cast<const void*>(wide.data()) : narrow.data(); }
};
Reals as_reals(const Device& device, std::span<const double> values) {
  if (real_bytes(device) == 8) return {values, {}};
  return {values, std::vector<float>(values.begin(), values.end())};
}
}  // namespace

RealArray::RealArray(Device& device, std::uint64_t count, std::string_view what)
    : RawArray(device, count * real_bytes(device), what), count_(count) {}

RealArray::RealArray(Device& device, std::span<const double> values, std::string_view what)
    : RawArray(device, values.size() * real_bytes(device), what, as_reals(device, values).data()),
      count_(values.size()) {}

void RealArray::upload(std::span<const double> values, std::uint64_t at) {
  if (values.empty()) return;
  if (real_bytes(*device_) == 8) {
    device_->write(buffer_, at * 8, values.size_bytes(), values.data());
    return;
  }
  const std::vector<float> narrow(values.begin(), values.end());
  device_->write(buffer_, at * 4, narrow.size() * 4, narrow.data());
}

std::vector<double> RealArray::download(std::uint64_t at, std::uint64_t count) const {
  std::vector<double> values(count);
  if (count == 0) return values;
  if (real_bytes(*device_) == 8) {
    device_->read(buffer_, at * 8, count * 8, values.data());
    return values;
  }
  std::vector<float> narrow(count);
  device_->read(buffer_, at * 4, count * 4, narrow.data());
  std::copy(narrow.begin(), narrow.end(), values.begin());
  return values;
}

void RealArray::fill_zero() {
  device_->fill_bytes(buffer_, 0, bytes());
}

}  // namespace clrad
