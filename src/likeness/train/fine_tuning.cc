#include "likeness/train/fine_tuning.h"

#include <nlohmann/json.hpp>

#include "likeness/base/error.h"

namespace likeness {

void AdoptNetwork(const Avatar& avatar, TrainOptions* options) {
  const Architecture& a = avatar.architecture;
  options->size = a.texture_size;
  options->latent = a.latent;
  options->model = ToString(a.model);
  options->conditioning = ToString(a.conditioning);
  options->normalisation =
      ToString(a.normalisation == Normalisation::kBatch ? Normalisation::kWeight : a.normalisation);
  options->untied_bias = ToString(a.untied_bias);
  options->layout = ToString(a.layout);
  options->upsampling = ToString(a.upsampling);
  options->residual = a.residual;
  options->geometry = ToString(a.geometry);
  options->identity = ToString(a.identity);
  if (a.identity_size > 0) options->identity_size = a.identity_size;
  options->conditions.clear();
  for (const NamedCondition& condition : a.conditions) options->conditions.push_back(condition.name);
}

void CheckOrigin(const std::filesystem::path& path, const Avatar& avatar, const Architecture& architecture,
                 const People& people) {
  if (architecture.normalisation == Normalisation::kBatch) {
    throw Error(
        "--from does not go with --normalisation batch: an avatar file has no statistics of batches to go on from; "
        "weight does");
  }
  const auto network = [](const Architecture& a) {
    auto json = nlohmann::ordered_json::parse(ArchitectureToJson(a));
    json.erase("preset");
    json.erase("normalisation");
    return json;
  };
  const nlohmann::ordered_json there = network(avatar.architecture), here = network(architecture);
  for (const auto& [key, value] : there.items()) {
    if (value == here.at(key)) continue;
    throw FileError(path, fmt::format("is another network: its {} is {}, here it is {}; leave the options of the "
                                      "network to --from",
                                      key, value.dump(), here.at(key).dump()));
  }
  if (const std::string difference = TopologyDifference(avatar.topology, people.topology()); !difference.empty()) {
    throw FileError(
        path, fmt::format("is of another mesh: {} has {}", people.captures().front()->root().string(), difference));
  }
  for (size_t i = 0; avatar.identities.size() > 1 && i < avatar.identities.size(); ++i) {
    if (avatar.identities[i].name == people.names()[i]) continue;
    throw FileError(path, fmt::format("has '{}' as person {}, here it is '{}'; give the captures in its order",
                                      avatar.identities[i].name, i + 1, people.names()[i]));
  }
}

}  // namespace likeness
