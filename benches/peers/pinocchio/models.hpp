// The double pendulum, chains and the arm of `benches/evaluation`, for Pinocchio.
#pragma once
#include <pinocchio/multibody.hpp>
#include <pinocchio/spatial.hpp>
#include <string>

inline double mass_of(int i) { return 1.0 + 0.1 * ((i + 1) % 7); }
inline double length_of(int i) { return 1.0 - 0.02 * ((i + 1) % 9); }

inline pinocchio::Model built(const std::string &name) {
    using namespace pinocchio;
    using Eigen::Matrix3d, Eigen::Vector3d;
    Model model;
    model.gravity.linear(Vector3d(0, 0, -9.81));
    JointIndex last = 0;
    SE3 place = SE3::Identity();
    if (name == "arm") {
        Matrix3d inertia;
        inertia << 0.02, 0.001, 0.002, 0.001, 0.018, 0.0015, 0.002, 0.0015, 0.01;
        for (int i = 1; i <= 7; i++) {
            Matrix3d turn = Matrix3d::Identity();
            double quarter = i == 1 ? 0 : i % 2 ? 1 : -1;
            if (quarter != 0) turn << 1, 0, 0, 0, 0, -quarter, 0, quarter, 0;
            const SE3 hinge(turn, Vector3d(0.02, -0.01 * i, 0.2 + 0.01 * i));
            last = model.addJoint(last, JointModelRZ(), hinge, "hinge" + std::to_string(i));
            const Vector3d centre(0.01, i % 2 ? -0.02 : 0.02, 0.1);
            model.appendBodyToJoint(last, Inertia(3.0 - 0.3 * i, centre, inertia), SE3::Identity());
        }
        return model;
    }
    bool cart = name != "double pendulum" && name != "double_pendulum";
    int links = cart ? std::stoi(name.substr(name.find(':') + 1)) : 2;
    if (cart) {
        last = model.addJoint(0, JointModelPX(), place, "cart");
        model.appendBodyToJoint(last, Inertia(2.0, Vector3d::Zero(), Matrix3d::Zero()), SE3::Identity());
    }
    // Links hang down, and lean toward x where angles grow: about y turned round.
    place = SE3(Eigen::DiagonalMatrix<double, 3>(-1, -1, 1).toDenseMatrix(), Vector3d::Zero());
    for (int i = 0; i < links; i++) {
        double m = cart ? mass_of(i) : i == 0 ? 1.0 : 1.3, l = cart ? length_of(i) : i == 0 ? 1.0 : 0.8;
        last = model.addJoint(last, JointModelRY(), place, "link" + std::to_string(i));
        model.appendBodyToJoint(last, Inertia(m, Vector3d(0, 0, -l), Matrix3d::Zero()), SE3::Identity());
        place = SE3(Matrix3d::Identity(), Vector3d(0, 0, -l));
    }
    return model;
}
