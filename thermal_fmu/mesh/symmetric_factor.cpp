#include "mesh/symmetric_factor.hpp"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <numeric>

#include "core/spin_lock.hpp"

namespace thermal {
namespace {

using Eigen::Index;
using SparseMatrix = SymmetricFactor::SparseMatrix;

constexpr std::size_t kMaxOrders = 64;          // kept: the meshes of a search, in harmonics, of a few sections
constexpr std::size_t kMaxEntries = 4'000'000;  // of all their matrices together, at about 40 bytes

std::atomic_flag orders_are_taken;

std::deque<std::shared_ptr<const EliminationOrder>>& kept_orders() {
  static std::deque<std::shared_ptr<const EliminationOrder>> orders;
  return orders;
}

bool fits(const EliminationOrder& order, const SparseMatrix& matrix) {
  return order.columns.size() == static_cast<std::size_t>(matrix.outerSize() + 1) &&
         order.rows.size() == static_cast<std::size_t>(matrix.nonZeros()) &&
         std::equal(order.columns.begin(), order.columns.end(), matrix.outerIndexPtr()) &&
         std::equal(order.rows.begin(), order.rows.end(), matrix.innerIndexPtr());
}

/// The pattern of L, row by row: columns that an entry of the upper triangle reaches along the elimination tree (Davis,
/// Direct Methods for Sparse Linear Systems, SIAM 2006, 4.1).
void find_factor_pattern(EliminationOrder& order) {
  const auto size = static_cast<int>(order.diagonal_source.size());
  const auto n = static_cast<std::size_t>(size);
  std::vector<int> parent(n, -1), reached_by(n, -1), path(n), count(n, 0);
  order.reach_begin.push_back(0);
  for (int k = 0; k < size; ++k) {
    auto top = static_cast<std::size_t>(size);
    reached_by[static_cast<std::size_t>(k)] = k;
    for (int entry = order.upper_begin[k]; entry < order.upper_begin[k + 1]; ++entry) {
      std::size_t length = 0;
      for (int i = order.upper_row[entry]; reached_by[i] != k; i = parent[i]) {
        if (parent[i] < 0) parent[i] = k;
        reached_by[i] = k;
        path[length++] = i;
      }
      while (length > 0) path[--top] = path[--length];
    }
    order.reach_column.insert(order.reach_column.end(), path.begin() + static_cast<std::ptrdiff_t>(top), path.end());
    order.reach_begin.push_back(static_cast<int>(order.reach_column.size()));
  }
  for (const int column : order.reach_column) ++count[column];
  order.lower_begin.assign(n + 1, 0);
  std::partial_sum(count.begin(), count.end(), order.lower_begin.begin() + 1);
  std::vector<int> next(order.lower_begin.begin(), order.lower_begin.end() - 1);
  order.lower_row.resize(order.reach_column.size());
  for (int k = 0; k < size; ++k)
    for (int entry = order.reach_begin[k]; entry < order.reach_begin[k + 1]; ++entry) {
      const int position = next[order.reach_column[entry]]++;
      order.reach_position.push_back(position);
      order.lower_row[position] = k;
    }
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
  SparseMatrix upper(matrix.rows(), matrix.cols());
  upper.selfadjointView<Eigen::Upper>() = numbered.selfadjointView<Eigen::Lower>().twistedBy(order->to);
  order->diagonal_source.resize(static_cast<std::size_t>(matrix.rows()));
  order->upper_begin.push_back(0);
  for (Index column = 0; column < upper.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(upper, column); entry; ++entry) {
      const auto source = static_cast<Index>(entry.value());
      if (entry.row() == column) {
        order->diagonal_source[static_cast<std::size_t>(column)] = source;
      } else {
        order->upper_row.push_back(static_cast<int>(entry.row()));
        order->upper_source.push_back(source);
      }
    }
    order->upper_begin.push_back(static_cast<int>(order->upper_row.size()));
  }
  find_factor_pattern(*order);
  return order;
}

std::shared_ptr<const EliminationOrder> order_of(const SparseMatrix& matrix) {
  {
    const core::SpinLock lock(orders_are_taken);
    for (const auto& each : kept_orders())
      if (fits(*each, matrix)) return each;
  }
  auto order = find_order(matrix);
  const core::SpinLock lock(orders_are_taken);
  auto& orders = kept_orders();
  orders.push_back(order);
  std::size_t entries = 0;
  for (const auto& each : orders) entries += each->rows.size();
  for (; orders.size() > kMaxOrders || (entries > kMaxEntries && orders.size() > 1); orders.pop_front())
    entries -= orders.front()->rows.size();
  return order;
}

constexpr int kLanes = 4;  // shifts whose factors are found at once: entries of L are read from four places together

}  // namespace

SymmetricFactor::SymmetricFactor(const SparseMatrix& matrix, const Eigen::VectorXd& weights)
    : order_(order_of(matrix)),
      upper_(order_->upper_source.size()),
      diagonal_(order_->diagonal_source.size()),
      weights_(diagonal_.size()) {
  for (std::size_t k = 0; k < upper_.size(); ++k) upper_[k] = matrix.valuePtr()[order_->upper_source[k]];
  for (std::size_t k = 0; k < diagonal_.size(); ++k) diagonal_[k] = matrix.valuePtr()[order_->diagonal_source[k]];
  for (Index row = 0; row < weights.size(); ++row)
    weights_[static_cast<std::size_t>(order_->to.indices()[row])] = weights[row];
}

std::vector<Eigen::MatrixXd> SymmetricFactor::solve(std::span<const double> shifts,
                                                    const Eigen::MatrixXd& right) const {
  std::vector<Eigen::MatrixXd> solutions(shifts.size(), Eigen::MatrixXd(right.rows(), right.cols()));
  if (shifts.size() == 1) {
    solve<1>(shifts.data(), right, solutions);
    return solutions;
  }
  for (std::size_t first = 0; first < shifts.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, shifts.size() - first);
    std::array<double, kLanes> some;
    for (std::size_t k = 0; k < kLanes; ++k) some[k] = shifts[first + std::min(k, count - 1)];
    solve<kLanes>(some.data(), right, std::span(solutions).subspan(first, count));
  }
  return solutions;
}

/// Row by row, each by substitution in those above it.
template <int lanes>
void SymmetricFactor::factor(const Eigen::Array<double, lanes, 1>& shift, Factors<lanes>& factors) const {
  const EliminationOrder& order = *order_;
  const auto size = static_cast<Index>(diagonal_.size());
  auto& [lower, pivots, row] = factors;
  if (row.cols() != size) {
    lower.resize(lanes, static_cast<Index>(order.lower_row.size()));
    pivots.resize(lanes, size);
    row.setZero(lanes, size);
  }
  for (Index k = 0; k < size; ++k) {
    for (int entry = order.upper_begin[k]; entry < order.upper_begin[k + 1]; ++entry)
      row.col(order.upper_row[entry]) = upper_[entry];
    Eigen::Array<double, lanes, 1> pivot = diagonal_[k] + shift * weights_[k];
    for (int entry = order.reach_begin[k]; entry < order.reach_begin[k + 1]; ++entry) {
      const int column = order.reach_column[entry], position = order.reach_position[entry];
      const Eigen::Array<double, lanes, 1> value = row.col(column);
      row.col(column) = 0.0;
      for (int p = order.lower_begin[column]; p < position; ++p) row.col(order.lower_row[p]) -= lower.col(p) * value;
      lower.col(position) = value / pivots.col(column);
      pivot -= lower.col(position) * value;
    }
    pivots.col(k) = pivot;
  }
}

bool SymmetricFactor::factor(double shift, Factors<1>& factors) const {
  factor<1>(Eigen::Array<double, 1, 1>(shift), factors);
  return (factors.pivots != 0.0).all();
}

void SymmetricFactor::substitute(const Factors<1>& factors, const Eigen::VectorXd& inverse_pivots,
                                 const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::VectorXd& work,
                                 Eigen::Ref<Eigen::VectorXd> x) const {
  const EliminationOrder& order = *order_;
  const double* lower = factors.lower.data();
  work.noalias() = order.to * b;
  for (Index j = 0; j < work.size(); ++j)
    for (int p = order.lower_begin[j]; p < order.lower_begin[j + 1]; ++p)
      work[order.lower_row[p]] -= lower[p] * work[j];
  work.array() *= inverse_pivots.array();
  for (Index j = work.size(); j-- > 0;)
    for (int p = order.lower_begin[j]; p < order.lower_begin[j + 1]; ++p)
      work[j] -= lower[p] * work[order.lower_row[p]];
  x.noalias() = order.to.transpose() * work;
}

/// Factors, then substitutes in L, D and L'. Columns of the arrays hold one number of each shift's.
template <int lanes>
void SymmetricFactor::solve(const double* shifts, const Eigen::MatrixXd& right,
                            std::span<Eigen::MatrixXd> solutions) const {
  using Lane = Eigen::Array<double, lanes, 1>;
  using Lanes = Eigen::Array<double, lanes, Eigen::Dynamic>;
  const EliminationOrder& order = *order_;
  const Index size = right.rows(), columns = right.cols();
  Factors<lanes> factors;
  factor<lanes>(Eigen::Map<const Lane>(shifts), factors);
  const auto& [lower, pivots, row] = factors;

  Lanes x(lanes, size * columns);  // columns of one row side by side
  for (Index i = 0; i < size; ++i)
    for (Index c = 0; c < columns; ++c) x.col(order.to.indices()[i] * columns + c) = right(i, c);
  const auto subtract = [&](Index from, int position, Index of) {
    for (Index c = 0; c < columns; ++c) x.col(from * columns + c) -= lower.col(position) * x.col(of * columns + c);
  };
  for (Index j = 0; j < size; ++j)
    for (int p = order.lower_begin[j]; p < order.lower_begin[j + 1]; ++p) subtract(order.lower_row[p], p, j);
  for (Index j = 0; j < size; ++j) {
    const Lane inverse = pivots.col(j).inverse();
    for (Index c = 0; c < columns; ++c) x.col(j * columns + c) *= inverse;
  }
  for (Index j = size; j-- > 0;)
    for (int p = order.lower_begin[j]; p < order.lower_begin[j + 1]; ++p) subtract(j, p, order.lower_row[p]);
  for (std::size_t k = 0; k < solutions.size(); ++k)
    for (Index i = 0; i < size; ++i)
      for (Index c = 0; c < columns; ++c)
        solutions[k](i, c) = x(static_cast<Index>(k), order.to.indices()[i] * columns + c);
}

}  // namespace thermal
