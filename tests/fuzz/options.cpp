#include <CLI/CLI.hpp>

#include "cli/cli.hpp"
#include "clrad/error.hpp"
#include "fuzz/targets.hpp"

namespace clrad::fuzz {
namespace {

// A verb with the words after it, on files that are not there: all that is done before one is opened.
void run_verb(const std::string& verb, const std::vector<std::string>& words) {
  CLI::App app("clrad");
  app.require_subcommand(1);
  cli::Action action;
  cli::add_solve(app, action);
  cli::add_render(app, action);
  cli::add_check(app, action);
  std::vector<std::string> arguments(words.rbegin(), words.rend());  // CLI11 takes them from the back
  arguments.push_back("/nowhere/scene.obj");
  arguments.push_back(verb);
  try {
    app.parse(arguments);
    if (verb != "check") action();  // check prints what it finds
  } catch (const CLI::ParseError&) {
  } catch (const UsageError&) {
  } catch (const InputError&) {
  }
}

template <class Parse>
void refuse_or_take(Parse parse) {
  try {
    parse();
  } catch (const UsageError&) {
  }
}

}  // namespace

void options(Bytes bytes) {
  std::vector<std::string> words(1);
  for (const std::uint8_t c : bytes) {
    if (c == 0) return;  // no command line holds one
    if (c == '\n')
      words.emplace_back();
    else
      words.back().push_back(char(c));
  }
  for (const char* verb : {"solve", "render", "check"}) run_verb(verb, words);
  for (const std::string& word : words) {
    refuse_or_take([&] { require(cli::parse_bytes(word) > 0 || word[0] == '0', "no bytes: " + word); });
    refuse_or_take([&] { require(cli::parse_unit(word) > 0, "a unit without length"); });
    refuse_or_take([&] { cli::parse_size(word); });
    refuse_or_take([&] { cli::parse_grid(word); });
    Scene scene;
    scene.cameras.resize(1);
    refuse_or_take([&] {
      const Camera c = cli::choose_camera(word, scene, 1);
      for (int k = 0; k < 3; ++k)
        require(std::isfinite(c.eye[k]) && std::isfinite(c.target[k]), "a camera nowhere");
    });
  }
}

}  // namespace clrad::fuzz
