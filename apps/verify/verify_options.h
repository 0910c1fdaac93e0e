#pragma once

#include <string>

#include "apps/commands/commands.h"
#include "apps/verify/comparison.h"

namespace CLI {
class App;
}

namespace strata::apps {

/// The command line of strata-verify.
struct VerifyWords {
  CsgCommand command;  ///< inputs, expression, threads, quiet and strict
  std::string against, json;
  bool has_json = false;
  VerifyOptions options;
};

void define_verify_options(CLI::App& app, VerifyWords& words);

}  // namespace strata::apps
