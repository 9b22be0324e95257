// Evaluates or times Pinocchio's second derivatives of inverse dynamics, tensors of nv^3 numbers.
//
//     second_derivatives_pinocchio results MODEL STATES RESULTS WEIGHTS
//     second_derivatives_pinocchio time MODEL STATES BATCHES
//
// Results are the Hessians of weights . tau, dense, in q, v and a: sums of the tensors over tau. The mean of both orders
// of two directions of q makes them symmetric, since directions of a free joint do not commute. Times are of the tensors.
#include "read_model.hpp"
#include "time_batches.h"

#include <pinocchio/algorithm/rnea-second-order-derivatives.hpp>

#include <iostream>
#include <memory>

namespace pin = pinocchio;

struct State
{
    Eigen::VectorXd q, v, a;
};

static pin::Model model;
static std::unique_ptr<pin::Data> data;
static std::vector<State> states;
static volatile double sink;

static void evaluate(const State &s)
{
    pin::ComputeRNEASecondOrderDerivatives(model, *data, s.q, s.v, s.a, data->d2tau_dqdq, data->d2tau_dvdv, data->d2tau_dqdv, data->d2tau_dadq);
    sink = data->d2tau_dqdq(0, 0, 0);
}

static void repeat(long calls)
{
    for (long k = 0; k < calls; ++k) {
        evaluate(states[static_cast<std::size_t>(k % STATES)]);
    }
}

static Eigen::MatrixXd hessian(const Eigen::VectorXd &weights)
{
    const int n = model.nv;
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            for (int k = 0; k < n; ++k) {
                H(j, k) += weights[i] * (data->d2tau_dqdq(i, j, k) + data->d2tau_dqdq(i, k, j)) / 2;
                H(n + j, n + k) += weights[i] * (data->d2tau_dvdv(i, j, k) + data->d2tau_dvdv(i, k, j)) / 2;
                H(j, n + k) += weights[i] * data->d2tau_dqdv(i, j, k);
                H(2 * n + j, k) += weights[i] * data->d2tau_dadq(i, j, k);
            }
        }
    }
    H.block(n, 0, n, n) = H.block(0, n, n, n).transpose();
    H.block(0, 2 * n, n, n) = H.block(2 * n, 0, n, n).transpose();
    return H;
}

int main(int count, char **words)
{
    if (count < 5) {
        std::cerr << "wrong arguments\n";
        return 2;
    }
    model = read_model(words[2]);
    data = std::make_unique<pin::Data>(model);
    const Eigen::Index width = model.nq + 2 * model.nv;
    const double *numbers = read_doubles(words[3], static_cast<std::size_t>(STATES * width));
    for (int k = 0; k < STATES; ++k) {
        const Eigen::Map<const Eigen::VectorXd> row(numbers + k * width, width);
        states.push_back({row.head(model.nq), row.segment(model.nq, model.nv), row.tail(model.nv)});
    }
    if (std::string(words[1]) == "time") {
        time_batches(repeat, std::stoi(words[4]));
        return 0;
    }
    const Eigen::Map<const Eigen::VectorXd> weights(read_doubles(words[5], static_cast<std::size_t>(model.nv)), model.nv);
    std::vector<double> rows;
    for (const State &state : states) {
        evaluate(state);
        const Eigen::MatrixXd H = hessian(weights);
        rows.insert(rows.end(), H.data(), H.data() + H.size());
    }
    write_doubles(words[4], rows.data(), rows.size());
    return 0;
}
