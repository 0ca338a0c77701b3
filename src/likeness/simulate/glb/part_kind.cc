#include "likeness/simulate/glb/part_kind.h"

#include <Eigen/Cholesky>
#include <cctype>
#include <cmath>
#include <string>

namespace likeness {
namespace {

struct Clue {
  std::string_view word;
  PartKind kind;
};

// In this order: an eyelash is no eye.
constexpr Clue kClues[] = {
    {"lash", PartKind::kLashes},      {"brow", PartKind::kHair},        {"eyewear", PartKind::kClothes},
    {"glasses", PartKind::kClothes},  {"gland", PartKind::kTear},       {"tear", PartKind::kTear},
    {"lacrimal", PartKind::kTear},    {"caruncle", PartKind::kTear},    {"occlusion", PartKind::kTear},
    {"eyeshadow", PartKind::kTear},   {"teeth", PartKind::kMouth},      {"tooth", PartKind::kMouth},
    {"tongue", PartKind::kMouth},     {"gums", PartKind::kMouth},       {"denture", PartKind::kMouth},
    {"wig", PartKind::kHair},         {"hair", PartKind::kHair},        {"beard", PartKind::kHair},
    {"moustache", PartKind::kHair},   {"mustache", PartKind::kHair},    {"cornea", PartKind::kEye},
    {"iris", PartKind::kEye},         {"sclera", PartKind::kEye},       {"eyelid", PartKind::kSkin},
    {"eye", PartKind::kEye},          {"shirt", PartKind::kClothes},    {"cloth", PartKind::kClothes},
    {"outfit", PartKind::kClothes},   {"jacket", PartKind::kClothes},   {"collar", PartKind::kClothes},
    {"dress", PartKind::kClothes},    {"pants", PartKind::kClothes},    {"shoe", PartKind::kClothes},
    {"footwear", PartKind::kClothes}, {"headwear", PartKind::kClothes}, {"jewel", PartKind::kClothes},
    {"earring", PartKind::kClothes},
};

}  // namespace

PartKind KindFromNames(std::string_view mesh, std::string_view node, std::string_view material) {
  for (const std::string_view name : {mesh, node, material}) {
    std::string lower;
    for (const char c : name) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const Clue& clue : kClues) {
      if (lower.find(clue.word) != std::string::npos) return clue.kind;
    }
  }
  return PartKind::kSkin;
}

std::optional<Sphere> FitSphere(const std::vector<Eigen::Vector3f>& points) {
  std::optional<Sphere> sphere;
  for (int round = 0; round < 2; ++round) {
    // |p|^2 = 2 c p + (r^2 - |c|^2), linear in the unknowns; about the mean, for precision.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3f& p : points) mean += p.cast<double>() / static_cast<double>(points.size());
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    std::vector<Eigen::Vector3d> used;
    for (const Eigen::Vector3f& p : points) {
      constexpr float kFar = 0.1f;  // of the radius
      if (sphere && std::abs((p - sphere->centre).norm() - sphere->radius) > kFar * sphere->radius) continue;
      used.push_back(p.cast<double>() - mean);
      const Eigen::Vector4d row(2 * used.back().x(), 2 * used.back().y(), 2 * used.back().z(), 1);
      normal += row * row.transpose();
      right += row * used.back().squaredNorm();
    }
    if (used.size() < 8) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix4d> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-9)) return std::nullopt;
    const Eigen::Vector4d x = solver.solve(right);
    const double radius_squared = x[3] + x.head<3>().squaredNorm();
    if (!x.allFinite() || radius_squared <= 0) return std::nullopt;
    const double radius = std::sqrt(radius_squared);
    double error = 0;
    for (const Eigen::Vector3d& p : used) {
      const double off = (p - x.head<3>()).norm() - radius;
      error += off * off / static_cast<double>(used.size());
    }
    sphere =
        Sphere{(x.head<3>() + mean).cast<float>(), static_cast<float>(radius), static_cast<float>(std::sqrt(error))};
  }
  return sphere;
}

}  // namespace likeness
