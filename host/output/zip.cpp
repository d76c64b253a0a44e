#include "output/zip.hpp"

#include <array>

#include "clrad/error.hpp"

namespace clrad {
namespace {

constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
    table[i] = c;
  }
  return table;
}

// Little-endian fields, in order.
struct Record {
  std::string bytes;
  Record& u16(std::uint32_t x) { return put(x, 2); }
  Record& u32(std::uint32_t x) { return put(x, 4); }
  Record& put(std::uint32_t x, int count) {
    for (int k = 0; k < count; ++k) bytes.push_back(char(x >> (8 * k) & 255));
    return *this;
  }
};

constexpr std::uint32_t first_of_1980 =
    0x21;  // the earliest date there is: the same input gives the same file

// Version needed, flags, method, time, date, checksum, sizes, length of the name, of the extra field.
void common(Record& r, std::uint32_t checksum, std::uint32_t bytes, std::size_t name) {
  r.u16(20).u16(0).u16(0).u16(0).u16(first_of_1980).u32(checksum).u32(bytes).u32(bytes);
  r.u16(std::uint32_t(name)).u16(0);
}

}  // namespace

std::uint32_t crc32(std::string_view bytes) {
  static constexpr auto table = crc_table();
  std::uint32_t c = 0xffffffffu;
  for (const char byte : bytes) c = table[(c ^ std::uint8_t(byte)) & 255] ^ (c >> 8);
  return ~c;
}

void ZipWriter::put(std::string_view bytes) {
  file_.write(bytes);
  written_ += bytes.size();
}

void ZipWriter::add(const std::string& name, std::string_view bytes) {
  if (written_ + bytes.size() > 0xf0000000u)
    throw DeviceError("a .npz file holds less than 4 GiB; write the matrix as .mtx");
  const Entry entry{name, crc32(bytes), std::uint32_t(bytes.size()), std::uint32_t(written_)};
  Record header;
  header.u32(0x04034b50);
  common(header, entry.checksum, entry.bytes, name.size());
  put(header.bytes);
  put(name);
  put(bytes);
  entries_.push_back(entry);
}

void ZipWriter::finish() {
  const auto start = std::uint32_t(written_);
  for (const Entry& e : entries_) {
    Record r;
    r.u32(0x02014b50).u16(20);
    common(r, e.checksum, e.bytes, e.name.size());
    r.u16(0).u16(0).u16(0).u32(0).u32(e.offset);  // comment, disk, attributes
    put(r.bytes);
    put(e.name);
  }
  const auto size = std::uint32_t(written_) - start, count = std::uint32_t(entries_.size());
  Record end;
  end.u32(0x06054b50).u16(0).u16(0).u16(count).u16(count).u32(size).u32(start).u16(0);
  put(end.bytes);
}

}  // namespace clrad
