#include "likeness/avatar/arkit_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "likeness/base/error.h"
#include "likeness/geometry/mesh_distance.h"

namespace likeness {
namespace {

constexpr double kStrengths[] = {1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1};
// Coefficients that vary less than this over the frames say nothing.
constexpr double kLeastDeviation = 1e-4;

struct TermSet {
  std::string name;
  std::vector<ArkitTerm> terms;
};

// The sets of terms that are tried, from the smallest.
std::vector<TermSet> TermSets(const std::vector<std::string>& names) {
  const auto count = static_cast<int>(names.size());
  std::vector<ArkitTerm> linear, squares, products;
  for (int i = 0; i < count; ++i) {
    linear.push_back({i, -1});
    squares.push_back({i, i});
  }
  const auto jaw = std::find(names.begin(), names.end(), "jawOpen");
  for (int i = 0; jaw != names.end() && i < count; ++i) {
    const bool mouth = names[i].starts_with("mouth") || names[i].starts_with("jaw") || names[i] == "tongueOut";
    if (mouth && names[i] != "jawOpen") products.push_back({static_cast<int>(jaw - names.begin()), i});
  }
  const auto joined = [](std::vector<ArkitTerm> terms, const std::vector<ArkitTerm>& more) {
    terms.insert(terms.end(), more.begin(), more.end());
    return terms;
  };
  std::vector<TermSet> sets = {{"linear", linear}, {"squares", joined(linear, squares)}};
  if (products.empty()) return sets;
  sets.push_back({"jaw products", joined(linear, products)});
  sets.push_back({"squares and jaw products", joined(joined(linear, squares), products)});
  return sets;
}

// Ridge regression of codes on terms: minimises mean |Y - X W|^2 + strength |W|^2 over centred X, Y with X's columns
// scaled to deviation 1. One decomposition serves all strengths.
class Ridge {
 public:
  Ridge(const std::vector<ArkitTerm>& terms, const std::vector<const ArkitFrame*>& frames) {
    const auto count = static_cast<Eigen::Index>(frames.size()), width = static_cast<Eigen::Index>(terms.size());
    Eigen::MatrixXd x(count, width), y(count, static_cast<Eigen::Index>(frames.front()->code.size()));
    for (Eigen::Index f = 0; f < count; ++f) {
      const std::vector<double> values = TermValues(terms, frames[f]->coefficients);
      x.row(f) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), width);
      y.row(f) = Eigen::Map<const Eigen::RowVectorXf>(frames[f]->code.data(), y.cols()).cast<double>();
    }
    x_mean_ = x.colwise().mean();
    y_mean_ = y.colwise().mean();
    x.rowwise() -= x_mean_;
    y.rowwise() -= y_mean_;
    scale_.resize(width);
    for (Eigen::Index k = 0; k < width; ++k) {
      const double deviation = std::sqrt(x.col(k).squaredNorm() / static_cast<double>(count));
      scale_[k] = deviation > kLeastDeviation ? 1 / deviation : 0;
    }
    x *= scale_.asDiagonal();
    const Eigen::MatrixXd covariance = x.transpose() * x / static_cast<double>(count);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
    vectors_ = solver.eigenvectors();
    values_ = solver.eigenvalues().cwiseMax(0);
    projected_ = vectors_.transpose() * (x.transpose() * y) / static_cast<double>(count);
  }

  ArkitMap Map(const std::vector<std::string>& names, const std::vector<ArkitTerm>& terms, double strength) const {
    const Eigen::VectorXd shrink = (values_.array() + strength).inverse();
    const Eigen::MatrixXd weights = scale_.asDiagonal() * (vectors_ * (shrink.asDiagonal() * projected_));
    const Eigen::RowVectorXd bias = y_mean_ - x_mean_ * weights;
    ArkitMap map{names, terms, std::vector<float>(bias.size()), std::vector<float>(weights.size())};
    Eigen::Map<Eigen::RowVectorXf>(map.bias.data(), bias.size()) = bias.cast<float>();
    // [terms, latent] column by column is [latent, terms] row by row.
    Eigen::Map<Eigen::MatrixXf>(map.weights.data(), weights.rows(), weights.cols()) = weights.cast<float>();
    return map;
  }

 private:
  Eigen::RowVectorXd x_mean_, y_mean_;
  Eigen::VectorXd scale_;
  Eigen::MatrixXd vectors_;    // of X^T X / n
  Eigen::VectorXd values_;     // likewise
  Eigen::MatrixXd projected_;  // vectors^T X^T Y / n
};

// Segments in the order in which they first appear, dealt round: neighbours in a script resemble each other.
std::vector<int> FoldsOf(const std::vector<ArkitFrame>& frames, int most_folds) {
  std::map<std::string, int> segments;
  std::vector<int> folds;
  for (const ArkitFrame& frame : frames) {
    folds.push_back(segments.emplace(frame.segment, static_cast<int>(segments.size())).first->second);
  }
  if (segments.size() < 2) {
    throw Error(
        "an ARKit map is fitted to frames of two segments or more: each is predicted from the others to choose "
        "the fit");
  }
  const int count = std::min(most_folds, static_cast<int>(segments.size()));
  for (int& fold : folds) fold %= count;
  return folds;
}

// Frames whose meshes are compared, evenly spread, and the mean error of predicting them.
class Judge {
 public:
  Judge(const std::vector<ArkitFrame>& frames, const std::vector<int>& folds, const MeshDecoder& decode,
        const std::vector<int>& vertices, int most)
      : decode_(decode), vertices_(vertices) {
    const size_t count = std::min(frames.size(), static_cast<size_t>(most));
    for (size_t i = 0; i < count; ++i) {
      const size_t f = i * frames.size() / count;
      scored_.push_back({frames[f].coefficients, folds[f], decode(frames[f].code)});
    }
  }

  //   maps  one for each fold, fitted without it
  double ErrorMm(const std::vector<ArkitMap>& maps) const {
    double sum = 0;
    for (const Scored& s : scored_) {
      sum += MeanDistance(decode_(maps[s.fold].CodeOf(s.coefficients)), s.mesh, vertices_);
    }
    return sum / static_cast<double>(scored_.size());
  }

 private:
  struct Scored {
    std::vector<float> coefficients;
    int fold = 0;
    Vertices mesh;  // of the encoder's code
  };
  const MeshDecoder& decode_;
  const std::vector<int>& vertices_;
  std::vector<Scored> scored_;
};

// The regression of each fold, on all frames but its own.
std::vector<Ridge> RidgeOfEachFold(const std::vector<ArkitTerm>& terms, const std::vector<ArkitFrame>& frames,
                                   const std::vector<int>& folds) {
  std::vector<Ridge> ridges;
  for (int fold = 0; fold <= *std::max_element(folds.begin(), folds.end()); ++fold) {
    std::vector<const ArkitFrame*> rest;
    for (size_t f = 0; f < frames.size(); ++f) {
      if (folds[f] != fold) rest.push_back(&frames[f]);
    }
    ridges.emplace_back(terms, rest);
  }
  return ridges;
}

}  // namespace

void ArkitFitOptions::Check() const {
  if (folds < 2) throw Error("cross-validation takes 2 folds or more, not {}", folds);
  if (most_scored < 1) throw Error("cross-validation compares 1 frame or more, not {}", most_scored);
}

ArkitFit FitArkitMap(const std::vector<std::string>& names, const std::vector<ArkitFrame>& frames,
                     const MeshDecoder& decode, const std::vector<int>& vertices, const ArkitFitOptions& options) {
  options.Check();
  const std::vector<int> folds = FoldsOf(frames, options.folds);
  const Judge judge(frames, folds, decode, vertices, options.most_scored);
  ArkitFit fit;
  fit.best.error_mm = std::numeric_limits<double>::infinity();
  std::vector<ArkitTerm> best_terms;
  for (const TermSet& set : TermSets(names)) {
    const std::vector<Ridge> ridges = RidgeOfEachFold(set.terms, frames, folds);
    for (const double strength : kStrengths) {
      std::vector<ArkitMap> maps;
      for (const Ridge& ridge : ridges) maps.push_back(ridge.Map(names, set.terms, strength));
      fit.candidates.push_back({set.name, strength, judge.ErrorMm(maps)});
      if (fit.candidates.back().error_mm < fit.best.error_mm) {
        fit.best = fit.candidates.back();
        best_terms = set.terms;
      }
    }
  }
  std::vector<const ArkitFrame*> all;
  for (const ArkitFrame& frame : frames) all.push_back(&frame);
  fit.map = Ridge(best_terms, all).Map(names, best_terms, fit.best.strength);
  return fit;
}

}  // namespace likeness
