#include "likeness/app/import_multiface.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "likeness/app/command.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/multiface/import.h"
#include "likeness/avatar/multiface/torch_archive.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/capture/capture.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/texture_set.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path checkpoint;
  fs::path out;
  fs::path capture;
  fs::path topology;
  fs::path texture_mean, texture_variance, vertex_mean, vertex_variance;

  bool AnyStatistics() const {
    return !texture_mean.empty() || !texture_variance.empty() || !vertex_mean.empty() || !vertex_variance.empty();
  }
  bool AllStatistics() const {
    return !texture_mean.empty() && !texture_variance.empty() && !vertex_mean.empty() && !vertex_variance.empty();
  }
};

Command Describe(Arguments& a) {
  Command command("import multiface", "Turns a published Multiface checkpoint into an avatar file.",
                  "likeness import multiface best_model.pth avatars/published --capture captures/m--20180227--GHS");
  command.Positional("CHECKPOINT", &a.checkpoint, "file of torch.save with the network's state_dict");
  command.Positional("OUT", &a.out, "folder for avatar.safetensors, or a file that ends in .safetensors");
  command.Option("capture", &a.capture, "folder of the capture that it was trained on, for topology and statistics");
  command.Option("topology", &a.topology, "OBJ with faces and texture coordinates, instead of the capture's");
  command.Option("tex-mean", &a.texture_mean, "PNG of the mean texture; with the next three, instead of the capture's");
  command.Option("tex-var", &a.texture_variance, "text file with the texture's variance");
  command.Option("vert-mean", &a.vertex_mean, "float32 file with the mean vertices, mm");
  command.Option("vert-var", &a.vertex_variance, "text file with the vertices' variance");
  return command;
}

MeshTopology ReadTopology(const Arguments& a, const Capture* capture) {
  return a.topology.empty() ? capture->topology() : TopologyFromObj(ReadObj(a.topology), a.topology.string());
}

TextureStatistics ReadGivenStatistics(const Arguments& a, const Architecture& architecture) {
  const ImageU8 mean = ReadImage(a.texture_mean, 3);
  const int size = architecture.texture_size;
  if (mean.width() != size || mean.height() != size) {
    throw FileError(a.texture_mean, fmt::format("is {} x {} texels; the checkpoint's textures are {} x {}",
                                                mean.width(), mean.height(), size, size));
  }
  TextureStatistics statistics;
  statistics.mean = ImageF(size, size, 3);
  std::copy(mean.values().begin(), mean.values().end(), statistics.mean.values().begin());
  statistics.variance = ReadVariance(a.texture_variance);
  statistics.vertex_mean = ReadFloats(a.vertex_mean, 3 * static_cast<size_t>(architecture.vertex_count));
  statistics.vertex_variance = ReadVariance(a.vertex_variance);
  return statistics;
}

}  // namespace

int RunImportMultiface(int argc, const char* const* argv) {
  Arguments a;
  Command command = Describe(a);
  if (!command.Parse(argc, argv)) return 0;
  if (a.AnyStatistics() != a.AllStatistics()) {
    throw UsageError("--tex-mean, --tex-var, --vert-mean and --vert-var belong together");
  }
  if (a.capture.empty() && (a.topology.empty() || !a.AllStatistics())) {
    throw UsageError("topology and statistics are missing: give --capture, or --topology and the four statistics");
  }

  MultifaceNetwork network = ImportMultiface(a.checkpoint, ReadTorchArchive(a.checkpoint));
  const std::unique_ptr<Capture> capture = a.capture.empty() ? nullptr : OpenCapture(a.capture);
  Avatar avatar;
  avatar.architecture = network.architecture;
  avatar.weights = std::move(network.weights);
  avatar.topology = ReadTopology(a, capture.get());
  const TextureStatistics statistics = a.AllStatistics()
                                           ? ReadGivenStatistics(a, avatar.architecture)
                                           : TextureSet(*capture, avatar.architecture.texture_size).ReadStatistics();
  avatar.identities[0].texture_mean = statistics.mean;
  avatar.texture_variance = statistics.variance;
  avatar.identities[0].vertex_mean = Eigen::Map<const Vertices>(
      statistics.vertex_mean.data(), static_cast<Eigen::Index>(statistics.vertex_mean.size() / 3), 3);
  avatar.vertex_variance = statistics.vertex_variance;
  avatar.training = {{"imported", a.checkpoint.filename().string()}};

  const fs::path file = a.out.extension() == ".safetensors" ? a.out : a.out / "avatar.safetensors";
  SaveAvatar(file, avatar);
  WriteFile(fs::path(file).replace_extension(".toml"), command.ResolvedToml());
  fmt::print("{}: {} x {} texels, {} vertices, codes of {} values, {} parameters\n", file.string(),
             avatar.architecture.texture_size, avatar.architecture.texture_size, avatar.architecture.vertex_count,
             avatar.architecture.latent, ParameterCount(avatar.architecture));
  return 0;
}

}  // namespace likeness
