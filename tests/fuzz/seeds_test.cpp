// The seeds of the fuzzers, what crashed the program once among them: each is read, or refused with an InputError or
// UsageError; any other exception fails, and a crash does so anyhow. The files say what they are by their folder.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "clrad/output.hpp"
#include "fuzz/targets.hpp"
#include "output/archive.hpp"

namespace clrad::fuzz {
namespace {

namespace fs = std::filesystem;
const fs::path seeds = CLRAD_TEST_DATA "/../fuzz/seeds";

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void take(void (*target)(Bytes), const std::string& bytes) {
  target({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

void run_all(const std::string& name, void (*target)(Bytes)) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(seeds / name)) {
    const std::string bytes = bytes_of(entry.path());
    ++count;
    EXPECT_NO_THROW(take(target, bytes)) << entry.path();
    // Cut anywhere it is still only input.
    for (const std::size_t parts : {2, 3, 7})
      EXPECT_NO_THROW(take(target, bytes.substr(0, bytes.size() / parts))) << entry.path();
  }
  EXPECT_GE(count, 1u) << name;
}

TEST(Fuzz, ObjSeeds) {
  run_all("obj", obj);
}
TEST(Fuzz, GltfSeeds) {
  run_all("gltf", gltf);
}
TEST(Fuzz, SensorSeeds) {
  run_all("sensors", sensors);
}
TEST(Fuzz, CheckpointSeeds) {
  run_all("checkpoint", checkpoint);
}
TEST(Fuzz, SolutionSeeds) {
  run_all("solution", solution);
}
TEST(Fuzz, OptionSeeds) {
  run_all("options", options);
}

// Archives of another format are refused at once, and what lies behind would be read by no seed.
TEST(Fuzz, ArchivesAreOfTodaysFormat) {
  for (const char* kind : {"checkpoint", "solution"})
    for (const auto& entry : fs::directory_iterator(seeds / kind))
      EXPECT_EQ(bytes_of(entry.path()).at(8), char(archive_format)) << entry.path();
  EXPECT_NO_THROW(load_solution((seeds / "solution/adaptive").string()));
  EXPECT_NO_THROW(ArchiveReader((seeds / "checkpoint/adaptive").string(), "checkpoint"));
}

// The targets do tell a finding from an answer.
TEST(Fuzz, AFindingIsNoErrorOfTheProgram) {
  EXPECT_THROW(require(false, "x"), Finding);
  EXPECT_THROW(require_message("a.obj: one\ntwo", "/tmp/a.obj"), Finding);
  EXPECT_THROW(require_message("no file", "/tmp/a.obj"), Finding);
  EXPECT_NO_THROW(require_message("/tmp/a.obj:3: why", "/tmp/a.obj"));
}

}  // namespace
}  // namespace clrad::fuzz
