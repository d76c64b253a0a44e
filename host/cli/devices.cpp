#include <fmt/format.h>

#include "cli/cli.hpp"

namespace clrad::cli {

void add_devices(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("devices", "list OpenCL devices");
  verb->callback([&action] {
    action = [] {
      const auto devices = list_devices();
      if (devices.empty()) {
        fmt::print(stderr,
                   "no OpenCL device found. On Debian, `apt install pocl-opencl-icd` gives one that runs on "
                   "the CPU; a GPU needs "
                   "its vendor's driver.\n");
        return int(failure);
      }
      for (const auto& d : devices)
        fmt::print(
            "{}: {}\n   {}, {}, driver {}\n   {}, {} compute units, {:.1f} GiB (one buffer: {:.1f} GiB), "
            "{}\n",
            d.index, d.name, d.platform, d.version, d.driver, d.gpu ? "GPU" : "CPU", d.compute_units,
            double(d.memory_bytes) / (1 << 30), double(d.largest_buffer_bytes) / (1 << 30),
            d.fp64 ? "double precision" : "no double precision");
      return int(done);
    };
  });
}

}  // namespace clrad::cli
