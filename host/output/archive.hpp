// The container of clrad's own binary files: named arrays behind a header that says what they are, with a checksum over
// every byte.
//
//   header   magic (8 bytes), format version (u32), sections (u32), kind (16 bytes), clrad's version (16 bytes), bytes of
//            the whole file (u64), checksum of all that follows the header (u64), checksum of the header so far (u64)
//   section  length of the name (u32), type (u32), values (u64), the name, the values; one after the other
//
// Little-endian, no padding. Small things of many shapes are one array of bytes that hold a JSON value as CBOR (RFC 8949),
// which unlike JSON's text keeps every double and every name, UTF-8 or not, to the bit.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "clrad/error.hpp"
#include "output/checksum.hpp"
#include "output/file.hpp"

namespace clrad {

static_assert(std::endian::native == std::endian::little, "clrad's files hold arrays as they lie in memory");

/// Raised whenever files of before can no longer be read as they are meant.
constexpr std::uint32_t archive_format = 7;

enum class ArchiveType : std::uint32_t { uint8 = 1, uint32, uint64, float32, float64 };

template <class T>
constexpr ArchiveType archive_type() {
  if constexpr (std::is_same_v<T, std::uint8_t>) return ArchiveType::uint8;
  if constexpr (std::is_same_v<T, std::uint32_t>) return ArchiveType::uint32;
  if constexpr (std::is_same_v<T, std::uint64_t>) return ArchiveType::uint64;
  if constexpr (std::is_same_v<T, float>) return ArchiveType::float32;
  if constexpr (std::is_same_v<T, double>) return ArchiveType::float64;
}

/// Writes section by section, straight into the file; nothing stands under `path` before finish(). Throws DeviceError that
/// names the path. `kind` and names: at most 15 and 255 bytes.
class ArchiveWriter {
 public:
  ArchiveWriter(const std::string& path, const std::string& kind);

  template <class T>
  void add(const std::string& name, std::span<const T> values) {
    add_bytes(name, archive_type<T>(), values.size(), values.data(), values.size_bytes());
  }
  template <class T>
  void add(const std::string& name, const std::vector<T>& values) {
    add(name, std::span<const T>(values));
  }
  void add_json(const std::string& name, const nlohmann::json& value) {
    add(name, nlohmann::json::to_cbor(value));
  }

  void finish();

 private:
  void add_bytes(const std::string& name, ArchiveType type, std::uint64_t count, const void* data,
                 std::size_t bytes);
  void put(const void* data, std::size_t bytes);

  FileWriter file_;
  std::string kind_;
  std::set<std::string> names_;
  Checksum checksum_;
  std::uint64_t bytes_ = 0;
};

/// An archive whose checksums hold. The constructor and every read throw InputError "path: ..." with the reason: it is no
/// file of clrad's, is of another kind or format, is cut short, is damaged, or lacks what is asked for.
class ArchiveReader {
 public:
  ArchiveReader(const std::string& path, const std::string& kind);

  const std::string& program() const { return program_; }  ///< clrad's version that wrote it
  bool has(const std::string& name) const { return sections_.count(name) != 0; }
  nlohmann::json json(const std::string& name);
  template <class T>
  std::vector<T> array(const std::string& name) {
    std::vector<T> values(find(name, archive_type<T>()).count);
    read(name, values.data());
    return values;
  }
  /// The same, of exactly `count` values.
  template <class T>
  std::vector<T> array(const std::string& name, std::uint64_t count) {
    expect_count(name, archive_type<T>(), count);
    return array<T>(name);
  }

  /// The same, of floating-point numbers that are all finite.
  template <class T>
  std::vector<T> finite(const std::string& name) {
    std::vector<T> values = array<T>(name);
    for (const T v : values)
      if (!std::isfinite(v)) fail("section '" + name + "' holds a number that is not finite");
    return values;
  }
  template <class T>
  std::vector<T> finite(const std::string& name, std::uint64_t count) {
    expect_count(name, archive_type<T>(), count);
    return finite<T>(name);
  }

  [[noreturn]] void fail(const std::string& reason) const;

 private:
  struct Section {
    ArchiveType type;
    std::uint64_t count, offset, bytes;
  };
  void check_header(const std::string& kind);
  void check_body();
  void list_sections();
  const Section& find(const std::string& name, ArchiveType type) const;
  void expect_count(const std::string& name, ArchiveType type, std::uint64_t count) const;
  void read(const std::string& name, void* to);
  void read_at(std::uint64_t offset, void* to, std::uint64_t bytes);

  std::string path_, program_;
  std::ifstream file_;
  std::uint64_t size_ = 0, body_checksum_ = 0;
  std::uint32_t section_count_ = 0;
  std::map<std::string, Section> sections_;
};

}  // namespace clrad
