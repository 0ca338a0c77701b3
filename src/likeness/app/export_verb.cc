// likeness export AVATAR OUT

#include <fmt/format.h>

#include <filesystem>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/avatar_file.h"
#include "likeness/avatar/avatar_id.h"
#include "likeness/avatar/codes.h"
#include "likeness/avatar/conditions.h"
#include "likeness/avatar/export/glb.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/export/onnx.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/image_io.h"
#include "likeness/render/portrait.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path avatar;
  fs::path out;
  std::string format = "auto";
  fs::path performance;
  double at = -1;
  std::string frame = "mean";
  fs::path code;
  std::string view = "0,0";
  std::string identity;
  AnimateOptions animate;
};

Command Describe(Arguments& a) {
  Command command(
      "export",
      "Writes a frame of an avatar as OBJ or PLY, or a frame or a whole performance as glTF, with a texture "
      "that is decoded for one view and baked; or the decoder itself as an ONNX model.",
      "likeness export avatars/demo talk.glb --performance talk.perf.safetensors");
  command.Positional("AVATAR", &a.avatar, "avatar file, or the folder of its training run");
  command.Positional("OUT", &a.out, "file to write; an OBJ gets an MTL and a PNG beside it");
  command.Choice("format", &a.format, {"auto", "gltf", "obj", "ply", "onnx"},
                 "auto: what OUT ends in, .glb, .obj, .ply or .onnx");
  command.Option("performance", &a.performance,
                 "performance of the avatar: animates a glTF; with --at, one moment of it");
  command.Option("at", &a.at, "seconds into --performance, for a single frame; -1: none");
  command.Option("frame", &a.frame, "mean, a number from 0, or [PERSON/]SEGMENT/FRAME of a training frame");
  command.Option("code", &a.code, "text file with a latent code, instead of --frame");
  command.Option("view", &a.view, "AZIMUTH,ELEVATION in degrees that the texture is decoded for");
  command.Option("identity", &a.identity,
                 "whose face; default: the performance's or the frame's person, all people in an ONNX model");
  command.Option("targets", &a.animate.most_targets, "most morph targets of an animated glTF");
  command.Option("tolerance-mm", &a.animate.tolerance_mm,
                 "no more targets than bring the animated mesh this near to the decoded one (root mean square)");
  return command;
}

std::string FormatOf(const Arguments& a) {
  if (a.format != "auto") return a.format;
  const std::string extension = a.out.extension().string();
  if (extension == ".glb") return "gltf";
  if (extension == ".obj" || extension == ".ply" || extension == ".onnx") return extension.substr(1);
  throw UsageError(fmt::format("{} does not tell the format: let it end in .glb, .obj, .ply or .onnx, or add --format",
                               a.out.string()));
}

void CheckUsage(const Arguments& a, const std::string& format) {
  if (a.at >= 0 && a.performance.empty()) throw UsageError("--at is a moment of --performance");
  if (!a.performance.empty() && a.at < 0 && (format == "obj" || format == "ply")) {
    throw UsageError("an OBJ or PLY is one frame: say which with --at SECONDS, or export a .glb");
  }
  if (format != "onnx") return;
  const Arguments unsaid;
  if (!a.performance.empty() || a.frame != unsaid.frame || !a.code.empty() || a.view != unsaid.view) {
    throw UsageError(
        "an ONNX model takes any code and view: leave out --performance, --frame, --code and --view, and give it those "
        "when it is run");
  }
}

// What is exported: one frame or more.
struct Shown {
  Performance performance;
  int identity = 0;
};

Performance OneFrame(const Avatar& avatar, std::vector<float> code) {
  Performance performance;
  performance.latent = avatar.architecture.latent;
  performance.seconds = {0};
  performance.codes = std::move(code);
  performance.world_from_head.resize(1);
  return performance;
}

Shown Choose(const Arguments& a, const Avatar& avatar) {
  Shown shown;
  if (!a.identity.empty()) shown.identity = FindIdentity(avatar, a.identity);
  if (!a.performance.empty()) {
    shown.performance = ReadPerformance(a.performance);
    CheckBelongs(shown.performance, a.performance, avatar.architecture, AvatarId(avatar));
    if (a.identity.empty() && !shown.performance.person.empty()) {
      shown.identity = FindIdentity(avatar, shown.performance.person);
    }
    if (a.at >= 0) shown.performance = OneFrame(avatar, MomentAt(shown.performance, a.at).code);
  } else if (!a.code.empty()) {
    shown.performance = OneFrame(avatar, ReadCode(a.code, avatar.architecture.latent));
  } else {
    const NamedCode code = FindCode(avatar, a.frame, shown.identity);
    if (code.frame != nullptr && a.identity.empty()) shown.identity = code.frame->identity;
    shown.performance = OneFrame(avatar, code.mu);
  }
  return shown;
}

// One texture serves all frames: that of their mean code.
std::vector<float> MeanCodeOf(const Performance& performance) {
  std::vector<float> mean(static_cast<size_t>(performance.latent));
  for (size_t i = 0; i < performance.codes.size(); ++i) {
    mean[i % mean.size()] += performance.codes[i] / static_cast<float>(performance.frame_count());
  }
  return mean;
}

// Opaque RGB of a code for a view.
ImageU8 BakeTexture(Decoder* decoder, std::span<const float> code, const std::string& view) {
  double azimuth = 0, elevation = 0;
  ParseView(view, &azimuth, &elevation);
  const Eigen::Vector3f direction = ViewDirection(azimuth, elevation).cast<float>();
  const int size = decoder->architecture().texture_size;
  ImageU8 pixels(size, size, 4);
  const Decoder::View looking{{direction.x(), direction.y(), direction.z()}, pixels.values().data(), int64_t{4} * size};
  decoder->Decode(code, {&looking, 1}, {});
  ImageU8 texture(size, size, 3);
  for (size_t i = 0; i < texture.values().size() / 3; ++i) {
    std::copy_n(&pixels.values()[4 * i], 3, &texture.values()[3 * i]);
  }
  return texture;
}

void WriteObjFiles(const fs::path& out, const Vertices& mesh, const MeshTopology& topology, const ImageU8& texture) {
  const fs::path material = fs::path(out).replace_extension(".mtl"), png = fs::path(out).replace_extension(".png");
  WritePng(png, texture);
  WriteFile(material,
            fmt::format("newmtl face\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {}\n", png.filename().string()));
  WriteFile(out, fmt::format("mtllib {}\nusemtl face\n", material.filename().string()) + ObjText(mesh, topology));
}

// Both write the output and give back what is to say of it.
std::string WriteOnnx(const Arguments& a, const fs::path& avatar_file, const Avatar& avatar) {
  OnnxOptions options;
  if (!a.identity.empty()) options.person = FindIdentity(avatar, a.identity);
  const std::string bytes = OnnxBytes(avatar_file, options);
  WriteFile(a.out, bytes);
  return fmt::format(": ONNX operators {}, {:.1f} MB", kOnnxOperators, static_cast<double>(bytes.size()) / 1e6);
}

std::string WriteFrames(const Arguments& a, const std::string& format, const fs::path& avatar_file,
                        const Avatar& avatar) {
  const Shown shown = Choose(a, avatar);
  DecoderOptions options;
  options.person = shown.identity;
  const std::unique_ptr<Decoder> decoder = Decoder::Open(avatar_file, options);
  const MeshDecoder decode = [&](std::span<const float> code) {
    Vertices mesh(avatar.architecture.vertex_count, 3);
    decoder->Decode(code, {}, {mesh.data()});
    return mesh;
  };
  const Performance& performance = shown.performance;
  if (format == "ply") {
    WriteFile(a.out, EncodePly(decode(performance.Code(0)), avatar.topology.triangles));
  } else if (format == "obj") {
    WriteObjFiles(a.out, decode(performance.Code(0)), avatar.topology,
                  BakeTexture(decoder.get(), performance.Code(0), a.view));
  } else {
    const AnimatedMesh mesh = Animate(performance, decode, avatar.topology, a.animate);
    WriteFile(a.out, GlbBytes(mesh, BakeTexture(decoder.get(), MeanCodeOf(performance), a.view)));
    return fmt::format(": {} frames, {} morph targets, {:.3f} mm from the decoded mesh on average, {:.3f} mm at most",
                       performance.frame_count(), mesh.targets.size(), mesh.mean_error_mm, mesh.largest_error_mm);
  }
  return "";
}

}  // namespace

int RunExport(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  a.animate.Check();
  const std::string format = FormatOf(a);
  CheckUsage(a, format);
  const fs::path avatar_file = AvatarFile(a.avatar);
  const Avatar avatar = LoadAvatar(avatar_file);
  const std::string text =
      format == "onnx" ? WriteOnnx(a, avatar_file, avatar) : WriteFrames(a, format, avatar_file, avatar);
  WriteFile(fs::path(a.out).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}{}\n", a.out.string(), text);
  return 0;
}

}  // namespace likeness
