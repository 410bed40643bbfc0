#include "mesh/symmetric_factor.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <atomic>
#include <deque>

#include "core/spin_lock.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using SparseMatrix = SymmetricFactor::SparseMatrix;

constexpr std::size_t kMaxOrders = 64;          // kept: the meshes of a search, in harmonics, of a few sections
constexpr std::size_t kMaxEntries = 4'000'000;  // of all their matrices together, at about 40 bytes

std::atomic_flag is_taken;

std::deque<std::shared_ptr<const EliminationOrder>>& kept() {
  static std::deque<std::shared_ptr<const EliminationOrder>> orders;
  return orders;
}

bool fits(const EliminationOrder& order, const SparseMatrix& matrix) {
  return order.columns.size() == static_cast<std::size_t>(matrix.outerSize() + 1) &&
         order.rows.size() == static_cast<std::size_t>(matrix.nonZeros()) &&
         std::equal(order.columns.begin(), order.columns.end(), matrix.outerIndexPtr()) &&
         std::equal(order.rows.begin(), order.rows.end(), matrix.innerIndexPtr());
}

/// Approximate minimum degree.
std::shared_ptr<const EliminationOrder> find_order(const SparseMatrix& matrix) {
  auto order = std::make_shared<EliminationOrder>();
  order->columns.assign(matrix.outerIndexPtr(), matrix.outerIndexPtr() + matrix.outerSize() + 1);
  order->rows.assign(matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
  Eigen::PermutationMatrix<Eigen::Dynamic> from;
  Eigen::AMDOrdering<int>()(matrix.selfadjointView<Eigen::Lower>(), from);
  order->to = from.inverse();
  SparseMatrix numbered = matrix;  // whose values are the numbers of its entries
  for (Index k = 0; k < numbered.nonZeros(); ++k) numbered.valuePtr()[k] = static_cast<double>(k);
  order->upper.resize(matrix.rows(), matrix.cols());
  order->upper.selfadjointView<Eigen::Upper>() = numbered.selfadjointView<Eigen::Lower>().twistedBy(order->to);
  order->upper.makeCompressed();
  order->source.resize(static_cast<std::size_t>(order->upper.nonZeros()));
  for (std::size_t k = 0; k < order->source.size(); ++k)
    order->source[k] = static_cast<Index>(order->upper.valuePtr()[k]);
  order->diagonal.resize(static_cast<std::size_t>(matrix.rows()));
  std::vector<Index> of_column(order->diagonal.size());
  for (Index column = 0; column < order->upper.outerSize(); ++column)
    for (Index k = order->upper.outerIndexPtr()[column]; k < order->upper.outerIndexPtr()[column + 1]; ++k)
      if (order->upper.innerIndexPtr()[k] == column) of_column[static_cast<std::size_t>(column)] = k;
  for (std::size_t row = 0; row < of_column.size(); ++row)
    order->diagonal[row] = of_column[static_cast<std::size_t>(order->to.indices()[static_cast<Index>(row)])];
  return order;
}

std::shared_ptr<const EliminationOrder> order_of(const SparseMatrix& matrix) {
  {
    const core::SpinLock lock(is_taken);
    for (const auto& each : kept())
      if (fits(*each, matrix)) return each;
  }
  auto order = find_order(matrix);
  const core::SpinLock lock(is_taken);
  auto& orders = kept();
  orders.push_back(order);
  std::size_t entries = 0;
  for (const auto& each : orders) entries += each->rows.size();
  for (; orders.size() > kMaxOrders || (entries > kMaxEntries && orders.size() > 1); orders.pop_front())
    entries -= orders.front()->rows.size();
  return order;
}

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The solution in place of the right side. `columns`: their number where it is known when compiling, else 0.
template <int columns>
void substitute(const LdlSolver& solver, Rows& rows) {
  const SparseMatrix& lower = solver.matrixL().nestedExpression();  // without its diagonal of ones
  const Eigen::VectorXd diagonal = solver.vectorD();
  const Index width = columns > 0 ? columns : rows.cols();
  double* const first = rows.data();
  const auto subtract = [width](double* from, double factor, const double* row) {
    for (Index c = 0; c < width; ++c) from[c] -= factor * row[c];
  };
  const auto* const begins = lower.outerIndexPtr();
  const auto* const indices = lower.innerIndexPtr();
  const double* const values = lower.valuePtr();
  const auto* const counts = lower.innerNonZeroPtr();  // null where the factor is compressed
  const auto end = [&](Index j) { return counts ? begins[j] + counts[j] : begins[j + 1]; };
  for (Index j = 0; j < lower.outerSize(); ++j)
    for (auto k = begins[j]; k < end(j); ++k) subtract(first + indices[k] * width, values[k], first + j * width);
  rows = diagonal.asDiagonal().inverse() * rows;
  for (Index j = lower.outerSize(); j-- > 0;)
    for (auto k = begins[j]; k < end(j); ++k) subtract(first + j * width, values[k], first + indices[k] * width);
}

}  // namespace

SymmetricFactor::SymmetricFactor(const SparseMatrix& matrix) : order_(order_of(matrix)), upper_(order_->upper) {
  for (std::size_t k = 0; k < order_->source.size(); ++k) upper_.valuePtr()[k] = matrix.valuePtr()[order_->source[k]];
  diagonal_.reserve(order_->diagonal.size());
  for (const Index entry : order_->diagonal) diagonal_.push_back(upper_.valuePtr()[entry]);
  {
    const core::SpinLock lock(is_taken);
    if (!order_->idle.empty()) {
      ldlt_ = std::move(order_->idle.back());
      order_->idle.pop_back();
    }
  }
  if (ldlt_) return;
  ldlt_ = std::make_unique<LdlSolver>();
  ldlt_->analyzePattern(upper_);
}

SymmetricFactor::~SymmetricFactor() {
  if (!ldlt_) return;  // moved from
  const core::SpinLock lock(is_taken);
  order_->idle.push_back(std::move(ldlt_));
}

void SymmetricFactor::factor(const Eigen::VectorXd& added) {
  for (std::size_t row = 0; row < diagonal_.size(); ++row)
    upper_.valuePtr()[order_->diagonal[row]] = diagonal_[row] + added[static_cast<Index>(row)];
  ldlt_->factorize(upper_);
}

void SymmetricFactor::factor(double shift) {
  for (std::size_t row = 0; row < diagonal_.size(); ++row)
    upper_.valuePtr()[order_->diagonal[row]] = diagonal_[row] + shift;
  ldlt_->factorize(upper_);
}

/// Substitutes in L, D and L', all columns of the right side at once: rows of them lie side by side.
Eigen::MatrixXd SymmetricFactor::solve(const Eigen::MatrixXd& right) const {
  Rows rows = order_->to * right;
  switch (rows.cols()) {
    case 1:
      substitute<1>(*ldlt_, rows);
      break;
    case 2:
      substitute<2>(*ldlt_, rows);
      break;
    case 4:
      substitute<4>(*ldlt_, rows);
      break;
    default:
      substitute<0>(*ldlt_, rows);
  }
  return order_->to.inverse() * rows;
}

}  // namespace thermal
