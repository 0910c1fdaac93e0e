#pragma once

#include <string>
#include <vector>

#include "strata/transparency/media/media.h"

namespace strata::transparency {

inline constexpr std::size_t kMostParticles = std::size_t{1} << 30;

/// Reads particles from a CSV file and adds them. A line is x, y, z, radius, or those and the red,
/// green and blue parts of extinction and albedo. A first line without numbers is a heading.
/// @param common  extinction and albedo of lines with four numbers @return kInput naming the file
/// and the line
Result<void> read_particles(const std::string& path, const Particle& common,
                            std::vector<Particle>& particles);

}  // namespace strata::transparency
