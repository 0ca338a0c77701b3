// What `likeness train` can be told.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/capture/capture.h"

namespace likeness {

struct LossWeights {
  double texture = 1;   // lambda_T
  double geometry = 1;  // lambda_M
  double kl = 0.01;     // lambda_Z
  double image = 0;     // lambda_I; 0: no picture is drawn
};

struct TrainOptions {
  std::filesystem::path capture;  // unwrapped at `size`
  std::vector<std::string> also;  // captures of other people, whom the same network learns
  std::filesystem::path out;      // folder
  CaptureOptions capture_options;

  std::string preset = "demo";  // see PresetNames()
  int size = 0;                 // texels a side; 0: the largest that the capture is unwrapped at
  int latent = 128;
  std::string model = "deep";
  std::string conditioning = "fc8";
  std::string normalisation = "weight";
  std::string untied_bias = "everywhere";
  std::string layout = "paper";
  std::string upsampling = "transposed";
  bool residual = false;
  std::string geometry = "tracked";
  // How the network is told whose face it is: "none", "one-hot", "learned", or "auto": one-hot for several people.
  std::string identity = "auto";
  int identity_size = 16;               // values of a learned identity vector
  std::vector<std::string> conditions;  // named conditions of every frame: conditions/NAME.csv of each capture
  bool colours = false;    // a gain and a bias for each camera and colour but the first one's; see ColourOptions
  double colour_rate = 1;  // their learning rate, times learning_rate

  // The run ends at whichever comes first; 0 sets no limit of that kind.
  int64_t iterations = 0;
  double minutes = 7;  // of training, not counting the reading of the capture

  int batch = 16;  // textures in a step, of each process
  // Textures of one frame that share a step: the frame is encoded once for all of them, so that more textures are
  // seen in the same time. 1 draws every texture on its own, as the paper does.
  int views = 4;

  double learning_rate = 2e-3;
  // "constant"; "cosine": from learning_rate to 0 over the length of the run; "hold": the same in the run's last part
  std::string schedule = "cosine";
  double warmup = 0.02;         // share of the run in which the rate rises to learning_rate
  double beta2 = 0.999;         // Adam's decay of squared gradients
  double clip = 1;              // largest norm of all gradients together; 0 does not clip
  double average = 0.02;        // the avatar's weights are a mean over about this share of the run's end; 0: the last
  std::string texels = "seen";  // what a texel counts in the loss; see texel_weights.h
  LossWeights loss = {.geometry = 10};
  int crop = 256;              // side of the pieces of pictures for the image loss, pixels; 0: whole pictures
  bool silhouettes = false;    // the image loss moves outlines, too; see render/silhouettes.h
  std::filesystem::path from;  // avatar whose weights the network begins with; empty: random ones

  uint64_t seed = 0;
  std::string device = "cpu";
  std::string precision = "auto";   // see ops/precision.h
  double save_minutes = 5;          // between checkpoints; 0: after every step
  int keep = 3;                     // checkpoints that stay
  int log_every = 10;               // iterations
  int workers = 1;                  // threads that read ahead
  double cache_mb = 8192;           // memory for textures
  std::filesystem::path cache_dir;  // where a file holds textures beyond; empty: they are read again when needed
  double peer_timeout_s = 120;      // until a process that does not answer ends the others
  bool resume = true;               // go on from OUT's newest checkpoint; otherwise start afresh

  // Throws Error naming the option.
  void Check() const;

  // What the people are called, one for each capture.
  std::vector<std::string> PeopleNames() const;
  size_t CacheBytes() const { return static_cast<size_t>(cache_mb * (1 << 20)); }

  // The options that decide the result, one "name = value" each; a checkpoint is continued only if they are the same.
  std::vector<std::string> Fingerprint() const;
};

// What the person of a capture is called: its folder's name.
std::string PersonName(const std::filesystem::path& capture);

// "demo": the best picture after some minutes on a few cores. "paper": Lombardi et al. 2018, 200,000 iterations at a
// constant rate; the rate itself, which the paper does not tell, is Multiface's. "multiface": that project's network,
// with its batch, rate and clipping; its decay of the rate by epochs is left out.
const std::vector<std::string>& PresetNames();
TrainOptions PresetOptions(const std::string& preset);
const std::vector<std::string>& ScheduleNames();

// The network for captures of this many vertices. Throws Error for choices that are unknown or not available yet.
// Named conditions are left out: their sizes stand in the captures.
Architecture ArchitectureFrom(const TrainOptions& options, int size, int vertex_count);

}  // namespace likeness
