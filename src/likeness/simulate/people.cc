#include "likeness/simulate/people.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/simulate/human/human_head.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {
namespace {

// What one notices about people, weighted by how soon.
using Traits = std::array<double, 10>;

Traits TraitsOf(const HumanRecipe& r) {
  return {1.0 * r.male,   1.3 * r.age,          0.9 * r.african,      0.9 * r.asian,   0.9 * r.caucasian,
          1.2 * r.weight, 0.8 * r.hair_melanin, 0.5 * r.hair_redness, 0.6 * r.stubble, 0.5 * r.iris};
}

double DistanceOf(const Traits& a, const Traits& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

void CheckCount(int count) {
  if (count < 2 || count > 64) throw Error("a set has 2 to 64 people, not {}", count);
}

struct HeadKind {
  bool human = true;
  uint64_t seed = 1;
};

HeadKind ParseKind(const std::string& head) {
  const size_t colon = head.find(':');
  const std::string kind = head.substr(0, colon), digits = colon == std::string::npos ? "1" : head.substr(colon + 1);
  HeadKind result;
  result.human = kind == "human";
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result.seed);
  if ((!result.human && kind != "procedural") || error != std::errc() || end != digits.data() + digits.size()) {
    throw Error("several people take --head human:SEED or procedural:SEED, not '{}'", head);
  }
  return result;
}

Vertices NeutralMesh(const Head& head) { return head.Pose(std::array<float, kExpressionCount>{}).tracked; }

}  // namespace

std::vector<uint64_t> ChoosePeople(int count, uint64_t seed) {
  CheckCount(count);
  constexpr size_t kCandidates = 1000;
  std::vector<uint64_t> seeds;
  std::vector<Traits> traits;
  std::vector<double> nearest(kCandidates, 1e30);
  for (size_t i = 0; i < kCandidates; ++i) {
    // Small numbers, so that people can be asked for again by hand.
    seeds.push_back(seed * kCandidates + i);
    traits.push_back(TraitsOf(RecipeFromSeed(seeds[i])));
  }
  std::vector<uint64_t> chosen;
  size_t next = 0;
  while (static_cast<int>(chosen.size()) < count) {
    chosen.push_back(seeds[next]);
    for (size_t i = 0; i < kCandidates; ++i) nearest[i] = std::min(nearest[i], DistanceOf(traits[i], traits[next]));
    next = static_cast<size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  return chosen;
}

std::vector<Person> SimulatePeople(const SimulateOptions& options, int count) {
  options.Check();
  CheckCount(count);
  const HeadKind kind = ParseKind(options.head);
  std::vector<Person> people(static_cast<size_t>(count));
  std::vector<uint64_t> seeds;
  if (kind.human) {
    seeds = ChoosePeople(count, kind.seed);
  } else {
    for (int i = 0; i < count; ++i) seeds.push_back(kind.seed + static_cast<uint64_t>(i));
  }
  Vertices all;
  std::string heads;
  for (size_t i = 0; i < people.size(); ++i) {
    people[i].name = fmt::format("person_{}", i + 1);
    people[i].head = fmt::format("{}:{}", kind.human ? "human" : "procedural", seeds[i]);
    heads += (i > 0 ? " " : "") + people[i].head;
    Vertices mesh;
    if (kind.human) {
      HumanRecipe recipe = RecipeFromSeed(seeds[i]);
      recipe.texture_size = 256;  // shape alone is needed, and paint takes long
      mesh = NeutralMesh(*MakeHumanHead(FindHeadData(options.head_data), recipe));
    } else {
      mesh = NeutralMesh(*OpenHead(people[i].head, options.head_data).head);
    }
    const Eigen::Index before = all.rows();
    all.conservativeResize(before + mesh.rows(), 3);
    all.bottomRows(mesh.rows()) = mesh;
  }
  const Rig rig = MakeRig(options.rig, all);
  for (Person& person : people) {
    SimulateOptions own = options;
    own.out = options.out / person.name;
    own.head = person.head;
    person.result = SimulateHead(own, OpenHead(person.head, options.head_data), rig, heads);
  }
  return people;
}

}  // namespace likeness
