// Runs Pinocchio's algorithms on CasADi's SX and lets CasADi write them as C.
//
//     trace_pinocchio MODEL FOLDER ALGORITHM...
//
// Writes FOLDER/traced_<algorithm>.c and prints one JSON object a line. Outputs are row-major; only entries that are not
// structurally zero are stored, and "places" says where they belong.
#include <pinocchio/autodiff/casadi.hpp>

#include "read_model.hpp"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/cholesky.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <chrono>
#include <functional>
#include <iostream>
#include <map>

namespace pin = pinocchio;
using SX = ::casadi::SX;
using Model = pin::ModelTpl<SX>;
using Data = pin::DataTpl<SX>;
using Vector = Eigen::Matrix<SX, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<SX, Eigen::Dynamic, Eigen::Dynamic>;

static Vector entries(const SX &column)
{
    Vector vector(column.rows());
    for (Eigen::Index i = 0; i < vector.size(); ++i) {
        vector[i] = column(i);
    }
    return vector;
}

static SX rows(const Matrix &matrix)
{
    SX result(matrix.rows() * matrix.cols(), 1);
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
            if (!matrix(i, j).scalar().is_zero()) {
                result(i * matrix.cols() + j) = matrix(i, j);
            }
        }
    }
    return result;
}

static SX rows(const SX &matrix) { return SX::vec(matrix.T()); }

static Matrix symmetric(Matrix matrix)
{
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        for (Eigen::Index j = 0; j < i; ++j) {
            matrix(i, j) = matrix(j, i);
        }
    }
    return matrix;
}

static Matrix zeros(Eigen::Index size) { return Matrix::Constant(size, size, SX(0)); }

struct Problem
{
    Model model;
    SX q, v, x;
    Vector q_entries, v_entries, x_entries;
};

using Algorithm = std::function<std::vector<SX>(const Problem &, Data &)>;

static std::vector<SX> by_cholesky(const Problem &p, Data &data)
{
    pin::crba(p.model, data, p.q_entries, pin::Convention::LOCAL);
    Vector right = p.x_entries - pin::nonLinearEffects(p.model, data, p.q_entries, p.v_entries);
    pin::cholesky::decompose(p.model, data);
    pin::cholesky::solve(p.model, data, right);
    return {rows(Matrix(right))};
}

static std::vector<SX> analytic(const Problem &p, Data &data)
{
    Matrix K = zeros(p.model.nv), C = zeros(p.model.nv), M = zeros(p.model.nv);
    pin::computeRNEADerivatives(p.model, data, p.q_entries, p.v_entries, p.x_entries, K, C, M);
    return {rows(K), rows(C), rows(symmetric(M))};
}

// The change of q (rows) along each component of a velocity in body axes (columns): position by R, quaternion by q * (0, omega) / 2.
static SX tangent(const Problem &p)
{
    SX columns(p.model.nq, p.model.nv);
    for (pin::JointIndex joint = 1; joint < static_cast<pin::JointIndex>(p.model.njoints); ++joint) {
        const int row = p.model.idx_qs[joint], column = p.model.idx_vs[joint];
        if (p.model.nqs[joint] == 1) {
            columns(row, column) = 1;
            continue;
        }
        const SX x = p.q(row + 3), y = p.q(row + 4), z = p.q(row + 5), w = p.q(row + 6);
        const SX rotation[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                                   {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                                   {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
        const SX product[4][3] = {{w, -z, y}, {z, w, -x}, {-y, x, w}, {-x, -y, -z}};
        for (int i = 0; i < 4; ++i) {
            for (int j = 0; j < 3; ++j) {
                if (i < 3) {
                    columns(row + i, column + j) = rotation[i][j];
                }
                columns(row + 3 + i, column + 3 + j) = product[i][j] / 2;
            }
        }
    }
    return columns;
}

// Differentiates the trace.
static std::vector<SX> automatic(const Problem &p, Data &data)
{
    const SX tau = rows(Matrix(pin::rnea(p.model, data, p.q_entries, p.v_entries, p.x_entries)));
    Data other(p.model);
    pin::crba(p.model, other, p.q_entries, pin::Convention::LOCAL);
    return {rows(SX::mtimes(SX::jacobian(tau, p.q), tangent(p))), rows(SX::jacobian(tau, p.v)), rows(symmetric(other.M))};
}

static const std::map<std::string, Algorithm> algorithms = {
    {"rnea", [](const Problem &p, Data &d) { return std::vector<SX>{rows(Matrix(pin::rnea(p.model, d, p.q_entries, p.v_entries, p.x_entries)))}; }},
    {"crba", [](const Problem &p, Data &d) { return std::vector<SX>{rows(symmetric(pin::crba(p.model, d, p.q_entries, pin::Convention::LOCAL)))}; }},
    {"aba", [](const Problem &p, Data &d) { return std::vector<SX>{rows(Matrix(pin::aba(p.model, d, p.q_entries, p.v_entries, p.x_entries, pin::Convention::LOCAL)))}; }},
    {"cholesky", by_cholesky},
    {"analytic", analytic},
    {"automatic", automatic},
};

static void describe(const ::casadi::Function &function, const std::vector<SX> &results, double seconds)
{
    int additions = 0, multiplications = 0;
    for (::casadi_int k = 0; k < function.n_instructions(); ++k) {
        const ::casadi_int kind = function.instruction_id(k);
        additions += kind == ::casadi::OP_ADD || kind == ::casadi::OP_SUB || kind == ::casadi::OP_TWICE;
        multiplications += kind == ::casadi::OP_MUL || kind == ::casadi::OP_SQ;
    }
    std::cout << "{\"name\": \"" << function.name() << "\", \"seconds\": " << seconds << ", \"additions\": " << additions
              << ", \"multiplications\": " << multiplications << ", \"arg\": " << function.sz_arg() << ", \"res\": " << function.sz_res()
              << ", \"iw\": " << function.sz_iw() << ", \"w\": " << function.sz_w() << ", \"outputs\": [";
    for (std::size_t k = 0; k < results.size(); ++k) {
        std::cout << (k ? ", " : "") << "{\"size\": " << results[k].rows() << ", \"places\": [";
        const std::vector<::casadi_int> places = results[k].sparsity().get_row();
        for (std::size_t i = 0; i < places.size(); ++i) {
            std::cout << (i ? ", " : "") << places[i];
        }
        std::cout << "]}";
    }
    std::cout << "]}" << std::endl;
}

int main(int count, char **words)
{
    using clock = std::chrono::steady_clock;
    if (count < 4) {
        return 2;
    }
    Problem problem;
    problem.model = read_model(words[1]).cast<SX>();
    problem.q = SX::sym("q", problem.model.nq);
    problem.v = SX::sym("v", problem.model.nv);
    problem.x = SX::sym("x", problem.model.nv);
    problem.q_entries = entries(problem.q);
    problem.v_entries = entries(problem.v);
    problem.x_entries = entries(problem.x);
    for (int k = 3; k < count; ++k) {
        const std::string name = std::string("traced_") + words[k];
        const auto start = clock::now();
        Data data(problem.model);
        const std::vector<SX> results = algorithms.at(words[k])(problem, data);
        const ::casadi::Function function(name, {problem.q, problem.v, problem.x}, results);
        ::casadi::CodeGenerator generator(name);
        generator.add(function);
        generator.generate(std::string(words[2]) + "/");
        describe(function, results, std::chrono::duration<double>(clock::now() - start).count());
    }
    return 0;
}
