// Programs whose parameters the window shows. What is found can be written and read again.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "apps/view/files/customizer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata::view;
  const std::string_view program(reinterpret_cast<const char*>(data), size);
  for (const Parameter& parameter : parse_parameters(program)) {
    if (parameter.name.empty() || parameter.line < 1 || parameter.tab == "Hidden") std::abort();
    if (parameter.least && !(*parameter.least < *parameter.most)) std::abort();
    if (parse_literal(literal_of(parameter.value)) != parameter.value) std::abort();
    const auto again = parse_value(parameter, text_of(parameter.value));
    if (!again || *again != parameter.value) std::abort();
    for (const auto& choice : parameter.choices) {
      if (choice.value.index() != parameter.value.index()) std::abort();
    }
  }
  return 0;
}
