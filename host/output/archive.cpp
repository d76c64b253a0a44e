#include "output/archive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>

#include "output/json_depth.hpp"
#include "version.hpp"

namespace clrad {
namespace {

// The bytes 0x89 and \r\n show a file that went through a transfer as text.
constexpr char magic[] =
    "\x89"
    "CLRAD\r\n";
constexpr std::size_t magic_bytes = 8;

struct Header {
  char magic[magic_bytes];
  std::uint32_t format, sections;
  char kind[16], program[16];  // padded with zeros
  std::uint64_t bytes, body_checksum, header_checksum;
};
static_assert(sizeof(Header) == 72 && offsetof(Header, kind) == 16 && offsetof(Header, bytes) == 48,
              "written as it lies in memory");

struct SectionHead {
  std::uint32_t name_bytes, type;
  std::uint64_t count;
};
static_assert(sizeof(SectionHead) == 16);

std::uint64_t header_checksum(const Header& header) {
  Checksum checksum;
  checksum.add(&header, offsetof(Header, header_checksum));
  return checksum.value();
}

std::uint64_t value_bytes(ArchiveType type) {
  switch (type) {
    case ArchiveType::uint8:
      return 1;
    case ArchiveType::uint32:
    case ArchiveType::float32:
      return 4;
    case ArchiveType::uint64:
    case ArchiveType::float64:
      return 8;
  }
  return 0;
}

std::string padded_text(const char (&field)[16]) {
  return std::string(field, std::find(field, field + sizeof field, '\0'));
}

std::string described(const std::string& kind) {
  if (kind == "solution") return "a finished solution";
  if (kind == "checkpoint") return "a checkpoint of a running solve";
  return "a '" + kind + "'";
}

}  // namespace

ArchiveWriter::ArchiveWriter(const std::string& path, const std::string& kind) : file_(path), kind_(kind) {
  if (kind.size() >= sizeof Header::kind) throw UsageError("the kind of an archive has at most 15 bytes");
  const Header later{};
  file_.write(&later, sizeof later);
  bytes_ = sizeof later;
}

void ArchiveWriter::put(const void* data, std::size_t bytes) {
  file_.write(data, bytes);
  checksum_.add(data, bytes);
  bytes_ += bytes;
}

void ArchiveWriter::add_bytes(const std::string& name, ArchiveType type, std::uint64_t count,
                              const void* data, std::size_t bytes) {
  if (name.empty() || name.size() > 255 || !names_.insert(name).second)
    throw UsageError(fmt::format("'{}' cannot be the name of another section of an archive", name));
  const SectionHead head{std::uint32_t(name.size()), std::uint32_t(type), count};
  put(&head, sizeof head);
  put(name.data(), name.size());
  put(data, bytes);
}

void ArchiveWriter::finish() {
  Header header{};
  std::memcpy(header.magic, magic, magic_bytes);
  header.format = archive_format;
  header.sections = std::uint32_t(names_.size());
  std::copy(kind_.begin(), kind_.end(), header.kind);
  std::strncpy(header.program, version, sizeof header.program - 1);
  header.bytes = bytes_;
  header.body_checksum = checksum_.value();
  header.header_checksum = header_checksum(header);
  file_.rewrite(0, &header, sizeof header);
  file_.commit();
}

ArchiveReader::ArchiveReader(const std::string& path, const std::string& kind) : path_(path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) fail("is a folder, not a file of clrad's");
  errno = 0;
  file_.open(path, std::ios::binary);
  if (!file_) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
  size_ = std::filesystem::file_size(path, status);
  if (status) fail(fmt::format("cannot be read: {}", status.message()));
  check_header(kind);
  check_body();
  list_sections();
}

void ArchiveReader::fail(const std::string& reason) const {
  // Names in a damaged file may be anything.
  std::string shown = reason;
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  throw InputError(fmt::format("{}: {}", path_, shown));
}

void ArchiveReader::read_at(std::uint64_t offset, void* to, std::uint64_t bytes) {
  file_.clear();
  file_.seekg(std::streamoff(offset));
  if (bytes > 0) file_.read(static_cast<char*>(to), std::streamsize(bytes));
  if (!file_) fail("reading failed before its end");
}

// The version comes before all but the magic number: what follows may lie elsewhere in another version's header.
void ArchiveReader::check_header(const std::string& kind) {
  Header header{};
  read_at(0, &header, std::min<std::uint64_t>(size_, sizeof header));
  if (std::memcmp(header.magic, magic, std::min<std::uint64_t>(size_, magic_bytes)) != 0 || size_ == 0)
    fail("is not a file of clrad's");
  if (size_ < sizeof header) fail(fmt::format("is cut short: it ends after {} bytes", size_));
  if (header.format != archive_format)
    fail(fmt::format("is written in version {} of the format, and this clrad reads version {}", header.format,
                     archive_format));
  if (header.header_checksum != header_checksum(header)) fail("is damaged: the header's checksum is wrong");
  if (const std::string is = padded_text(header.kind); is != kind)
    fail(fmt::format("is {}, and {} is needed", described(is), described(kind)));
  if (size_ < header.bytes) fail(fmt::format("is cut short: it has {} of its {} bytes", size_, header.bytes));
  if (size_ > header.bytes) fail(fmt::format("is damaged: {} bytes follow its end", size_ - header.bytes));
  program_ = padded_text(header.program);
  body_checksum_ = header.body_checksum;
  section_count_ = header.sections;
}

void ArchiveReader::check_body() {
  Checksum checksum;
  std::vector<char> piece(std::size_t(1) << 20);
  for (std::uint64_t at = sizeof(Header); at < size_; at += piece.size()) {
    piece.resize(std::min<std::uint64_t>(piece.size(), size_ - at));
    read_at(at, piece.data(), piece.size());
    checksum.add(piece.data(), piece.size());
  }
  if (checksum.value() != body_checksum_) fail("is damaged: its checksum is wrong");
}

void ArchiveReader::list_sections() {
  std::uint64_t at = sizeof(Header);
  for (std::uint32_t s = 0; s < section_count_; ++s) {
    SectionHead head{};
    if (size_ - at < sizeof head) fail("is damaged: a section is missing");
    read_at(at, &head, sizeof head);
    at += sizeof head;
    const std::uint64_t each = value_bytes(ArchiveType(head.type));
    if (each == 0 || head.name_bytes > 255 || head.name_bytes > size_ - at)
      fail("is damaged: a section has no such name or type");
    std::string name(head.name_bytes, '\0');
    read_at(at, name.data(), name.size());
    at += name.size();
    if (head.count > (size_ - at) / each)
      fail(fmt::format("is damaged: section '{}' passes the file's end", name));
    const Section section{ArchiveType(head.type), head.count, at, head.count * each};
    if (!sections_.emplace(name, section).second)
      fail(fmt::format("is damaged: section '{}' appears twice", name));
    at += section.bytes;
  }
  if (at != size_) fail("is damaged: something follows the last section");
}

const ArchiveReader::Section& ArchiveReader::find(const std::string& name, ArchiveType type) const {
  const auto found = sections_.find(name);
  if (found == sections_.end()) fail(fmt::format("lacks the section '{}'", name));
  if (found->second.type != type) fail(fmt::format("section '{}' is of another type than expected", name));
  return found->second;
}

void ArchiveReader::expect_count(const std::string& name, ArchiveType type, std::uint64_t count) const {
  const std::uint64_t is = find(name, type).count;
  if (is != count) fail(fmt::format("section '{}' has {} values, not {}", name, is, count));
}

void ArchiveReader::read(const std::string& name, void* to) {
  const Section& section = sections_.at(name);
  read_at(section.offset, to, section.bytes);
}

nlohmann::json ArchiveReader::json(const std::string& name) {
  const std::vector<std::uint8_t> bytes = array<std::uint8_t>(name);
  if (nests_too_deeply({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                       nlohmann::json::input_format_t::cbor))
    fail(
        fmt::format("section '{}' cannot be understood: it nests deeper than {} levels", name, deepest_json));
  try {
    return nlohmann::json::from_cbor(bytes);
  } catch (const nlohmann::json::exception& e) {
    fail(fmt::format("section '{}' cannot be understood: {}", name, e.what()));
  }
}

}  // namespace clrad
