#include "likeness/simulate/human/identity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"

namespace likeness {
namespace {

struct WeightedTarget {
  std::filesystem::path path;
  double weight;
};

// MakeHuman's macro targets: a weight is the product of the weights of the words in its name.
void AppendMacros(const std::filesystem::path& folder, const HumanRecipe& recipe, std::vector<WeightedTarget>* list) {
  const auto extremes = [](const char* name, double value) {  // 0 minimum, 0.5 average, 1 maximum
    return std::array<std::pair<std::string, double>, 3>{
        std::pair("min" + std::string(name), std::max(0.0, 1 - 2 * value)),
        std::pair("average" + std::string(name), 1 - std::abs(2 * value - 1)),
        std::pair("max" + std::string(name), std::max(0.0, 2 * value - 1))};
  };
  const double ancestry_sum = recipe.african + recipe.asian + recipe.caucasian;
  for (const auto& [gender, gender_weight] : {std::pair("female", 1 - recipe.male), std::pair("male", recipe.male)}) {
    for (const auto& [age, age_weight] : {std::pair("young", 1 - recipe.age), std::pair("old", recipe.age)}) {
      const double weight = gender_weight * age_weight;
      for (const auto& [ancestry, share] : {std::pair("african", recipe.african), std::pair("asian", recipe.asian),
                                            std::pair("caucasian", recipe.caucasian)}) {
        list->push_back(
            {folder / fmt::format("{}-{}-{}.target.gz", ancestry, gender, age), weight * share / ancestry_sum});
      }
      for (const auto& [muscle, muscle_weight] : extremes("muscle", recipe.muscle)) {
        for (const auto& [fat, fat_weight] : extremes("weight", recipe.weight)) {
          list->push_back({folder / fmt::format("universal-{}-{}-{}-{}.target.gz", gender, age, muscle, fat),
                           weight * muscle_weight * fat_weight});
        }
      }
    }
  }
}

void AppendLocals(const std::filesystem::path& targets, const HumanRecipe& recipe, std::vector<WeightedTarget>* list) {
  for (const LocalShape& shape : LocalShapes()) {
    const auto found = recipe.local.find(shape.name);
    if (found == recipe.local.end()) continue;
    const double weight = found->second;
    const char* suffix = weight < 0 ? shape.negative : shape.positive;
    for (const char* side : {"l-", "r-"}) {
      const std::string prefix = shape.paired ? side : "";
      list->push_back(
          {targets / shape.folder / fmt::format("{}{}-{}.target.gz", prefix, shape.name, suffix), std::abs(weight)});
      if (!shape.paired) break;
    }
  }
}

// The helper eye is a ball with a bulge in front: its width gives the radius, its back the depth.
EyeFit FitEye(const Vertices& vertices, const QuadPart& part) {
  Eigen::AlignedBox3f box;
  for (const int v : UsedVertices(part.quads)) box.extend(Eigen::Vector3f(vertices.row(v)));
  const float radius = (box.sizes().x() + box.sizes().y()) / 4;
  return {Eigen::Vector3f(box.center().x(), box.center().y(), box.min().z() + radius), radius};
}

}  // namespace

Identity ShapeIdentity(const BaseMesh& base, const std::filesystem::path& data_folder, const HumanRecipe& recipe) {
  const std::filesystem::path folder = data_folder / "mpfb2" / "targets";
  std::vector<WeightedTarget> list;
  AppendMacros(folder / "macrodetails", recipe, &list);
  AppendLocals(folder, recipe, &list);
  std::erase_if(list, [](const WeightedTarget& item) { return item.weight <= 0; });
  std::vector<Target> targets(list.size());
  ParallelFor(static_cast<int64_t>(list.size()),
              [&](int64_t i) { targets[i] = ReadTarget(list[i].path, static_cast<int>(base.vertices.rows())); });

  Identity identity;
  identity.vertices = base.vertices;
  for (size_t i = 0; i < list.size(); ++i) {
    const float scale = static_cast<float>(list[i].weight) * kMillimetresPerUnit;
    for (size_t k = 0; k < targets[i].vertices.size(); ++k) {
      identity.vertices.row(targets[i].vertices[k]) += scale * targets[i].deltas[k].transpose();
    }
  }

  for (const int side : {kLeft, kRight}) identity.eyes[side] = FitEye(identity.vertices, base.eyes[side]);
  const Eigen::Vector3f between = (identity.eyes[0].centre + identity.eyes[1].centre) / 2;
  Eigen::AlignedBox3f skull;
  for (const int v : UsedVertices(base.face.quads)) {
    const Eigen::Vector3f p = identity.vertices.row(v);
    if (p.y() > between.y() + 15) skull.extend(p);  // above the eyes and the bridge of the nose
  }
  const Eigen::Vector3f centre(between.x(), between.y(), skull.center().z());
  identity.vertices.rowwise() -= centre.transpose();
  for (EyeFit& eye : identity.eyes) eye.centre -= centre;
  return identity;
}

std::vector<Target> ReadExpressionTargets(const std::filesystem::path& data_folder, int vertex_count) {
  const std::filesystem::path folder = data_folder / "faceunits01" / "targets" / "faceunits";
  std::vector<Target> targets(kExpressionCount);
  ParallelFor(kExpressionCount, [&](int64_t i) {
    targets[i] = ReadTarget(folder / (ExpressionNames()[i] + ".target"), vertex_count);
    for (Eigen::Vector3f& delta : targets[i].deltas) delta *= kMillimetresPerUnit;
  });
  return targets;
}

}  // namespace likeness
