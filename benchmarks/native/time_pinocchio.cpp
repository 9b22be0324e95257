// Evaluates or times one of Pinocchio's algorithms in C++.
//
//     time_pinocchio results VARIANT MODEL STATES RESULTS
//     time_pinocchio time VARIANT MODEL STATES BATCHES
//
// A state is q, v and x, where x is an acceleration or an effort as the algorithm needs.
#include "read_model.hpp"
#include "time_batches.h"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/cholesky.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <functional>
#include <iostream>
#include <map>
#include <memory>

namespace pin = pinocchio;

struct State
{
    Eigen::VectorXd q, v, x;
};

static pin::Model model;
static std::unique_ptr<pin::Data> data;
static std::vector<State> states;
static Eigen::MatrixXd K, C, M;
static Eigen::VectorXd right;
static volatile double sink;

// Each variant is a loop of its own, so that the call is not behind a pointer.
template <class Call> static void repeat(long calls, Call call)
{
    for (long k = 0; k < calls; ++k) {
        call(states[static_cast<std::size_t>(k % STATES)]);
    }
}

static void rnea(const State &s) { sink = pin::rnea(model, *data, s.q, s.v, s.x)[0]; }
static void crba_local(const State &s) { sink = pin::crba(model, *data, s.q, pin::Convention::LOCAL)(0, 0); }
static void crba_world(const State &s) { sink = pin::crba(model, *data, s.q, pin::Convention::WORLD)(0, 0); }
static void aba_local(const State &s) { sink = pin::aba(model, *data, s.q, s.v, s.x, pin::Convention::LOCAL)[0]; }
static void aba_world(const State &s) { sink = pin::aba(model, *data, s.q, s.v, s.x, pin::Convention::WORLD)[0]; }
static void cholesky(const State &s)
{
    pin::crba(model, *data, s.q, pin::Convention::LOCAL);
    right.noalias() = s.x - pin::nonLinearEffects(model, *data, s.q, s.v);
    pin::cholesky::decompose(model, *data);
    pin::cholesky::solve(model, *data, right);
    sink = right[0];
}
static void derivatives(const State &s)
{
    pin::computeRNEADerivatives(model, *data, s.q, s.v, s.x, K, C, M);
    sink = K(0, 0);
}
static void regressor(const State &s)
{
    sink = pin::computeJointTorqueRegressor(model, *data, s.q, s.v, s.x)(0, 0);
}

struct Variant
{
    repeated_call run;
    std::function<void(std::vector<double> &)> keep; // appends the result of the last call
};

static void append(std::vector<double> &row, const Eigen::MatrixXd &matrix)
{
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
            row.push_back(matrix(i, j));
        }
    }
}

static Eigen::MatrixXd symmetric(const Eigen::MatrixXd &upper)
{
    return upper.selfadjointView<Eigen::Upper>();
}

static const std::map<std::string, Variant> variants = {
    {"rnea", {[](long n) { repeat(n, rnea); }, [](std::vector<double> &row) { append(row, data->tau); }}},
    {"crba local", {[](long n) { repeat(n, crba_local); }, [](std::vector<double> &row) { append(row, symmetric(data->M)); }}},
    {"crba world", {[](long n) { repeat(n, crba_world); }, [](std::vector<double> &row) { append(row, symmetric(data->M)); }}},
    {"aba local", {[](long n) { repeat(n, aba_local); }, [](std::vector<double> &row) { append(row, data->ddq); }}},
    {"aba world", {[](long n) { repeat(n, aba_world); }, [](std::vector<double> &row) { append(row, data->ddq); }}},
    {"crba, bias, cholesky", {[](long n) { repeat(n, cholesky); }, [](std::vector<double> &row) { append(row, right); }}},
    {"analytic derivatives",
     {[](long n) { repeat(n, derivatives); },
      [](std::vector<double> &row) {
          append(row, K);
          append(row, C);
          append(row, symmetric(M));
      }}},
    {"joint torque regressor",
     {[](long n) { repeat(n, regressor); },
      [](std::vector<double> &row) { append(row, data->jointTorqueRegressor); }}},
};

int main(int count, char **words)
{
    if (count != 6 || variants.count(words[2]) == 0) {
        std::cerr << "wrong arguments\n";
        return 2;
    }
    const Variant &variant = variants.at(words[2]);
    model = read_model(words[3]);
    data = std::make_unique<pin::Data>(model);
    const Eigen::Index width = model.nq + 2 * model.nv;
    const double *numbers = read_doubles(words[4], static_cast<std::size_t>(STATES * width));
    for (int k = 0; k < STATES; ++k) {
        const Eigen::Map<const Eigen::VectorXd> row(numbers + k * width, width);
        states.push_back({row.head(model.nq), row.segment(model.nq, model.nv), row.tail(model.nv)});
    }
    K.setZero(model.nv, model.nv);
    C.setZero(model.nv, model.nv);
    M.setZero(model.nv, model.nv);
    right.setZero(model.nv);
    if (std::string(words[1]) == "time") {
        time_batches(variant.run, std::stoi(words[5]));
        return 0;
    }
    std::vector<double> rows;
    const std::vector<State> all = states;
    for (const State &state : all) {
        states[0] = state;
        variant.run(1);
        variant.keep(rows);
    }
    write_doubles(words[5], rows.data(), rows.size());
    return 0;
}
