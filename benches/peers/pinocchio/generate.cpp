// Writes the accelerations of chains and of the arm as C: Pinocchio's articulated-body algorithm, and its
// composite rigid bodies with an LDLᵀ, on CasADi's symbols.
//
//   generate FOLDER MODEL..., a model being `chain:5` or `arm`; writes MODEL_aba.c and MODEL_crba.c with
//   functions of these names.
#include <casadi/casadi.hpp>
#include <pinocchio/autodiff/casadi.hpp>

#include "models.hpp"
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>

using Symbol = casadi::SX;
using Symbols = Eigen::Matrix<Symbol, Eigen::Dynamic, 1>;

static void write(const std::string &folder, const std::string &name, const Symbol &q, const Symbol &u,
                  const Symbol &a) {
    casadi::Function function(name, {q, u}, {casadi::SX::densify(a)}, casadi::Dict{{"cse", true}});
    casadi::CodeGenerator code(name + ".c", casadi::Dict{{"with_header", false}, {"codegen_scalars", true}});
    code.add(function);
    code.generate(folder + "/");
    std::cout << name << " " << function.n_instructions() << " " << function.sz_w() << "\n";
}

int main(int count, char **arguments) {
    for (int argument = 2; argument < count; argument++) {
        std::string name = arguments[argument];
        pinocchio::ModelTpl<Symbol> model = built(name).cast<Symbol>();
        pinocchio::DataTpl<Symbol> data(model);
        int n = model.nv;
        Symbol q = Symbol::sym("q", n), u = Symbol::sym("u", n), a(n, 1), mass(n, n), force(n, 1);
        Symbols at(n), rates(n), torques(n);
        for (int i = 0; i < n; i++) at[i] = q(i), rates[i] = u(i), torques[i] = 0;
        for (char &c : name) c = c == ':' ? '_' : c;
        pinocchio::aba(model, data, at, rates, torques, pinocchio::Convention::LOCAL);
        for (int i = 0; i < n; i++) a(i) = data.ddq[i];
        write(arguments[1], name + "_aba", q, u, a);
        // An LDLᵀ of fifty rows is 60,000 operations, which gcc compiles for minutes.
        if (n > 25) continue;
        pinocchio::crba(model, data, at);
        pinocchio::nonLinearEffects(model, data, at, rates);
        for (int i = 0; i < n; i++) {
            force(i) = -data.nle[i];
            for (int j = 0; j < n; j++) mass(i, j) = i <= j ? data.M(i, j) : data.M(j, i);
        }
        Symbol d, lt;
        std::vector<casadi_int> order;
        casadi::SX::ldl(mass, d, lt, order, false);
        write(arguments[1], name + "_crba", q, u, casadi::SX::ldl_solve(force, d, lt, order));
    }
}
