#include "output/archive.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "clrad/output.hpp"
#include "output/damage.hpp"
#include "output/support.hpp"

namespace clrad {
namespace {

using nlohmann::json;

constexpr double inf = std::numeric_limits<double>::infinity();

class Archive : public test::FileTest {
 protected:
  std::string sample() {
    const std::string path = in_folder("a.clrad");
    ArchiveWriter writer(path, "solution");
    writer.add_json("small", {{"a", 1}, {"b", "text"}});
    writer.add("bytes", std::vector<std::uint8_t>{1, 2, 3});
    writer.add("numbers", std::vector<double>{0.1, -0.0, inf});
    writer.add("nothing", std::vector<float>{});
    writer.finish();
    return path;
  }

  std::string refusal(const std::string& path, const std::string& kind = "solution") {
    try {
      ArchiveReader reader(path, kind);
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).rfind(path + ": ", 0), 0u) << e.what();
      return e.what();
    }
    return "accepted";
  }

  // True when it was refused; else everything is read, which may be refused, too.
  static bool refused(const std::string& path) {
    try {
      ArchiveReader reader(path, "solution");
      reader.json("small");
      reader.array<std::uint8_t>("bytes", 3);
      reader.array<double>("numbers", 3);
      reader.array<float>("nothing", 0);
    } catch (const InputError&) {
      return true;
    }
    return false;
  }
};

TEST_F(Archive, GivesBackWhatWasPutInToTheBit) {
  const std::string path = in_folder("a.clrad");
  const std::vector<std::uint8_t> bytes{0, 255, 7};
  const std::vector<std::uint32_t> words{0xffffffffu, 1};
  const std::vector<std::uint64_t> longs{~std::uint64_t(0)};
  const std::vector<float> floats{1.5f, -0.0f, std::nanf("7")};
  const std::vector<double> doubles{0.1, -0.0, inf, std::nan("123"),
                                    std::numeric_limits<double>::denorm_min()};
  const std::string not_utf8 = "W\xe4nde";
  {
    ArchiveWriter writer(path, "checkpoint");
    writer.add("bytes", bytes);
    writer.add("words", words);
    writer.add_json("json", {{"tenth", 0.1},
                             {"minus zero", -0.0},
                             {"inf", inf},
                             {"nan", std::nan("")},
                             {"name", not_utf8},
                             {"large", ~std::uint64_t(0)}});
    writer.add("longs", longs);
    writer.add("floats", floats);
    writer.add("doubles", doubles);
    writer.add("none", std::vector<double>{});
    writer.finish();
  }
  ArchiveReader reader(path, "checkpoint");
  EXPECT_EQ(reader.array<std::uint8_t>("bytes"), bytes);
  EXPECT_EQ(reader.array<std::uint32_t>("words"), words);
  EXPECT_EQ(reader.array<std::uint64_t>("longs", 1), longs);
  const auto f = reader.array<float>("floats", 3);
  EXPECT_EQ(std::memcmp(f.data(), floats.data(), 3 * sizeof(float)), 0);
  const auto d = reader.array<double>("doubles");
  ASSERT_EQ(d.size(), doubles.size());
  EXPECT_EQ(std::memcmp(d.data(), doubles.data(), d.size() * sizeof(double)), 0);
  EXPECT_TRUE(reader.array<double>("none").empty());
  const json j = reader.json("json");
  EXPECT_EQ(j["tenth"].get<double>(), 0.1);
  EXPECT_TRUE(std::signbit(j["minus zero"].get<double>()));
  EXPECT_EQ(j["inf"].get<double>(), inf);
  EXPECT_TRUE(std::isnan(j["nan"].get<double>()));
  EXPECT_EQ(j["name"].get<std::string>(), not_utf8);
  EXPECT_EQ(j["large"].get<std::uint64_t>(), ~std::uint64_t(0));
  EXPECT_TRUE(reader.has("none"));
  EXPECT_FALSE(reader.has("more"));
  EXPECT_FALSE(reader.program().empty());
}

TEST_F(Archive, NothingStandsThereBeforeItIsFinished) {
  write_file(in_folder("a.clrad"), "before");
  {
    ArchiveWriter writer(in_folder("a.clrad"), "solution");
    writer.add("numbers", std::vector<double>(1000, 1.0));
    EXPECT_EQ(bytes(in_folder("a.clrad")), "before");
  }
  EXPECT_EQ(bytes(in_folder("a.clrad")), "before");
  EXPECT_EQ(files(), 1u);
}

TEST_F(Archive, RefusesWithTheReason) {
  const std::string path = sample(), whole = bytes(path);
  const auto refusal_of = [&](const std::string& content) {
    write_file(in_folder("b.clrad"), content);
    return refusal(in_folder("b.clrad"));
  };
  const auto says = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message << " instead of: " << part;
  };
  EXPECT_EQ(refusal_of(whole), "accepted");
  says(refusal(in_folder("missing")), "cannot be read");
  std::filesystem::create_directories(in_folder("folder"));
  says(refusal(in_folder("folder")), "is a folder");
  says(refusal_of(""), "is not a file of clrad's");
  says(refusal_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "is not a file of clrad's");
  says(refusal(path, "checkpoint"), "is a finished solution, and a checkpoint of a running solve is needed");

  std::string other = whole;
  other[8] = char(archive_format + 1);
  says(refusal_of(other), fmt::format("version {} of the format, and this clrad reads version {}",
                                      archive_format + 1, archive_format));
  says(refusal_of(whole.substr(0, 30)), "is cut short: it ends after 30 bytes");
  says(refusal_of(whole.substr(0, whole.size() - 1)),
       fmt::format("is cut short: it has {} of its {} bytes", whole.size() - 1, whole.size()));
  says(refusal_of(whole + "x"), "is damaged: 1 bytes follow its end");
  other = whole;
  other[50] ^= 1;
  says(refusal_of(other), "header's checksum is wrong");
  other = whole;
  other[other.size() - 5] ^= 16;
  says(refusal_of(other), "its checksum is wrong");

  ArchiveReader reader(path, "solution");
  const auto failure = [](auto&& read) -> std::string {
    try {
      read();
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  says(failure([&] { reader.array<double>("more"); }), "lacks the section 'more'");
  says(failure([&] { reader.array<float>("numbers"); }), "'numbers' is of another type");
  says(failure([&] { reader.array<double>("numbers", 4); }), "'numbers' has 3 values, not 4");
  says(failure([&] { reader.json("bytes"); }), "'bytes' cannot be understood");
}

// A CRC notices every change of up to 64 bits in a row, so each of these is refused for certain.
TEST_F(Archive, EveryFlippedBitAndEveryCutIsRefused) {
  const std::string path = sample(), whole = bytes(path), damaged = in_folder("b.clrad");
  ASSERT_FALSE(refused(path));
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      std::string other = whole;
      other[at] = char(other[at] ^ 1 << bit);
      test::overwrite(damaged, other);
      EXPECT_TRUE(refused(damaged)) << "bit " << bit << " of byte " << at;
    }
  for (std::size_t length = 0; length < whole.size(); ++length) {
    test::overwrite(damaged, whole.substr(0, length));
    EXPECT_TRUE(refused(damaged)) << length << " bytes";
  }
}

// As a faulty or malicious program might write it: wrong inside, with checksums that hold. It may be refused or read, and
// nothing else; lengths must never be believed beyond the file's end.
TEST_F(Archive, ForgedContentDoesNoHarm) {
  const std::string path = sample(), whole = bytes(path), forged = in_folder("b.clrad");
  std::size_t refusals = 0, tries = 0;
  for (std::size_t at = test::header_bytes; at < whole.size(); ++at)
    for (const int value : {0, 1, 0x7f, 0x80, 0xff}) {
      std::string other = whole;
      other[at] = char(value);
      test::overwrite(forged, test::with_right_checksums(other));
      refusals += refused(forged), ++tries;
    }
  EXPECT_GT(refusals, tries / 4);
  test::overwrite(forged, test::with_right_checksums(whole));
  EXPECT_FALSE(refused(forged)) << "the checksums are made right";
}

TEST_F(Archive, NamesAreUsedOnce) {
  ArchiveWriter writer(in_folder("a.clrad"), "solution");
  writer.add("a", std::vector<double>{1});
  EXPECT_THROW(writer.add("a", std::vector<double>{2}), UsageError);
  EXPECT_THROW(writer.add("", std::vector<double>{2}), UsageError);
  EXPECT_THROW(ArchiveWriter(in_folder("b.clrad"), "sixteen letters!"), UsageError);
}

}  // namespace
}  // namespace clrad
