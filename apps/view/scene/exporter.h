#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "apps/view/scene/document.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

// What is seen, written to files: as a mesh or as voxels. Pictures are the window's.

namespace strata::view {

/// What a file is, by its name.
enum class ExportKind : std::uint8_t { kMesh, kVoxels, kPicture };

/// The kind of a file: a picture for .png, else one of the formats of `strata mesh` and `strata
/// voxelize`. @return kUsage naming the file
Result<ExportKind> export_kind(const std::string& path);

/// The files that an export writes: an OBJ has one more.
[[nodiscard]] std::vector<std::string> export_files(const std::string& path);

/// Voxels along the longest side where none are asked for.
inline constexpr int kExportVoxels = 256;

struct ExportRequest {
  std::shared_ptr<const Arrangement> what;
  std::string path;
  int resolution = kExportVoxels;  ///< of voxels
  /// What was read: its mesh files are read again for their parts and colours. No files: none.
  csg::SceneInput input = {};
};

/// Writes the result of the arrangement's tree, without ghosts: its exact boundary with the
/// solids' colours and the parts of mesh files, or its voxels. @return a sentence: "part.3mf: 32
/// triangles"; kUsage (a picture); kInput: a mesh file has changed; and as boundary_mesh(),
/// voxelize() and the writers
Result<std::string> export_what_is_seen(const ExportRequest& request, const Execution& execution);

/// Exports on a thread of its own, one file at a time.
class Exporter {
 public:
  /// @param wake called from the thread when there is something to take()
  explicit Exporter(std::function<void()> wake) : wake_(std::move(wake)) {}
  Exporter(const Exporter&) = delete;
  Exporter& operator=(const Exporter&) = delete;
  ~Exporter() { cancel(); }

  /// @pre !busy()
  void start(ExportRequest request, int threads);
  void cancel() { thread_.request_stop(); }
  [[nodiscard]] bool busy() const { return busy_.load(); }
  [[nodiscard]] double progress() const { return progress_.load(); }  ///< in [0, 1]
  /// How an export ended; once.
  std::optional<Result<std::string>> take();

 private:
  std::function<void()> wake_;
  std::atomic<bool> busy_{false};
  std::atomic<double> progress_{0};
  std::mutex mutex_;
  std::optional<Result<std::string>> done_;
  std::jthread thread_;  ///< last: it uses the others
};

}  // namespace strata::view
