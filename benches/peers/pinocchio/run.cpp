// Pinocchio itself: the articulated-body algorithm, compiled once for all models.
#include "models.hpp"
#include <pinocchio/algorithm/aba.hpp>

namespace {
struct Robot {
    pinocchio::Model model;
    pinocchio::Data data;
    Eigen::VectorXd q, u, none;
    bool absolute;

    explicit Robot(const std::string &name)
        : model(built(name)), data(model), q(model.nv), u(model.nv),
          none(Eigen::VectorXd::Zero(model.nv)), absolute(name != "arm") {}

    void run(const double *at, const double *rates, double *a, pinocchio::Convention convention) {
        int n = model.nv, first = n == 2 ? 0 : 1;
        for (int i = 0; i < n; i++) {
            // Angles of chains are absolute here, relative there.
            bool turned = absolute && i > first;
            q[i] = at[i] - (turned ? at[i - 1] : 0.0);
            u[i] = rates[i] - (turned ? rates[i - 1] : 0.0);
        }
        pinocchio::aba(model, data, q, u, none, convention);
        for (int i = 0; i < n; i++) a[i] = data.ddq[i] + (absolute && i > first ? a[i - 1] : 0.0);
    }
};
} // namespace

#define ROBOT(function, name)                                                                        \
    extern "C" void peer_##function##_aba_at_run_time(const double *state, double *a) {              \
        static Robot robot(name);                                                                    \
        robot.run(state, state + robot.model.nv, a, pinocchio::Convention::WORLD);                   \
    }
ROBOT(double_pendulum, "double pendulum")
ROBOT(chain_5, "chain:5")
ROBOT(chain_10, "chain:10")
ROBOT(chain_20, "chain:20")
ROBOT(chain_50, "chain:50")
ROBOT(arm, "arm")
