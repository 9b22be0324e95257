// A tree of joints from a text of numbers, as a pinocchio::Model.
//
// Built in the program's own translation unit: with -march=native Eigen aligns more strictly than in the wheel's library,
// so no Model may cross that border. One joint per line, parents first:
//     parent  kind  axis(3)  rotation(9, by rows)  translation(3)  mass  centre of mass(3)  inertia(xx xy xz yy yz zz)
#pragma once
#include <pinocchio/multibody.hpp>

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

inline pinocchio::Model read_model(const std::string &path)
{
    std::ifstream file(path);
    if (!file) {
        throw std::runtime_error("cannot open " + path);
    }
    pinocchio::Model model;
    std::size_t parent;
    std::string kind;
    while (file >> parent >> kind) {
        std::vector<double> x(25);
        for (double &value : x) {
            file >> value;
        }
        if (!file) {
            throw std::runtime_error("a line of " + path + " is too short");
        }
        const Eigen::Vector3d axis(x[0], x[1], x[2]);
        Eigen::Matrix3d rotation, inertia;
        rotation << x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11];
        inertia << x[19], x[20], x[21], x[20], x[22], x[23], x[21], x[23], x[24];
        const pinocchio::SE3 placement(rotation, Eigen::Vector3d(x[12], x[13], x[14]));
        const auto add = [&](const auto &joint) { return model.addJoint(parent, joint, placement, "joint" + std::to_string(model.njoints)); };
        pinocchio::JointIndex index;
        const bool revolute = kind == "revolute", prismatic = kind == "prismatic";
        if (kind == "free") {
            index = add(pinocchio::JointModelFreeFlyer());
        } else if (revolute && axis == Eigen::Vector3d::UnitX()) {
            index = add(pinocchio::JointModelRX());
        } else if (revolute && axis == Eigen::Vector3d::UnitY()) {
            index = add(pinocchio::JointModelRY());
        } else if (revolute && axis == Eigen::Vector3d::UnitZ()) {
            index = add(pinocchio::JointModelRZ());
        } else if (revolute) {
            index = add(pinocchio::JointModelRevoluteUnaligned(axis));
        } else if (prismatic && axis == Eigen::Vector3d::UnitX()) {
            index = add(pinocchio::JointModelPX());
        } else if (prismatic && axis == Eigen::Vector3d::UnitY()) {
            index = add(pinocchio::JointModelPY());
        } else if (prismatic && axis == Eigen::Vector3d::UnitZ()) {
            index = add(pinocchio::JointModelPZ());
        } else {
            throw std::runtime_error("joints of kind " + kind + " along this axis are not read");
        }
        const Eigen::Vector3d centre(x[16], x[17], x[18]);
        model.appendBodyToJoint(index, pinocchio::Inertia(x[15], centre, inertia), pinocchio::SE3::Identity());
    }
    return model;
}
