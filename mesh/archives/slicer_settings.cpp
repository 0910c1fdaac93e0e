// The files are described by no specification: BambuStudio's src/libslic3r/Format/bbs_3mf.cpp and
// PrusaSlicer's src/libslic3r/Format/3mf.cpp write them.
#include "mesh/archives/slicer_settings.h"

#include <algorithm>
#include <utility>

namespace strata::detail {
namespace {

/// The value of <metadata key="..." value="..."/> below a node.
std::string_view metadata(const pugi::xml_node& node, std::string_view key) {
  for (const pugi::xml_node& data : node.children()) {
    if (local_name(data) == "metadata" && key == data.attribute("key").value()) {
      return data.attribute("value").value();
    }
  }
  return {};
}

/// What a part is that is no solid: by BambuStudio's and PrusaSlicer's words.
std::string not_solid(std::string_view word) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"modifier_part", "modifier"},
      {"ParameterModifier", "modifier"},
      {"negative_part", "negative volume"},
      {"NegativeVolume", "negative volume"},
      {"support_blocker", "support blocker"},
      {"SupportBlocker", "support blocker"},
      {"support_enforcer", "support enforcer"},
      {"SupportEnforcer", "support enforcer"}};
  for (const auto& [known, meaning] : kWords) {
    if (word == known) return std::string(meaning);
  }
  return {};
}

SlicerPart volume_of(const pugi::xml_node& node) {
  SlicerPart volume;
  volume.name = metadata(node, "name");
  volume.not_solid = not_solid(metadata(node, "volume_type"));
  if (metadata(node, "modifier") == "1") volume.not_solid = "modifier";
  // A range that is no range holds no triangle.
  volume.first = node.attribute("firstid").as_ullong(1);
  volume.last = node.attribute("lastid").as_ullong(0);
  return volume;
}

void read_objects(const pugi::xml_node& config, SlicerSettings& settings) {
  for (const pugi::xml_node& node : config.children()) {
    if (local_name(node) != "object") continue;
    SlicerObject object;
    object.name = metadata(node, "name");
    for (const pugi::xml_node& part : node.children()) {
      if (local_name(part) == "volume") object.volumes.push_back(volume_of(part));
      if (local_name(part) != "part") continue;
      SlicerPart made;
      made.name = metadata(part, "name");
      made.not_solid = not_solid(part.attribute("subtype").value());
      object.parts.try_emplace(part.attribute("id").value(), std::move(made));
    }
    std::ranges::stable_sort(object.volumes, {}, &SlicerPart::first);
    settings.try_emplace(node.attribute("id").value(), std::move(object));
  }
}

}  // namespace

std::string SlicerObject::name_of(const SlicerPart& part) const {
  const bool several = parts.size() + volumes.size() > 1;
  if (name.empty()) return part.name;
  return several && !part.name.empty() ? name + "/" + part.name : name;
}

Result<SlicerSettings> read_slicer_settings(const ZipArchive& archive, const Execution& execution,
                                            std::vector<std::string>& warnings) {
  SlicerSettings settings;
  for (const char* path : {"Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"}) {
    const auto name = archive.find(path);
    if (!name) continue;
    auto text = archive.read(*name, execution);
    if (!text && text.error().code != ErrorCode::kInput) return tl::unexpected(text.error());
    if (!text) {
      warnings.push_back(text.error().message + "; names of parts are not read");
      continue;
    }
    XmlMesh file(archive.path() + "/" + *name, *std::move(text), execution.stop);
    if (auto parsed = file.parse(); !parsed) {
      if (parsed.error().code != ErrorCode::kInput) return tl::unexpected(parsed.error());
      warnings.push_back(parsed.error().message + "; names of parts are not read");
      continue;
    }
    read_objects(file.root(), settings);
  }
  return settings;
}

}  // namespace strata::detail
