#pragma once

#include <boost/multiprecision/gmp.hpp>
#include <cstddef>
#include <utility>
#include <vector>

namespace strata::apps {

using Fraction = boost::multiprecision::mpq_rational;

/// An exact sum of fractions. Denominators grow with the number of terms, so sums of 1, 2, 4, ...
/// terms are kept, and two of a size are joined.
class FractionSum {
 public:
  void add(Fraction term) {
    std::size_t level = 0;
    for (; level < parts_.size() && parts_[level] != 0; ++level) {
      term += std::exchange(parts_[level], 0);
    }
    if (level == parts_.size()) parts_.emplace_back(0);
    parts_[level] = std::move(term);
  }
  Fraction total() const {
    Fraction sum = 0;
    for (const Fraction& part : parts_) sum += part;
    return sum;
  }

 private:
  std::vector<Fraction> parts_;  ///< 0: none
};

}  // namespace strata::apps
