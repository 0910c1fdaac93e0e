#pragma once

#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "apps/commands/commands.h"

// The words that command lines and reports have for choices, for parse_choice() and word_of().

namespace strata::apps {

inline constexpr std::pair<std::string_view, InsideRule> kRuleWords[] = {
    {"winding", InsideRule::kWinding},
    {"nonzero", InsideRule::kNonzero},
    {"parity", InsideRule::kParity}};
inline constexpr std::pair<std::string_view, OpenMode> kOpenModeWords[] = {
    {"vote", OpenMode::kVote}, {"surface", OpenMode::kSurface}, {"fail", OpenMode::kFail}};
inline constexpr std::pair<std::string_view, SurfaceKind> kSurfaceKindWords[] = {
    {"conservative", SurfaceKind::kConservative}, {"26", SurfaceKind::k26}, {"6", SurfaceKind::k6}};
inline constexpr std::pair<std::string_view, StoreKind> kStoreWords[] = {
    {"ha", StoreKind::kHaBuffer}, {"scan", StoreKind::kCountScan}, {"auto", StoreKind::kAuto}};
inline constexpr std::pair<std::string_view, OffsetKind> kOffsetWords[] = {
    {"plane-first", OffsetKind::kPlaneFirst},
    {"random", OffsetKind::kRandom},
    {"farthest", OffsetKind::kFarthestPoint}};
inline constexpr std::pair<std::string_view, Backend> kBackendWords[] = {
    {"auto", Backend::kAuto}, {"cpu", Backend::kCpu}, {"gl", Backend::kGl}};
inline constexpr std::pair<std::string_view, ProgressMode> kProgressWords[] = {
    {"auto", ProgressMode::kAuto}, {"bar", ProgressMode::kBar}, {"none", ProgressMode::kNone}};
inline constexpr std::pair<std::string_view, MeshReader> kReaderWords[] = {
    {"own", MeshReader::kOwn}, {"openmesh", MeshReader::kOpenMesh}};
inline constexpr std::pair<std::string_view, MeshFormat> kMeshFormatWords[] = {
    {"auto", MeshFormat::kAuto}, {"obj", MeshFormat::kObj},   {"stl", MeshFormat::kStl},
    {"ply", MeshFormat::kPly},   {"off", MeshFormat::kOff},   {"3mf", MeshFormat::k3mf},
    {"amf", MeshFormat::kAmf},   {"gltf", MeshFormat::kGltf}, {"glb", MeshFormat::kGltf}};
inline constexpr std::pair<std::string_view, SolidFormat> kSolidFormatWords[] = {
    {"3mf", SolidFormat::k3mf},
    {"stl", SolidFormat::kStl},
    {"obj", SolidFormat::kObj},
    {"ply", SolidFormat::kPly},
    {"off", SolidFormat::kOff}};
/// The words of --unit, and as a 3MF spells them.
inline constexpr std::pair<std::string_view, LengthUnit> kLengthWords[] = {
    {"um", LengthUnit::kMicron},
    {"mm", LengthUnit::kMillimetre},
    {"cm", LengthUnit::kCentimetre},
    {"m", LengthUnit::kMetre},
    {"in", LengthUnit::kInch},
    {"ft", LengthUnit::kFoot},
    {"micron", LengthUnit::kMicron},
    {"millimeter", LengthUnit::kMillimetre},
    {"centimeter", LengthUnit::kCentimetre},
    {"meter", LengthUnit::kMetre},
    {"inch", LengthUnit::kInch},
    {"foot", LengthUnit::kFoot}};
[[nodiscard]] constexpr double metres_of(LengthUnit unit) {
  constexpr double kMetres[] = {1e-6, 1e-3, 1e-2, 1.0, 0.0254, 0.3048};
  return kMetres[static_cast<int>(unit)];
}
inline constexpr std::pair<std::string_view, MeshMethod> kMeshMethodWords[] = {
    {"exact", MeshMethod::kExact}, {"contour", MeshMethod::kContour}};
inline constexpr std::pair<std::string_view, csg::BoundaryFaceKind> kFaceKindWords[] = {
    {"canonical", csg::BoundaryFaceKind::kCanonical}, {"input", csg::BoundaryFaceKind::kInput}};
inline constexpr std::pair<std::string_view, std::optional<Axis>> kAxisWords[] = {
    {"x", Axis::kX}, {"y", Axis::kY}, {"z", Axis::kZ}, {"auto", std::nullopt}};

inline constexpr std::pair<std::string_view, VoxelStyle> kStyleWords[] = {
    {"auto", VoxelStyle::kAuto},
    {"blocks", VoxelStyle::kBlocks},
    {"smooth", VoxelStyle::kSmooth},
    {"xray", VoxelStyle::kXray}};
inline constexpr std::pair<std::string_view, VoxelColours> kVoxelColourWords[] = {
    {"file", VoxelColours::kFile},
    {"labels", VoxelColours::kLabels},
    {"plain", VoxelColours::kPlain}};

/// The word of a choice. @pre the table has it
template <class T, std::size_t n>
[[nodiscard]] constexpr std::string_view word_of(const std::pair<std::string_view, T> (&words)[n],
                                                 std::type_identity_t<T> value) {
  for (const auto& [word, choice] : words) {
    if (choice == value) return word;
  }
  return {};
}

}  // namespace strata::apps
