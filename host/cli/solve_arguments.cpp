#include "cli/solve_arguments.hpp"

#include "solve/check_options.hpp"

namespace clrad::cli {

void SolveArguments::add_to(CLI::App& verb) {
  verb.add_option("--sensors", sensors, "irradiance at points: a file of `x y z nx ny nz` lines");
  device.add_to(verb);
  verb.add_option("--seed", options.seed, "of the samples' places")->capture_default_str();
  verb.add_flag("--strict", options.strict, "a violated invariant is an error");

  const char* accuracy = "Accuracy";
  verb.add_option("--engine", options.engine,
                  "visibility: auto, serial, chop or shaft; all give the same bits")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--grid", grid,
                  "voxels of the engine chop, such as 8x8x8 (default: by cost; one voxel in a small scene)")
      ->group(accuracy);
  verb.add_option("--batch", options.rays_per_batch,
                  "rays that the engine chop handles at a time (default: its own choice)")
      ->group(accuracy);
  verb.add_option("--form-factor", estimator,
                  "exact (contour formula), subdisk (Wallace), disk (as the 1992 paper prints it)")
      ->check(CLI::IsMember({"exact", "subdisk", "disk"}))
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--samples", options.samples, "rays from a receiver to a shooter")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--light-samples", options.light_samples,
                  "shooters get more rays until one carries no more than 1/N of the light")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_flag("--visibility-exact", options.visibility_exact,
                "clip shooters by what stands in the way instead of sampling them: no noise in shadows, at "
                "about the "
                "price of 64 samples")
      ->group(accuracy);
  verb.add_option("--sensor-rays", options.sensor_rays,
                  "rays from a sensor to surfaces; from the end of each goes one more to a lamp")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--converge", options.converge, "stop when unshot / emitted power is below")
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--patch-edge", options.mesh.patch_edge_m,
                  "longest edge of a patch, which shoots [m] (default: extent / 8)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);
  verb.add_option("--element-edge", options.mesh.element_edge_m,
                  "longest edge of an element, which receives [m] (default: extent / 64)")
      ->check(CLI::PositiveNumber)
      ->group(accuracy);

  verb.add_option(
          "--target-error", target_error,
          "solve finer and finer until the estimated error is below, such as 2% (of the sensors where there "
          "are some)")
      ->group(accuracy);
  verb.add_option("--target-of", target_of,
                  "whose error that is: scene (RMS), sensors (RMS), max (worst sensor), or auto")
      ->check(CLI::IsMember({"auto", "scene", "sensors", "max"}))
      ->capture_default_str()
      ->group(accuracy);
  verb.add_option("--time-budget", time_budget,
                  "the best solution in this time, all of the program included, such as 10s")
      ->group(accuracy);
  verb.add_flag("!--no-error", options.error, "do not estimate what the solution is off by")->group(accuracy);
  verb.add_flag("!--no-near-field", options.near_field,
                "light vertices by the average of a patch however near it is")
      ->group(accuracy);

  const char* solving = "Solving";
  verb.add_option(
          "--solver", solver,
          "progressive (shoots), gathering or gauss-seidel (trace every column first): the same answer")
      ->check(CLI::IsMember({"progressive", "gathering", "gauss-seidel"}))
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--shooters", options.shooters,
                  "of the progressive solver: choose the K brightest patches at a time")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(solving);

  verb.add_option("--closure", closure,
                  "make rows of form factors sum to 1: auto (where the scene is proven closed), on (it is "
                  "closed), off")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--checkpoint", options.checkpoint,
                  "keep the state of the solve in this file while it runs")
      ->group(solving);
  verb.add_option("--checkpoint-every", options.checkpoint_every_s,
                  "least seconds between two; they never take more than 5 % of the time")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(solving);
  verb.add_option("--resume", options.resume,
                  "go on from a checkpoint of the same scene: the same bits as without a break")
      ->check(CLI::ExistingFile)
      ->group(solving);

  const char* effects = "Effects (clrad plan says which a scene calls for)";
  verb.add_option("--force-effects", options.force_effects,
                  "run these though nothing calls for them, or all: the same answer, slower")
      ->delimiter(',')
      ->group(effects);
  verb.add_option("--without", options.without,
                  "leave these out though the scene calls for them; the report says what that does")
      ->delimiter(',')
      ->group(effects);

  const char* adaptive = "Adaptive subdivision";
  verb.add_option(
          "--adaptive", options.adaptive.tolerance,
          "split elements across which radiosity differs by more than this x the scene's mean, such as 0.05 "
          "(default: never)")
      ->check(CLI::PositiveNumber)
      ->group(adaptive);
  verb.add_option("--max-level", options.adaptive.max_level, "splits of an element of the first mesh")
      ->capture_default_str()
      ->group(adaptive);
  verb.add_option("--min-area", options.adaptive.min_area_m2, "no smaller elements [m2]")
      ->check(CLI::NonNegativeNumber)
      ->group(adaptive);
  verb.add_option("--min-projected-area", options.adaptive.min_projected_area_px,
                  "no smaller elements in the picture [pixels]; what it does not show is not split")
      ->check(CLI::NonNegativeNumber)
      ->group(adaptive);
  verb.add_option("--refine-every", options.adaptive.every, "shoots between refinements")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(adaptive);
  verb.add_flag("--interpolate-new", options.adaptive.interpolate_new,
                "give new vertices the mean of their neighbours instead of shooting to them: shows the error "
                "that makes")
      ->group(adaptive);
}

void SolveArguments::parse() {
  options.estimator = estimator == "exact"     ? Estimator::exact
                      : estimator == "subdisk" ? Estimator::subdisk
                                               : Estimator::disk;
  options.target_error = target_error.empty() ? 0 : parse_share("--target-error", target_error);
  options.time_budget_s = time_budget.empty() ? 0 : parse_seconds("--time-budget", time_budget);
  options.target_of = target_of == "scene"     ? TargetOf::scene
                      : target_of == "sensors" ? TargetOf::sensors
                      : target_of == "max"     ? TargetOf::worst_sensor
                                               : TargetOf::automatic;
  if (!grid.empty()) options.grid = parse_grid(grid);
  options.closure = closure == "on" ? Closure::on : closure == "off" ? Closure::off : Closure::automatic;
  options.solver = solver == "gathering"      ? Solver::gathering
                   : solver == "gauss-seidel" ? Solver::gauss_seidel
                                              : Solver::progressive;
  check_options(options);
}

}  // namespace clrad::cli
