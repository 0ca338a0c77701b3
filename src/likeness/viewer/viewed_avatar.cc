#include "likeness/viewer/viewed_avatar.h"

#include <algorithm>
#include <utility>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/avatar/avatar_id.h"
#include "likeness/avatar/codes.h"
#include "likeness/avatar/conditions.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/image/draw.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kUvLayoutSize = 1024;  // px, enough to see single triangles in a pane

std::vector<Clip> ClipsOf(const std::vector<const FrameCode*>& codes) {
  std::vector<Clip> clips;
  for (const FrameCode* code : codes) {
    if (clips.empty() || clips.back().name != code->segment) {
      clips.emplace_back();
      clips.back().name = code->segment;
      clips.back().performance.latent = static_cast<int>(code->mu.size());
    }
    Performance& frames = clips.back().performance;
    frames.seconds.push_back(frames.frame_count() / kTrainingFramesPerSecond);
    frames.codes.insert(frames.codes.end(), code->mu.begin(), code->mu.end());
    frames.world_from_head.emplace_back();
    frames.frame_names.push_back(code->segment + "/" + code->frame);
  }
  return clips;
}

ImageU8 DrawUvLayout(const MeshTopology& topology) {
  ImageU8 lines(kUvLayoutSize, kUvLayoutSize, 3);
  const auto at = [&](int uv) {
    const Eigen::Vector2f& point = topology.uvs[static_cast<size_t>(uv)];
    return Point{point.x() * kUvLayoutSize, (1 - point.y()) * kUvLayoutSize};
  };
  std::vector<std::pair<int, int>> edges;
  edges.reserve(3 * topology.triangle_uvs.size());
  for (const Eigen::Vector3i& corners : topology.triangle_uvs) {
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax({corners[i], corners[(i + 1) % 3]}));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [from, to] : edges) DrawLine(&lines, at(from), at(to), {255, 255, 255});
  ImageU8 layout(kUvLayoutSize, kUvLayoutSize, 4, 255);
  for (int y = 0; y < kUvLayoutSize; ++y) {
    for (int x = 0; x < kUvLayoutSize; ++x) layout.at(x, y)[3] = lines.at(x, y)[0];
  }
  return layout;
}

}  // namespace

ViewedAvatar OpenAvatar(const fs::path& path, const std::string& person, int threads) {
  ViewedAvatar viewed;
  viewed.file = AvatarFile(path);
  SafetensorsFile file = SafetensorsFile::Map(viewed.file);
  Avatar avatar = AvatarFrom(file);
  viewed.id = AvatarId(avatar);
  viewed.architecture = avatar.architecture;
  avatar.weights.clear();  // the decoder has its own
  for (const Identity& identity : avatar.identities) viewed.people.push_back(identity.name);
  viewed.person = person.empty() ? 0 : FindIdentity(avatar, person);
  viewed.topology = std::move(avatar.topology);
  if (viewed.topology.triangles.empty()) throw FileError(viewed.file, "has a mesh without triangles, nothing to show");
  viewed.rest = MeanCode(avatar, viewed.person);
  viewed.uv_layout = DrawUvLayout(viewed.topology);

  DecoderOptions options;
  options.threads = threads;
  options.person = viewed.person;
  // The window draws on the same cores.
  options.pin = false;
  options.spin_ms = 0;
  viewed.decoder = std::make_unique<Decoder>(std::move(file), options);
  viewed.rest_vertices.resize(viewed.topology.vertex_count, 3);
  viewed.decoder->Decode(viewed.rest, {}, {viewed.rest_vertices.data()});

  std::vector<const FrameCode*> codes;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity == viewed.person) codes.push_back(&code);
  }
  viewed.clips = ClipsOf(codes);
  std::vector<float> jacobian(static_cast<size_t>(3) * viewed.topology.vertex_count * viewed.architecture.latent);
  viewed.decoder->Jacobian(viewed.rest, {}, jacobian);
  viewed.directions = FindDirections(codes, viewed.rest, jacobian);
  return viewed;
}

std::vector<float> MovedCode(const ViewedAvatar& avatar, std::vector<float> code, std::span<const float> sliders) {
  LIKENESS_CHECK(sliders.size() <= avatar.directions.size() && code.size() == avatar.rest.size());
  for (size_t d = 0; d < sliders.size(); ++d) {
    for (size_t i = 0; i < code.size(); ++i) code[i] += sliders[d] * avatar.directions[d].step[i];
  }
  return code;
}

Clip OpenPerformance(const fs::path& path, const ViewedAvatar& avatar) {
  Clip clip = {path.stem().string(), ReadPerformance(path)};
  CheckBelongs(clip.performance, path, avatar.architecture, avatar.id);
  return clip;
}

bool IsPerformance(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return false;
  return IsPerformance(SafetensorsFile::Map(path));
}

}  // namespace likeness
