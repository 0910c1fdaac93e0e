// Must not compile: these lists keep no payload.
#include <strata/lists.h>

int main() {
  auto lists = strata::OnePassDepthLists::create(4, 4);
  lists->insert(1, 1, 5, 7);
}
