/* The arm of `benches/evaluation` by MuJoCo: `mj_forward`, and its parts that accelerations without contacts
 * need. */
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = 7 };
static mjModel *model;
static mjData *data;

static void load(void) {
    char text[16384];
    int used = snprintf(text, sizeof text,
        "<mujoco><compiler angle='radian' inertiafromgeom='false' boundmass='0' boundinertia='0'/>"
        "<option gravity='0 0 -9.81'><flag constraint='disable' contact='disable' limit='disable' "
        "equality='disable' frictionloss='disable' "
        "actuation='disable' energy='disable' sensor='disable' autoreset='disable'/></option><worldbody>");
    for (int i = 1; i <= N; i++) {
        double half = sqrt(0.5), turn = i == 1 ? 0 : i % 2 ? half : -half;
        used += snprintf(text + used, sizeof text - used,
            "<body pos='0.02 %.17g %.17g' quat='%.17g %.17g 0 0'>"
            "<inertial pos='0.01 %g 0.1' mass='%.17g' fullinertia='0.02 0.018 0.01 0.001 0.002 0.0015'/>"
            "<joint type='hinge' axis='0 0 1'/>",
            -0.01 * i, 0.2 + 0.01 * i, i == 1 ? 1.0 : half, turn, i % 2 ? -0.02 : 0.02, 3.0 - 0.3 * i);
    }
    for (int i = 1; i <= N; i++) used += snprintf(text + used, sizeof text - used, "</body>");
    snprintf(text + used, sizeof text - used, "</worldbody></mujoco>");
    mjVFS files;
    char error[1000] = "";
    mj_defaultVFS(&files);
    mj_addBufferVFS(&files, "arm.xml", text, (int)strlen(text));
    model = mj_loadXML("arm.xml", &files, error, sizeof error);
    if (!model) {
        fprintf(stderr, "MuJoCo: %s\n", error);
        exit(1);
    }
    data = mj_makeData(model);
}

static void place(const double *state) {
    if (!model) load();
    memcpy(data->qpos, state, sizeof(double) * N);
    memcpy(data->qvel, state + N, sizeof(double) * N);
}

void peer_arm_mujoco_forward(const double *state, double *a) {
    place(state);
    mj_forward(model, data);
    memcpy(a, data->qacc, sizeof(double) * N);
}

void peer_arm_mujoco_parts(const double *state, double *a) {
    place(state);
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mj_crb(model, data);
    mj_factorM(model, data);
    mj_comVel(model, data);
    mj_rne(model, data, 0, data->qfrc_bias);
    for (int i = 0; i < N; i++) a[i] = -data->qfrc_bias[i];
    mj_solveM(model, data, a, a, 1);
}
