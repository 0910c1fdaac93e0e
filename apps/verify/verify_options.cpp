#include "apps/verify/verify_options.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <cstdint>
#include <limits>

#include "apps/session/help.h"

namespace strata::apps {
namespace {

constexpr const char* kExamples =
    R"(Compare Strata's result of a Boolean tree with that of CGAL's exact Booleans.

  strata-verify plate.csg
  strata-verify plate.stl holes.stl --expr 'plate - holes'
  strata-verify plate.csg --against plate.stl      are the two the same solid?

Compares volume, area, and inside or outside at voxel centres and random points.
A difference within the bounds of the method is allowed: the area times the
length of a voxel for volumes, 1/256 voxel from a surface for points. Volumes of
the solids on a lattice, as `strata mesh` makes them, must be equal as fractions.

Exit code 0: they agree, 7: they differ, 5: CGAL cannot process a solid.
)";

/// Holds an option to whole numbers from `least` to `most`.
CLI::Validator range(std::int64_t least, std::int64_t most) {
  return CLI::Validator(
      [=](const std::string& text) {
        std::int64_t value = 0;
        const bool whole = CLI::detail::lexical_cast(text, value);
        if (whole && value >= least && value <= most) return std::string();
        return fmt::format("must be {} to {}, got {}", least, most, text);
      },
      "");
}

}  // namespace

void define_verify_options(CLI::App& app, VerifyWords& words) {
  app.description(kExamples);
  app.footer("`strata --help` lists the other exit codes.");
  define_help(app);
  app.set_version_flag("-V,--version", "strata-verify " STRATA_VERSION,
                       "Print the version and exit")
      ->group("Help");
  const char* input = "Input";
  app.add_option("INPUT", words.command.input.files, "A scene (.csg .scad) or meshes")
      ->required()
      ->type_name("")
      ->group(input);
  app.add_option("--expr", words.command.input.expression,
                 "Boolean expression over the inputs, as for strata csg")
      ->type_name("EXPR")
      ->group(input);
  app.add_option("--against", words.against,
                 "Scene or mesh that CGAL evaluates instead of the input")
      ->type_name("FILE")
      ->group(input);
  const char* compared = "Comparison";
  app.add_option(
         "--resolution", words.options.resolution,
         "Voxels along the longest side of the grid that is compared, 1 to 1024 (default: " +
             std::to_string(words.options.resolution) + ")")
      ->check(range(1, 1024))
      ->type_name("N")
      ->group(compared);
  app.add_option("--points", words.options.points,
                 "Random points to compare, 0 to 100000000 (default: " +
                     std::to_string(words.options.points) + ")")
      ->check(range(0, 100'000'000))
      ->type_name("N")
      ->group(compared);
  app.add_option("--seed", words.options.seed,
                 "Seed of the random points, a whole number (default: " +
                     std::to_string(words.options.seed) + ")")
      ->check(range(0, std::numeric_limits<std::int64_t>::max()))
      ->type_name("N")
      ->group(compared);
  const char* running = "Running";
  app.add_option("-j,--threads", words.command.common.threads,
                 "Number of Strata's threads, 0 to 4096; 0 means one per processor (default: 0); "
                 "CGAL uses one")
      ->check(range(0, 4096))
      ->type_name("N")
      ->group(running);
  app.add_flag("-q,--quiet", words.command.common.quiet, "Print errors only")->group(running);
  app.add_flag("--strict", words.command.common.strict,
               "Treat warnings as errors, with exit code 5")
      ->group(running);
  app.add_option("--json", words.json,
                 "Write a report for programs to FILE (default: to standard output)")
      ->expected(0, 1)
      ->type_name("[=FILE]")
      ->default_str("-")
      ->group(running);
}

}  // namespace strata::apps
