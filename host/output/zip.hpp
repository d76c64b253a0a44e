// A zip archive whose files are stored as they are (PKWARE APPNOTE 6.3.10, method 0): what .npz is made of.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "output/file.hpp"

namespace clrad {

class ZipWriter {
 public:
  explicit ZipWriter(FileWriter& file) : file_(file) {}
  /// Throws DeviceError where the archive would pass 4 GiB, the format's limit.
  void add(const std::string& name, std::string_view bytes);
  /// The directory; nothing may be added after it.
  void finish();

 private:
  struct Entry {
    std::string name;
    std::uint32_t checksum, bytes, offset;
  };
  FileWriter& file_;
  std::vector<Entry> entries_;
  std::uint64_t written_ = 0;
  void put(std::string_view bytes);
};

/// CRC-32 as zip and PNG use it (reflected, polynomial 0x04C11DB7).
std::uint32_t crc32(std::string_view bytes);

}  // namespace clrad
