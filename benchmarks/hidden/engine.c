/* Machine of four joints as ordinary differential equations, for benchmarks/hidden_machines.py. It shares no code with
   exograv: the links move by the principle of virtual power (Jacobians of the centres of mass), the motors turn behind
   elastic gears, and friction acts on the motors' side by bristles (LuGre) or by slipping springs (Maxwell slip).

   One call of `advance` integrates one period of control by Runge-Kutta steps of fourth order. `engine.py` holds the
   same structures. Units are SI, at the joint's side of the gear. */
#include <math.h>
#include <string.h>

#define N 4
#define SLIPS 6
#define COMMANDS 16
#define PAST 64
#define PARTS (6 + SLIPS)
#define STATES (PARTS * N)
#define V_SMOOTH 0.02 /* speed below which the power law of viscous friction becomes linear [rad/s] */

enum law { LUGRE, MAXWELL_SLIP };
enum part { Q, V, THETA, OMEGA, CURRENT, CURRENT_RATE, BRISTLES };

struct machine {
    double axis[N][3], origin[N][3], rotation[N][9]; /* of each joint in the link before it */
    double mass[N], com[N][3], inertia[N][9];        /* inertia about the centre, in the link's frame */
    double gravity[3];
    double rotor[N], stiffness[N], gear_damping[N];
    double gain[N], gain_fall[N], current_warm[N], winding_s;
    double current_rad_s[N], current_ratio[N]; /* a ratio of 0: first order */
    double law, coulomb[N], asymmetry[N], breakaway[N], v_stribeck[N], exponent[N], load_share[N], load_from[N];
    double bristle[N], bristle_damping[N], slip_share[SLIPS], slip_stiffness[SLIPS];
    double viscous[N], eyring[N], eyring_speed[N], power[N], power_exponent[N];
    double ripple[N], ripple_waves[N], ripple_phase[N], warm_fall[N], warm_s;
    double lower[N], upper[N], stop_stiffness, stop_damping;
    double drive_gain[N]; /* by which a drive turns its damping into a current */
    double command_delay, sensor_delay, period, substeps;
};

struct run {
    double t, x[STATES], outside[N], winding[N]; /* outside: torque on the links from outside the machine */
    double gripped, grip[3], wrench[6]; /* link, place in it, and force and moment there, in the link's axes */
    double given[COMMANDS][N], damping[COMMANDS][N], valid_until[COMMANDS], count; /* command k came at k periods */
    double past[PAST][3 * N], pasts; /* q, theta and current after each step */
};

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void times(const double *R, const double *a, double *b)
{
    for (int i = 0; i < 3; i++)
        b[i] = dot(R + 3 * i, a);
}

static void product(const double *A, const double *B, double *C)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

static void turn(const double *axis, double angle, double *R) /* Rodrigues */
{
    const double s = sin(angle), c = cos(angle), x = axis[0], y = axis[1], z = axis[2];
    const double values[9] = {
        c + x * x * (1 - c),     x * y * (1 - c) - z * s, x * z * (1 - c) + y * s,
        y * x * (1 - c) + z * s, c + y * y * (1 - c),     y * z * (1 - c) - x * s,
        z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)};
    memcpy(R, values, sizeof values);
}

/* Mass matrix, and torque that holds the links at zero acceleration: gravity, centrifugal and Coriolis torque. */
void links(const struct machine *m, const double *q, const double *v, double M[N][N], double *bias)
{
    double z[N][3], p[N][3]; /* axes and origins of the joints in the base */
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, at[3] = {0, 0, 0};
    double w[3] = {0, 0, 0}, alpha[3] = {0, 0, 0}, a[3] = {0, 0, 0}; /* of the present link, at its origin */
    memset(M, 0, sizeof(double[N][N]));
    memset(bias, 0, sizeof(double[N]));
    for (int l = 0; l < N; l++) {
        double step[3], fixed[9], turned[9], part[3], swing[3], spin[3];
        times(R, m->origin[l], step);
        cross(w, step, part);
        cross(w, part, swing);
        cross(alpha, step, part);
        for (int k = 0; k < 3; k++) {
            at[k] += step[k];
            a[k] += part[k] + swing[k];
            p[l][k] = at[k];
        }
        product(R, m->rotation[l], fixed);
        times(fixed, m->axis[l], z[l]);
        turn(m->axis[l], q[l], turned);
        product(fixed, turned, R);
        for (int k = 0; k < 3; k++)
            spin[k] = z[l][k] * v[l];
        cross(w, spin, part);
        for (int k = 0; k < 3; k++) {
            alpha[k] += part[k];
            w[k] += spin[k];
        }
        double c[3], where[3], force[3], moment[3], I[9], half[9], transposed[9], momentum[3];
        times(R, m->com[l], c);
        cross(w, c, part);
        cross(w, part, swing);
        cross(alpha, c, part);
        for (int k = 0; k < 3; k++) {
            where[k] = at[k] + c[k];
            force[k] = m->mass[l] * (a[k] + part[k] + swing[k] - m->gravity[k]);
        }
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                transposed[3 * i + j] = R[3 * j + i];
        product(R, m->inertia[l], half);
        product(half, transposed, I);
        times(I, w, momentum);
        cross(w, momentum, moment);
        times(I, alpha, part);
        for (int k = 0; k < 3; k++)
            moment[k] += part[k];
        double Jv[N][3], IJw[N][3];
        for (int i = 0; i <= l; i++) {
            double arm[3];
            for (int k = 0; k < 3; k++)
                arm[k] = where[k] - p[i][k];
            cross(z[i], arm, Jv[i]);
            times(I, z[i], IJw[i]);
            bias[i] += dot(Jv[i], force) + dot(z[i], moment);
        }
        for (int i = 0; i <= l; i++)
            for (int j = 0; j <= l; j++)
                M[i][j] += m->mass[l] * dot(Jv[i], Jv[j]) + dot(z[i], IJw[j]);
    }
}

/* Torque on the joints of a force and a moment at a place in a link, in the link's axes: carried to the base. */
void pull(const struct machine *m, int link, const double *place, const double *wrench, const double *q, double *tau)
{
    double force[3], moment[3], part[3], turned[9], R[9];
    memset(tau, 0, sizeof(double[N]));
    memcpy(force, wrench, sizeof force);
    cross(place, force, part);
    for (int k = 0; k < 3; k++)
        moment[k] = wrench[3 + k] + part[k];
    for (int l = link; l >= 0; l--) {
        tau[l] = dot(m->axis[l], moment);
        turn(m->axis[l], q[l], turned);
        product(m->rotation[l], turned, R);
        times(R, force, part);
        memcpy(force, part, sizeof force);
        times(R, moment, part);
        memcpy(moment, part, sizeof moment);
        cross(m->origin[l], force, part);
        for (int k = 0; k < 3; k++)
            moment[k] += part[k];
    }
}

/* Torque of the links in n states (n, joint), without rotors and friction. */
void torques(const struct machine *m, int n, const double *q, const double *v, const double *a, double *tau)
{
    for (int k = 0; k < n * N; k += N) {
        double M[N][N];
        links(m, q + k, v + k, M, tau + k);
        for (int i = 0; i < N; i++)
            for (int j = 0; j < N; j++)
                tau[k + i] += M[i][j] * a[k + j];
    }
}

static void solve(double A[N][N], double *b) /* Cholesky; the mass matrix is positive definite */
{
    for (int j = 0; j < N; j++) {
        for (int k = 0; k < j; k++)
            A[j][j] -= A[j][k] * A[j][k];
        A[j][j] = sqrt(A[j][j]);
        for (int i = j + 1; i < N; i++) {
            for (int k = 0; k < j; k++)
                A[i][j] -= A[i][k] * A[j][k];
            A[i][j] /= A[j][j];
        }
    }
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= A[i][k] * b[k];
        b[i] /= A[i][i];
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int k = i + 1; k < N; k++)
            b[i] -= A[k][i] * b[k];
        b[i] /= A[i][i];
    }
}

static double warmth(const struct machine *m, int j, double t) { return 1.0 - m->warm_fall[j] * (1.0 - exp(-t / m->warm_s)); }

/* Torque at which the rubbing surfaces of a joint slide, without viscous friction. */
double strength(const struct machine *m, int j, double theta, double omega, double load, double t)
{
    const double side = omega >= 0.0 ? 1.0 + m->asymmetry[j] : 1.0 - m->asymmetry[j];
    const double rise = (m->breakaway[j] - 1.0) * exp(-pow(fabs(omega) / m->v_stribeck[j], m->exponent[j]));
    const double pressed = m->load_share[j] * (sqrt(load * load + m->load_from[j] * m->load_from[j]) - m->load_from[j]);
    const double ripple = m->ripple[j] * sin(m->ripple_waves[j] * theta + m->ripple_phase[j]);
    const double slides = (m->coulomb[j] * side * (1.0 + rise) + ripple) * warmth(m, j, t) + pressed;
    return slides > 0.02 ? slides : 0.02;
}

/* Viscous friction torque of a joint, with the sign of the speed. */
double viscous(const struct machine *m, int j, double omega, double t)
{
    const double bent = omega * pow(omega * omega + V_SMOOTH * V_SMOOTH, 0.5 * (m->power_exponent[j] - 1.0));
    const double law = m->viscous[j] * omega + m->eyring[j] * asinh(omega / m->eyring_speed[j]) + m->power[j] * bent;
    return law * warmth(m, j, t);
}

static double clipped(double value, double limit) { return value > limit ? limit : value < -limit ? -limit : value; }

/* Friction torque on the motor, and the derivative of the joint's bristles. */
static double friction(const struct machine *m, int j, const double *x, double load, double t, double *dz)
{
    const double omega = x[OMEGA * N + j], slides = strength(m, j, x[THETA * N + j], omega, load, t);
    const double *z = x + (BRISTLES + 0) * N + j;
    double torque = viscous(m, j, omega, t);
    if (m->law == LUGRE) {
        const double rate = omega - fabs(omega) * m->bristle[j] / slides * z[0];
        const double fading = exp(-(omega / m->v_stribeck[j]) * (omega / m->v_stribeck[j]));
        dz[0] = rate;
        for (int k = 1; k < SLIPS; k++)
            dz[k * N] = 0.0;
        return torque + m->bristle[j] * z[0] + m->bristle_damping[j] * fading * rate;
    }
    for (int k = 0; k < SLIPS; k++) {
        dz[k * N] = omega;
        torque += clipped(m->bristle[j] * m->slip_stiffness[k] * z[k * N], m->slip_share[k] * slides);
    }
    return torque;
}

static double torsion(const struct machine *m, int j, const double *x)
{
    return m->stiffness[j] * (x[THETA * N + j] - x[Q * N + j]) + m->gear_damping[j] * (x[OMEGA * N + j] - x[V * N + j]);
}

static double stop_torque(const struct machine *m, int j, double q, double v)
{
    const double beyond = q > m->upper[j] ? q - m->upper[j] : q < m->lower[j] ? q - m->lower[j] : 0.0;
    return beyond == 0.0 ? 0.0 : -m->stop_stiffness * beyond - m->stop_damping * v;
}

/* Derivative of the state for a current command [A] and a damping of the drives. */
void derivative(
    const struct machine *m, const struct run *r, double t, const double *x, const double *command,
    const double *damping, double *dx)
{
    double M[N][N], tau[N], pulled[N];
    links(m, x + Q * N, x + V * N, M, tau);
    pull(m, (int)r->gripped, r->grip, r->wrench, x + Q * N, pulled);
    for (int j = 0; j < N; j++) {
        const double load = torsion(m, j, x), omega = x[OMEGA * N + j];
        const double asked = command[j] - damping[j] * omega / m->drive_gain[j];
        const double rubs = friction(m, j, x, load, t, dx + BRISTLES * N + j);
        const double gain = m->gain[j] * (1.0 - m->gain_fall[j] * (r->winding[j] < 1.0 ? r->winding[j] : 1.0));
        const double i = x[CURRENT * N + j], rate = x[CURRENT_RATE * N + j], w = m->current_rad_s[j];
        tau[j] = load + stop_torque(m, j, x[Q * N + j], x[V * N + j]) + r->outside[j] + pulled[j] - tau[j];
        dx[Q * N + j] = x[V * N + j];
        dx[THETA * N + j] = omega;
        dx[OMEGA * N + j] = (gain * i - rubs - load) / m->rotor[j];
        dx[CURRENT * N + j] = m->current_ratio[j] > 0.0 ? rate : w * (asked - i);
        dx[CURRENT_RATE * N + j] = m->current_ratio[j] > 0.0 ? w * w * (asked - i) - 2.0 * m->current_ratio[j] * w * rate : 0.0;
    }
    solve(M, tau);
    memcpy(dx + V * N, tau, sizeof tau);
}

static void step(const struct machine *m, struct run *r, double h, const double *command, const double *damping)
{
    static const double share[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[STATES] = {0}, sum[STATES] = {0}, x[STATES];
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < STATES; i++)
            x[i] = r->x[i] + share[stage] * h * k[i];
        derivative(m, r, r->t + share[stage] * h, x, command, damping, k);
        for (int i = 0; i < STATES; i++)
            sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < STATES; i++)
        r->x[i] += h * sum[i];
    r->t += h;
    if (m->law == MAXWELL_SLIP)
        for (int j = 0; j < N; j++) {
            const double load = torsion(m, j, r->x);
            const double slides = strength(m, j, r->x[THETA * N + j], r->x[OMEGA * N + j], load, r->t);
            for (int s = 0; s < SLIPS; s++) {
                double *z = r->x + (BRISTLES + s) * N + j;
                *z = clipped(*z, m->slip_share[s] * slides / (m->bristle[j] * m->slip_stiffness[s]));
            }
        }
}

/* Command k, zero after its expiry and before the first one. */
static void given(const struct run *r, long k, double t, double weight, double *command, double *damping)
{
    if (k < 0 || k >= (long)r->count || k < (long)r->count - COMMANDS || t > r->valid_until[k % COMMANDS])
        return;
    for (int j = 0; j < N; j++) {
        command[j] += weight * r->given[k % COMMANDS][j];
        damping[j] += weight * r->damping[k % COMMANDS][j];
    }
}

/* Take the command of this period and integrate to the next. */
void advance(const struct machine *m, struct run *r, const double *command, const double *damping, double valid_until)
{
    const long now = (long)r->count;
    const int substeps = (int)m->substeps;
    const double h = m->period / substeps, start = r->t;
    memcpy(r->given[now % COMMANDS], command, sizeof(double[N]));
    memcpy(r->damping[now % COMMANDS], damping, sizeof(double[N]));
    r->valid_until[now % COMMANDS] = valid_until;
    r->count = now + 1;
    for (int s = 0; s < substeps; s++) {
        /* Within a step, an arriving command counts by the share of the step in which it is in force. */
        const double late = m->command_delay / m->period, begin = now + (double)s / substeps - late;
        const double end = begin + 1.0 / substeps;
        const long first = (long)floor(begin), last = (long)floor(end);
        const double later = last > first ? (end - last) * substeps : 0.0;
        double in_force[N] = {0}, braked[N] = {0};
        given(r, first, r->t, 1.0 - later, in_force, braked);
        if (later > 0.0)
            given(r, last, r->t, later, in_force, braked);
        step(m, r, h, in_force, braked);
        r->t = start + (s + 1) * h;
        double *kept = r->past[(long)r->pasts % PAST];
        memcpy(kept, r->x + Q * N, sizeof(double[N]));
        memcpy(kept + N, r->x + THETA * N, sizeof(double[N]));
        memcpy(kept + 2 * N, r->x + CURRENT * N, sizeof(double[N]));
        r->pasts += 1.0;
    }
    for (int j = 0; j < N; j++) {
        const double heat = r->x[CURRENT * N + j] / m->current_warm[j];
        r->winding[j] += m->period / m->winding_s * (heat * heat - r->winding[j]);
    }
}

/* Position, motor position and current as they were one sensor delay ago (3, joint). */
void sense(const struct machine *m, const struct run *r, double *measured)
{
    const double back = m->sensor_delay * m->substeps / m->period;
    const long whole = (long)floor(back), newest = (long)r->pasts - 1;
    const double part = back - whole;
    const double *later = r->past[(newest - whole) % PAST], *earlier = r->past[(newest - whole - 1) % PAST];
    for (int i = 0; i < 3 * N; i++)
        measured[i] = (1.0 - part) * later[i] + part * earlier[i];
}
