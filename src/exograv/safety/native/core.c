/* Made from core.py by to_c.py; do not edit. Compile without -ffast-math and with -ffp-contract=off: its results must
   equal those of core.py to the last bit. */
#include <math.h>

static inline long modulo(long a, long b) { long rest = a % b; return rest < 0 ? rest + b : rest; }
static inline long smaller(long a, long b) { return b < a ? b : a; }

/* Check sum of core.py: a library that was made from another source is not used. */
const long long guard_source = 2966116717;

#define JOINTS 16
#define SLOTS 128
#define SPEED_SLOTS 40
#define MISSES 11
#define N 0
#define DT 1
#define RATE 2
#define V_DAMPING 3
#define V_TRIP 4
#define DESCENT_S 5
#define WORN 6
#define WALL 7
#define PAST_STOP 8
#define V_TRIP_PERSON 9
#define TANK_START 10
#define TANK_MAX 11
#define PATH_W 12
#define DRIVEN_W 13
#define DRIVEN_J 14
#define WAY 15
#define MOVING 16
#define USED_SLOTS 17
#define COMPARES 18
#define BY_GAIN 19
#define LATELY 20
#define SLOWEST 21
#define IN_A_ROW 22
#define SPEED 23
#define STILL_MOST 24
#define BIAS_SHARE 25
#define REFUSED_MOST 26
#define LEAST_OPPOSITE 27
#define WINDOW 28
#define IN_WINDOW 29
#define SECOND 30
#define FROZEN_MOST 31
#define FROZEN_JOINT 32
#define NOISE_STEP 33
#define POWER_MAX 34
#define CAME 35
#define SEQUENCE_IN 36
#define T_IN 37
#define NOW 38
#define IN_CURRENT 39
#define HAS_MOTOR 40
#define SPOKE 41
#define ANSWERS 42
#define VALID_UNTIL 43
#define STOP 44
#define SINCE_STOP 45
#define WITHOUT_MODEL 46
#define CLIPPED 47
#define LEVEL 48
#define LEVEL_WANTED 49
#define LEVEL_STEP 50
#define LEVEL_MOVES 51
#define DRIVEN 52
#define ENERGY 53
#define IN_WALL 54
#define SEQUENCE 55
#define T_USED 56
#define DROPPED 57
#define USABLE 58
#define USED_AT 59
#define TOLD_AT 60
#define TOLD_COUNT 61
#define BEFORE_AT 62
#define BEFORE_COUNT 63
#define SPEED_T 64
#define HAS_SPEED 65
#define BRIDGES 66
#define CONSENT 67
#define FASTEST 68
#define SAFE_STATE 69
#define MACHINE_MISSES 70
#define CONTROL_MISSES 83
#define _FIELDS 96
#define TORQUE_MAX 96
#define DAMPING 112
#define ACTIVE 128
#define LEAST_ACTIVE 144
#define LOWER 160
#define UPPER 176
#define FREE_LOWER 192
#define FREE_UPPER 208
#define DRY 224
#define VISCOUS 240
#define ERROR 256
#define REACH 272
#define SLACK 288
#define LEAST_WAY 304
#define GAIN 320
#define Q_IN 336
#define CURRENT_IN 352
#define TAU_IN 368
#define Q_MOTOR_IN 384
#define FAULTY_IN 400
#define ANSWER_IN 416
#define DESIRED 432
#define Q_GIVEN 448
#define V_GIVEN 464
#define TAU 480
#define TAU_AT_STOP 496
#define PUSH 512
#define PUSH_AT_STOP 528
#define ISOLATED 544
#define POWERLESS 560
#define Q 576
#define V 592
#define KNOWN 608
#define SLOPE 624
#define AHEAD 640
#define CARRIED 656
#define FRICTION 672
#define LOW 688
#define HIGH 704
#define LAST_TAU 720
#define WANTED 736
#define OVER 752
#define IGNORED 768
#define JUMPS 784
#define JUMPED 800
#define DEAD 816
#define BROKEN 832
#define PARTED 848
#define WRONG 864
#define FIRST 880
#define PARTED_TICKS 896
#define LAST 912
#define STILL 928
#define MOTOR_THEN 944
#define OFF_TICKS 960
#define BIAS 976
#define REFUSED_TICKS 992
#define HELD 1008
#define Q_SEEN 1024
#define V_SEEN 1040
#define V_FILTER 1056
#define Q_FILTER 1072
#define FAULTY 1088
#define KEPT_TICKS 1104
#define KEPT_SHARE 1120
#define KEPT_CHANCE 1136
#define KEPT_SEEN 1152
#define TURNS 1168
#define Q_KEPT 1184
#define MOTOR_KEPT 1200
#define TORQUE_KEPT 1216
#define CHANGE_BEFORE 1232
#define USED 1248
#define TOLD 3296
#define BEFORE 5344
#define MOTOR_BEFORE 5984
#define SIZE 6624
#define NOT_FINITE 1
#define TOO_FAST 2
#define NO_MEASUREMENT 3
#define MODEL_LOST 4
#define PAST_A_STOP 5
#define ASTRAY 6
#define NOT_THIS_ARM 7
#define CONTROL_SILENT 8
#define MACHINE_SILENT 9
#define ENCODER_JUMPED 10
#define ENCODER_DEAD 11
#define TORQUE_WRONG 12
#define ENCODERS_PART 13
#define DRIVE_FAULT 14
#define STOP_PRESSED 15
#define V_CREDIBLE_RAD_S 1000.0
#define SPEED_FILTER_S 0.008
#define WITHOUT_MODEL_SHARE 2.0
#define GRAVITY_LEVEL_MAX 1.8
#define GRAVITY_LEVEL_S 5.0
#define PUSH_ENDS_S 0.5
#define SHARE_MAX 1.3
#define MARGIN_NM 3.0
#define WALL_AHEAD_S 0.1
#define AGE_MAX_S 0.003
#define JUMPS_MAX 3.0
#define UNLIKELY 1e-10
#define LEAST_TURNS 0.25
#define LEAST_SEEN 50.0
#define AGREE_RAD 0.035
#define STILL_WAY_RAD 0.003
#define TORQUE_OFF_NM 3.0
#define TORQUE_BIAS_NM 2.0
#define REFUSED_NM 3.0
#define SLOW_RAD_S 0.1
#define STANDING_RAD_S 0.05
#define IN_SECOND_MAX 10
#define LONG_AGO -1e+18
#define TICKS_MOST 1000000000.0

double guard_least(double a, double b);
double guard_most(double a, double b);
double guard_within(double value, double low, double high);
double guard_whole(double value);
void guard_carried(double *restrict r, double *restrict w, double level);
double guard_row_sum(double *restrict w, long row, long value, long products);
void guard_multiply(double *restrict w, long value, long run, long runs);
void guard_derive(double *restrict w, long value, long pull, long run, long runs);
void guard_look(double *restrict r, double *restrict w);
void guard_drive(double *restrict r, int is_driven);
int guard_is_past_a_stop(double *restrict r);
double guard_into_upper(double *restrict r, long j);
double guard_into_lower(double *restrict r, long j);
double guard_bounded(double *restrict r, long j, double tau);
void guard_price(double *restrict r, long speed);
void guard_spare(double *restrict r, double ahead);
void guard_give_back(double *restrict r, long speed, double share);
void guard_afford(double *restrict r);
void guard_pay(double *restrict r);
void guard_trip(double *restrict r, long reason, int without_model);
void guard_isolate(double *restrict r, long j, int is_powerless);
void guard_leave_stop(double *restrict r);
void guard_begin_torque(double *restrict r);
void guard_believe(double *restrict r);
void guard_watch(double *restrict r, double fastest);
void guard_descend(double *restrict r);
double guard_brake(double *restrict r, long j);
void guard_bound_and_brake(double *restrict r, int brakes);
int guard_limit_rate(double *restrict r);
void guard_follow(double *restrict r, double fastest);
void guard_limit(double *restrict r, double *restrict w);
void guard_take_in(double *restrict r);
void guard_ignore_isolated(double *restrict r, long slots);
int guard_is_broken(double *restrict r);
int guard_has_jumped(double *restrict r);
int guard_is_frozen(double *restrict r);
void guard_keep(double *restrict r, long j);
int guard_is_stuck(double *restrict r, long j);
int guard_is_dead(double *restrict r, long j, long at, long slots);
void guard_compare(double *restrict r);
void guard_compare_encoders(double *restrict r);
void guard_compare_torques(double *restrict r);
double guard_off_lately(double *restrict r, long j, double tau, long ticks);
void guard_tell(double *restrict r);
int guard_is_refused(double *restrict r);
void guard_forget_misses(double *restrict r, long at);
int guard_misses_too_many(double *restrict r, long at, int is_missed);
void guard_begin(double *restrict r);
void guard_approach_level(double *restrict r);
void guard_filter_speeds(double *restrict r);
void guard_see(double *restrict r);
void guard_act_on_comparison(double *restrict r);
void guard_decide(double *restrict r, double *restrict w);
double guard_safe_state(double *restrict r);
int guard_reset(double *restrict r);

double guard_least(double a, double b)
{
    return ((b < a) ? b : a);
}

double guard_most(double a, double b)
{
    return ((b > a) ? b : a);
}

double guard_within(double value, double low, double high)
{
    if ((low <= value && value <= high)) {
        return value;
    }
    return ((value < low) ? low : high);
}

double guard_whole(double value)
{
    double below;
    double part;
    int is_up;
    value = guard_most(1.0, guard_least(value, TICKS_MOST));
    below = (double)(floor(value));
    part = (value - below);
    is_up = ((part > 0.5) || ((part == 0.5) && (below != (2.0 * (double)(floor((0.5 * below)))))));
    return (is_up ? (below + 1.0) : below);
}

void guard_carried(double *restrict r, double *restrict w, double level)
{
    long at;
    long t1;
    long joints;
    long products;
    long values;
    long leaves;
    long ahead;
    long runs;
    long index;
    long run;
    long exo;
    long size;
    long now;
    long value;
    long pull;
    long arm;
    long k;
    double one;
    double two;
    long j;
    double q;
    double tau;
    long cosine;
    long sine;
    at = 2;
    const long t2 = (long)(w[0]);
    for (t1 = 0; t1 < t2; t1 += 1) {
        const long t3 = (long)(w[at]);
        const long t4 = (long)(w[(at + 1)]);
        const long t5 = (long)(w[(at + 2)]);
        joints = t3;
        products = t4;
        values = t5;
        const long t6 = (long)(w[(at + 3)]);
        const long t7 = (long)(w[(at + 4)]);
        const long t8 = (long)(w[(at + 5)]);
        leaves = t6;
        ahead = t7;
        runs = t8;
        index = (at + 6);
        run = (index + joints);
        exo = (run + (4 * runs));
        size = (joints * products);
        if ((leaves > 0)) {
            size += ((2 * values) + leaves);
        }
        now = (exo + (2 * size));
        value = (now + size);
        pull = ((value - leaves) - values);
        if ((level != w[1])) {
            arm = (exo + size);
            const long t9 = size;
            for (k = 0; k < t9; k += 2) {
                const double t10 = (w[(exo + k)] + ((1.0 - level) * w[(arm + k)]));
                const double t11 = (w[((exo + k) + 1)] + ((1.0 - level) * w[((arm + k) + 1)]));
                one = t10;
                two = t11;
                const double t12 = one;
                const double t13 = two;
                w[(now + k)] = t12;
                w[((now + k) + 1)] = t13;
            }
        }
        w[value] = 1.0;
        const long t14 = joints;
        for (j = 0; j < t14; j += 1) {
            q = r[(Q + (long)(w[(index + j)]))];
            w[((value + 1) + (2 * j))] = cos(q);
            w[((value + 2) + (2 * j))] = sin(q);
        }
        guard_multiply(w, value, run, ahead);
        if ((leaves > 0)) {
            const long t15 = values;
            for (k = 0; k < t15; k += 1) {
                w[(pull + k)] = w[((pull - values) + k)];
            }
            guard_derive(w, value, pull, run, runs);
        }
        const long t16 = joints;
        for (j = 0; j < t16; j += 1) {
            tau = guard_row_sum(w, (now + (j * products)), value, products);
            if ((leaves > 0)) {
                const long t17 = (1 + (2 * j));
                const long t18 = (2 + (2 * j));
                cosine = t17;
                sine = t18;
                tau += ((w[(pull + sine)] * w[(value + cosine)]) - (w[(pull + cosine)] * w[(value + sine)]));
            }
            r[(CARRIED + (long)(w[(index + j)]))] = tau;
        }
        at = (value + values);
    }
    w[1] = level;
}

double guard_row_sum(double *restrict w, long row, long value, long products)
{
    double a;
    double b;
    double c;
    double d;
    double e;
    double f;
    double g;
    double h;
    long k;
    a = 0.0;
    b = 0.0;
    c = 0.0;
    d = 0.0;
    e = 0.0;
    f = 0.0;
    g = 0.0;
    h = 0.0;
    const long t1 = products;
    for (k = 0; k < t1; k += 8) {
        a += (w[(row + k)] * w[(value + k)]);
        b += (w[((row + k) + 1)] * w[((value + k) + 1)]);
        c += (w[((row + k) + 2)] * w[((value + k) + 2)]);
        d += (w[((row + k) + 3)] * w[((value + k) + 3)]);
        e += (w[((row + k) + 4)] * w[((value + k) + 4)]);
        f += (w[((row + k) + 5)] * w[((value + k) + 5)]);
        g += (w[((row + k) + 6)] * w[((value + k) + 6)]);
        h += (w[((row + k) + 7)] * w[((value + k) + 7)]);
    }
    return (((a + e) + (c + g)) + ((b + f) + (d + h)));
}

void guard_multiply(double *restrict w, long value, long run, long runs)
{
    long i;
    long parent;
    long count;
    long cosine;
    long child;
    double even;
    double odd;
    long k;
    double one;
    double two;
    const long t1 = runs;
    for (i = 0; i < t1; i += 1) {
        const long t2 = (value + (long)(w[(run + (4 * i))]));
        const long t3 = (long)(w[((run + (4 * i)) + 1)]);
        parent = t2;
        count = t3;
        const long t4 = (value + (long)(w[((run + (4 * i)) + 2)]));
        const long t5 = (value + (long)(w[((run + (4 * i)) + 3)]));
        cosine = t4;
        child = t5;
        const double t6 = w[cosine];
        const double t7 = w[(cosine + 1)];
        even = t6;
        odd = t7;
        const long t8 = count;
        for (k = 0; k < t8; k += 2) {
            const double t9 = w[(parent + k)];
            const double t10 = w[((parent + k) + 1)];
            one = t9;
            two = t10;
            const double t11 = (one * even);
            const double t12 = (two * even);
            w[(child + k)] = t11;
            w[((child + k) + 1)] = t12;
            const double t13 = (one * odd);
            const double t14 = (two * odd);
            w[((child + count) + k)] = t13;
            w[(((child + count) + k) + 1)] = t14;
        }
    }
}

void guard_derive(double *restrict w, long value, long pull, long run, long runs)
{
    long back;
    long i;
    long parent;
    long count;
    long cosine;
    long child;
    double even;
    double odd;
    double a;
    double b;
    double c;
    double d;
    long k;
    double one;
    double two;
    double three;
    double four;
    double first;
    double second;
    const long t1 = runs;
    for (back = 0; back < t1; back += 1) {
        i = ((runs - 1) - back);
        const long t2 = (long)(w[(run + (4 * i))]);
        const long t3 = (long)(w[((run + (4 * i)) + 1)]);
        parent = t2;
        count = t3;
        const long t4 = (long)(w[((run + (4 * i)) + 2)]);
        const long t5 = (pull + (long)(w[((run + (4 * i)) + 3)]));
        cosine = t4;
        child = t5;
        const double t6 = w[(value + cosine)];
        const double t7 = w[((value + cosine) + 1)];
        even = t6;
        odd = t7;
        a = 0.0;
        b = 0.0;
        c = 0.0;
        d = 0.0;
        const long t8 = count;
        for (k = 0; k < t8; k += 2) {
            const double t9 = w[(child + k)];
            const double t10 = w[((child + k) + 1)];
            one = t9;
            two = t10;
            const double t11 = w[((child + count) + k)];
            const double t12 = w[(((child + count) + k) + 1)];
            three = t11;
            four = t12;
            a += (one * w[((value + parent) + k)]);
            b += (two * w[(((value + parent) + k) + 1)]);
            c += (three * w[((value + parent) + k)]);
            d += (four * w[(((value + parent) + k) + 1)]);
            first = (w[((pull + parent) + k)] + ((one * even) + (three * odd)));
            second = (w[(((pull + parent) + k) + 1)] + ((two * even) + (four * odd)));
            const double t13 = first;
            const double t14 = second;
            w[((pull + parent) + k)] = t13;
            w[(((pull + parent) + k) + 1)] = t14;
        }
        w[(pull + cosine)] += (a + b);
        w[((pull + cosine) + 1)] += (c + d);
    }
}

void guard_look(double *restrict r, double *restrict w)
{
    double level;
    long j;
    double at;
    double speed;
    double p;
    double low;
    double high;
    double friction;
    double size;
    double beyond;
    double along;
    double against;
    level = guard_least(guard_most(0.0, r[LEVEL]), GRAVITY_LEVEL_MAX);
    guard_carried(r, w, guard_least(level, 1.0));
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        r[(PUSH + j)] = r[(CARRIED + j)];
    }
    if ((level > 1.0)) {
        guard_carried(r, w, level);
    }
    r[IN_WALL] = 0.0;
    const long t2 = (long)(r[N]);
    for (j = 0; j < t2; j += 1) {
        const double t3 = r[(Q + j)];
        const double t4 = r[(KNOWN + j)];
        const double t5 = r[(CARRIED + j)];
        at = t3;
        speed = t4;
        p = t5;
        r[(PUSH + j)] = (p - r[(PUSH + j)]);
        const double t6 = r[(FREE_LOWER + j)];
        const double t7 = r[(FREE_UPPER + j)];
        low = t6;
        high = t7;
        if ((!((low <= at && at <= high) && (low <= (at + (WALL_AHEAD_S * speed)) && (at + (WALL_AHEAD_S * speed)) <= high)))) {
            r[IN_WALL] = 1.0;
        }
        friction = (r[(DRY + j)] + (r[(VISCOUS + j)] * fabs(speed)));
        const double t8 = fabs(p);
        const double t9 = (friction + r[(ERROR + j)]);
        size = t8;
        beyond = t9;
        along = (guard_least(((SHARE_MAX * size) + MARGIN_NM), (size + r[(ACTIVE + j)])) + beyond);
        against = (r[(LEAST_ACTIVE + j)] + beyond);
        r[(FRICTION + j)] = friction;
        r[(LOW + j)] = ((p > 0.0) ? (-against) : (-along));
        r[(HIGH + j)] = ((p > 0.0) ? along : against);
    }
}

void guard_drive(double *restrict r, int is_driven)
{
    if ((is_driven && (r[DRIVEN] == 0.0))) {
        r[ENERGY] = guard_most(r[ENERGY], r[DRIVEN_J]);
    } else {
        if ((!is_driven)) {
            r[ENERGY] = guard_least(r[ENERGY], r[TANK_START]);
        }
    }
    r[DRIVEN] = (is_driven ? 1.0 : 0.0);
}

int guard_is_past_a_stop(double *restrict r)
{
    long j;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        if ((!((r[(LOWER + j)] - r[PAST_STOP]) <= r[(Q + j)] && r[(Q + j)] <= (r[(UPPER + j)] + r[PAST_STOP])))) {
            return 1;
        }
    }
    return 0;
}

double guard_into_upper(double *restrict r, long j)
{
    double ahead;
    ahead = guard_most(r[(Q + j)], (r[(Q + j)] + (WALL_AHEAD_S * r[(KNOWN + j)])));
    return guard_within((((ahead - r[(UPPER + j)]) / r[WALL]) + 1.0), 0.0, 1.0);
}

double guard_into_lower(double *restrict r, long j)
{
    double ahead;
    ahead = guard_least(r[(Q + j)], (r[(Q + j)] + (WALL_AHEAD_S * r[(KNOWN + j)])));
    return guard_within((((r[(LOWER + j)] - ahead) / r[WALL]) + 1.0), 0.0, 1.0);
}

double guard_bounded(double *restrict r, long j, double tau)
{
    double low;
    double high;
    double p;
    const double t1 = r[(LOW + j)];
    const double t2 = r[(HIGH + j)];
    low = t1;
    high = t2;
    if ((r[IN_WALL] != 0.0)) {
        p = r[(CARRIED + j)];
        high -= (guard_into_upper(r, j) * (high - guard_most(p, low)));
        low += (guard_into_lower(r, j) * (guard_least(p, high) - low));
    }
    return guard_within(tau, low, high);
}

void guard_price(double *restrict r, long speed)
{
    long j;
    double over;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        over = (r[(TAU + j)] - r[(CARRIED + j)]);
        if (((over * r[(speed + j)]) > 0.0)) {
            over = ((over > 0.0) ? guard_most(0.0, (over - r[(FRICTION + j)])) : guard_least(0.0, (over + r[(FRICTION + j)])));
        }
        r[(OVER + j)] = over;
    }
}

void guard_spare(double *restrict r, double ahead)
{
    long j;
    double ahead_s;
    double power;
    double allowed;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        ahead_s = (ahead * (SPEED_FILTER_S + (fabs((r[(TAU + j)] - r[(CARRIED + j)])) / r[RATE])));
        r[(AHEAD + j)] = (r[(KNOWN + j)] + (ahead_s * r[(SLOPE + j)]));
    }
    guard_price(r, AHEAD);
    const double t2 = 0.0;
    const double t3 = guard_most(0.0, r[POWER_MAX]);
    power = t2;
    allowed = t3;
    const long t4 = (long)(r[N]);
    for (j = 0; j < t4; j += 1) {
        power += guard_most(0.0, (r[(OVER + j)] * r[(AHEAD + j)]));
    }
    if ((power > allowed)) {
        guard_give_back(r, AHEAD, (1.0 - (allowed / power)));
    }
}

void guard_give_back(double *restrict r, long speed, double share)
{
    long j;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        if (((r[(OVER + j)] * r[(speed + j)]) > 0.0)) {
            r[(TAU + j)] = (r[(TAU + j)] - (share * r[(OVER + j)]));
        }
    }
}

void guard_afford(double *restrict r)
{
    double needed;
    long j;
    double has;
    guard_price(r, KNOWN);
    needed = 0.0;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        if (((r[(OVER + j)] * r[(KNOWN + j)]) > 0.0)) {
            needed += ((r[(OVER + j)] * r[(OVER + j)]) * fabs(r[(KNOWN + j)]));
        }
    }
    needed /= (2.0 * r[RATE]);
    has = guard_most(0.0, r[ENERGY]);
    if ((needed > has)) {
        guard_give_back(r, KNOWN, (1.0 - sqrt((has / needed))));
    }
}

void guard_pay(double *restrict r)
{
    double refill;
    double fullest;
    double power;
    long j;
    const double t1 = r[PATH_W];
    const double t2 = r[TANK_MAX];
    refill = t1;
    fullest = t2;
    if ((r[DRIVEN] != 0.0)) {
        const double t3 = guard_most(refill, r[DRIVEN_W]);
        const double t4 = guard_most(fullest, r[DRIVEN_J]);
        refill = t3;
        fullest = t4;
    }
    guard_price(r, KNOWN);
    power = (-refill);
    const long t5 = (long)(r[N]);
    for (j = 0; j < t5; j += 1) {
        power += (r[(OVER + j)] * r[(KNOWN + j)]);
    }
    r[ENERGY] = guard_least((r[ENERGY] - (r[DT] * power)), fullest);
}

void guard_trip(double *restrict r, long reason, int without_model)
{
    long j;
    double top;
    double push;
    double low;
    double high;
    double pushed;
    if ((r[STOP] == 0.0)) {
        r[STOP] = reason;
        const long t1 = (long)(r[N]);
        for (j = 0; j < t1; j += 1) {
            const double t2 = r[(TORQUE_MAX + j)];
            const double t3 = ((r[WORN] != 0.0) ? r[(PUSH + j)] : 0.0);
            top = t2;
            push = t3;
            const double t4 = guard_most((-top), guard_least(0.0, push));
            const double t5 = guard_least(top, guard_most(0.0, push));
            low = t4;
            high = t5;
            pushed = guard_within(((r[(TAU + j)] - r[(CARRIED + j)]) + push), low, high);
            const double t6 = pushed;
            const double t7 = guard_within((r[(TAU + j)] - pushed), (-top), top);
            r[(PUSH_AT_STOP + j)] = t6;
            r[(TAU_AT_STOP + j)] = t7;
        }
    }
    r[WITHOUT_MODEL] = (without_model ? 1.0 : r[WITHOUT_MODEL]);
}

void guard_isolate(double *restrict r, long j, int is_powerless)
{
    const double t1 = 1.0;
    const double t2 = (is_powerless ? 1.0 : r[(POWERLESS + j)]);
    r[(ISOLATED + j)] = t1;
    r[(POWERLESS + j)] = t2;
}

void guard_leave_stop(double *restrict r)
{
    long j;
    r[STOP] = 0.0;
    r[SINCE_STOP] = 0.0;
    r[WITHOUT_MODEL] = 0.0;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        r[(ISOLATED + j)] = 0.0;
        r[(POWERLESS + j)] = 0.0;
    }
}

void guard_begin_torque(double *restrict r)
{
    long j;
    double tau;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        tau = r[(DESIRED + j)];
        r[(TAU + j)] = (isfinite(tau) ? guard_within(tau, (-r[(TORQUE_MAX + j)]), r[(TORQUE_MAX + j)]) : 0.0);
    }
}

void guard_believe(double *restrict r)
{
    long n;
    int is_q;
    int is_v;
    long j;
    n = (long)(r[N]);
    const int t1 = 1;
    const int t2 = 1;
    is_q = t1;
    is_v = t2;
    const long t3 = n;
    for (j = 0; j < t3; j += 1) {
        if ((r[(ISOLATED + j)] != 0.0)) {
            const double t4 = r[(Q + j)];
            const double t5 = 0.0;
            r[(Q_GIVEN + j)] = t4;
            r[(V_GIVEN + j)] = t5;
        }
        is_q = (is_q && isfinite(r[(Q_GIVEN + j)]));
        is_v = (is_v && isfinite(r[(V_GIVEN + j)]));
    }
    if ((!(is_q && is_v))) {
        guard_trip(r, NO_MEASUREMENT, 0);
    }
    const long t6 = n;
    for (j = 0; j < t6; j += 1) {
        if (is_q) {
            r[(Q + j)] = r[(Q_GIVEN + j)];
        }
        r[(V + j)] = (is_v ? r[(V_GIVEN + j)] : 0.0);
    }
}

void guard_watch(double *restrict r, double fastest)
{
    int worn;
    int is_finite;
    long j;
    double v_trip;
    const int t1 = (r[WORN] != 0.0);
    const int t2 = 1;
    worn = t1;
    is_finite = t2;
    const long t3 = (long)(r[N]);
    for (j = 0; j < t3; j += 1) {
        is_finite = (is_finite && isfinite(r[(DESIRED + j)]));
    }
    if ((!is_finite)) {
        guard_trip(r, NOT_FINITE, 0);
    } else {
        if ((worn && (r[IN_WALL] != 0.0) && guard_is_past_a_stop(r))) {
            guard_trip(r, PAST_A_STOP, 0);
        }
    }
    v_trip = (worn ? guard_least(r[V_TRIP], r[V_TRIP_PERSON]) : r[V_TRIP]);
    if ((fastest > v_trip)) {
        guard_trip(r, TOO_FAST, 0);
        const long t4 = (long)(r[N]);
        for (j = 0; j < t4; j += 1) {
            if ((fabs(r[(V + j)]) > v_trip)) {
                guard_isolate(r, j, 1);
            }
        }
    }
}

void guard_descend(double *restrict r)
{
    double share;
    double push_share;
    long j;
    int is_dropped;
    r[SINCE_STOP] += r[DT];
    share = guard_most(0.0, (1.0 - (r[SINCE_STOP] / r[DESCENT_S])));
    push_share = guard_most(0.0, (1.0 - (r[SINCE_STOP] / guard_least(PUSH_ENDS_S, r[DESCENT_S]))));
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        is_dropped = ((r[WITHOUT_MODEL] != 0.0) || (r[(POWERLESS + j)] != 0.0));
        r[(WANTED + j)] = (is_dropped ? 0.0 : ((r[(TAU_AT_STOP + j)] * share) + (r[(PUSH_AT_STOP + j)] * push_share)));
    }
}

double guard_brake(double *restrict r, long j)
{
    double v;
    double speed;
    v = r[(V + j)];
    if ((r[STOP] != 0.0)) {
        return ((((r[WITHOUT_MODEL] != 0.0) ? WITHOUT_MODEL_SHARE : 1.0) * r[(DAMPING + j)]) * v);
    }
    speed = guard_most((fabs(v) - r[V_DAMPING]), 0.0);
    if ((r[WORN] != 0.0)) {
        speed = guard_most(speed, (((v > 0.0) ? guard_into_upper(r, j) : guard_into_lower(r, j)) * fabs(v)));
    }
    return copysign((r[(DAMPING + j)] * speed), v);
}

void guard_bound_and_brake(double *restrict r, int brakes)
{
    int worn;
    long j;
    double tau;
    double braking;
    worn = (r[WORN] != 0.0);
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        r[(LAST_TAU + j)] = r[(TAU + j)];
        tau = (worn ? guard_bounded(r, j, r[(WANTED + j)]) : r[(WANTED + j)]);
        if (brakes) {
            braking = guard_brake(r, j);
            r[(WANTED + j)] -= braking;
            tau = (worn ? guard_within((tau - braking), r[(LOW + j)], r[(HIGH + j)]) : r[(WANTED + j)]);
        }
        r[(TAU + j)] = tau;
    }
}

int guard_limit_rate(double *restrict r)
{
    int is_clipped;
    double step;
    long j;
    double last;
    double bound;
    const int t1 = 0;
    const double t2 = (r[RATE] * r[DT]);
    is_clipped = t1;
    step = t2;
    const long t3 = (long)(r[N]);
    for (j = 0; j < t3; j += 1) {
        const double t4 = r[(LAST_TAU + j)];
        const double t5 = r[(TORQUE_MAX + j)];
        last = t4;
        bound = t5;
        r[(TAU + j)] = guard_within(guard_within(r[(TAU + j)], (-bound), bound), (last - step), (last + step));
        is_clipped = (is_clipped || (r[(TAU + j)] != r[(WANTED + j)]));
    }
    return is_clipped;
}

void guard_follow(double *restrict r, double fastest)
{
    long j;
    double speed;
    double slope;
    r[FASTEST] = fastest;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        speed = ((fastest <= V_CREDIBLE_RAD_S) ? r[(V + j)] : 0.0);
        slope = (r[(SLOPE + j)] + (((speed - r[(KNOWN + j)]) - (r[DT] * r[(SLOPE + j)])) / (SPEED_FILTER_S + r[DT])));
        const double t2 = ((r[(ISOLATED + j)] == 0.0) ? slope : 0.0);
        const double t3 = speed;
        r[(SLOPE + j)] = t2;
        r[(KNOWN + j)] = t3;
    }
}

void guard_limit(double *restrict r, double *restrict w)
{
    long n;
    int worn;
    double fastest;
    long j;
    int is_clipped;
    guard_believe(r);
    const long t1 = (long)(r[N]);
    const int t2 = (r[WORN] != 0.0);
    const double t3 = 0.0;
    n = t1;
    worn = t2;
    fastest = t3;
    const long t4 = n;
    for (j = 0; j < t4; j += 1) {
        fastest = guard_most(fastest, fabs(r[(V + j)]));
    }
    guard_follow(r, fastest);
    if (worn) {
        guard_look(r, w);
    }
    guard_watch(r, fastest);
    if ((r[STOP] != 0.0)) {
        guard_descend(r);
    } else {
        const long t5 = n;
        for (j = 0; j < t5; j += 1) {
            r[(WANTED + j)] = r[(DESIRED + j)];
        }
    }
    guard_bound_and_brake(r, ((r[STOP] != 0.0) || (fastest > r[V_DAMPING]) || (worn && (r[IN_WALL] != 0.0))));
    if (worn) {
        guard_spare(r, 0.0);
        guard_spare(r, 1.0);
        guard_afford(r);
    }
    is_clipped = guard_limit_rate(r);
    if (worn) {
        guard_pay(r);
    }
    if (((r[STOP] == 0.0) && is_clipped)) {
        r[CLIPPED] += 1.0;
    }
}

void guard_take_in(double *restrict r)
{
    long slots;
    long at;
    long j;
    slots = (long)(r[USED_SLOTS]);
    guard_ignore_isolated(r, slots);
    r[USABLE] = 0.0;
    if ((r[CAME] == 0.0)) {
        return;
    }
    if ((r[SEQUENCE_IN] <= r[SEQUENCE])) {
        r[DROPPED] += 1.0;
        return;
    }
    r[SEQUENCE] = r[SEQUENCE_IN];
    if ((!(fabs((r[NOW] - r[T_IN])) <= AGE_MAX_S))) {
        return;
    }
    if ((guard_is_broken(r) || guard_has_jumped(r) || guard_is_frozen(r))) {
        return;
    }
    at = modulo(((long)(r[USED_AT]) + 1), slots);
    const long t1 = at;
    const double t2 = r[T_IN];
    const double t3 = 1.0;
    r[USED_AT] = t1;
    r[T_USED] = t2;
    r[USABLE] = t3;
    const long t4 = (long)(r[N]);
    for (j = 0; j < t4; j += 1) {
        r[((USED + (at * JOINTS)) + j)] = ((r[(IGNORED + j)] != 0.0) ? NAN : r[(Q_IN + j)]);
        r[(DEAD + j)] = ((guard_is_dead(r, j, at, slots) || guard_is_stuck(r, j)) ? 1.0 : 0.0);
    }
}

void guard_ignore_isolated(double *restrict r, long slots)
{
    long j;
    long k;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        r[(JUMPED + j)] = 0.0;
        r[(DEAD + j)] = 0.0;
        r[(BROKEN + j)] = 0.0;
        if (((r[(ISOLATED + j)] != 0.0) && (r[(IGNORED + j)] == 0.0))) {
            const long t2 = slots;
            for (k = 0; k < t2; k += 1) {
                r[((USED + (k * JOINTS)) + j)] = NAN;
            }
        }
        r[(IGNORED + j)] = r[(ISOLATED + j)];
    }
}

int guard_is_broken(double *restrict r)
{
    int is_any;
    long j;
    double torque;
    is_any = 0;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        torque = ((r[IN_CURRENT] != 0.0) ? r[(CURRENT_IN + j)] : r[(TAU_IN + j)]);
        if (((r[(IGNORED + j)] == 0.0) && (!(isfinite(r[(Q_IN + j)]) && isfinite(torque))))) {
            r[(BROKEN + j)] = 1.0;
            is_any = 1;
        }
    }
    return is_any;
}

int guard_has_jumped(double *restrict r)
{
    long last;
    int is_far;
    double ticks;
    long j;
    double reach;
    const long t1 = (USED + ((long)(r[USED_AT]) * JOINTS));
    const int t2 = 0;
    last = t1;
    is_far = t2;
    ticks = guard_whole(((r[T_IN] - r[T_USED]) / r[DT]));
    const long t3 = (long)(r[N]);
    for (j = 0; j < t3; j += 1) {
        reach = ((r[(JUMPS + j)] != 0.0) ? ((ticks * r[WAY]) + r[(SLACK + j)]) : (ticks * r[(REACH + j)]));
        if (((r[(IGNORED + j)] == 0.0) && (fabs((r[(Q_IN + j)] - r[(last + j)])) > reach))) {
            r[(JUMPS + j)] += 1.0;
            is_far = 1;
        } else {
            r[(JUMPS + j)] = 0.0;
        }
    }
    if (is_far) {
        const long t4 = (long)(r[N]);
        for (j = 0; j < t4; j += 1) {
            r[(JUMPED + j)] = ((r[(JUMPS + j)] >= JUMPS_MAX) ? 1.0 : 0.0);
        }
    }
    return is_far;
}

int guard_is_frozen(double *restrict r)
{
    int is_any;
    int is_long;
    double chance;
    long j;
    const int t1 = 0;
    const int t2 = 1;
    const double t3 = 1.0;
    is_any = t1;
    is_long = t2;
    chance = t3;
    const long t4 = (long)(r[N]);
    for (j = 0; j < t4; j += 1) {
        guard_keep(r, j);
        if ((r[(IGNORED + j)] == 0.0)) {
            const int t5 = 1;
            const double t6 = (chance * r[(KEPT_CHANCE + j)]);
            is_any = t5;
            chance = t6;
            is_long = (is_long && (r[(KEPT_TICKS + j)] >= r[FROZEN_MOST]));
        }
    }
    return (is_any && is_long && (chance < UNLIKELY));
}

void guard_keep(double *restrict r, long j)
{
    double q;
    double motor;
    double torque;
    double change;
    int is_kept;
    double step;
    double turned;
    const double t1 = r[(Q_IN + j)];
    const double t2 = ((r[HAS_MOTOR] != 0.0) ? r[(Q_MOTOR_IN + j)] : 0.0);
    q = t1;
    motor = t2;
    torque = ((r[IN_CURRENT] != 0.0) ? r[(CURRENT_IN + j)] : r[(TAU_IN + j)]);
    change = (torque - r[(TORQUE_KEPT + j)]);
    is_kept = ((change == 0.0) && (q == r[(Q_KEPT + j)]) && ((motor == r[(MOTOR_KEPT + j)]) || isnan(motor)));
    const double t3 = q;
    const double t4 = motor;
    const double t5 = torque;
    r[(Q_KEPT + j)] = t3;
    r[(MOTOR_KEPT + j)] = t4;
    r[(TORQUE_KEPT + j)] = t5;
    r[(KEPT_SEEN + j)] = guard_least((r[(KEPT_SEEN + j)] + 1.0), TICKS_MOST);
    step = guard_most(r[NOISE_STEP], (1.0 / guard_most((1.0 + r[(KEPT_SEEN + j)]), 1.0)));
    r[(KEPT_SHARE + j)] += (step * ((is_kept ? 1.0 : 0.0) - r[(KEPT_SHARE + j)]));
    if (is_kept) {
        r[(KEPT_TICKS + j)] += 1.0;
        if (((r[(TURNS + j)] >= LEAST_TURNS) && ((r[(KEPT_SEEN + j)] - r[(KEPT_TICKS + j)]) >= LEAST_SEEN))) {
            r[(KEPT_CHANCE + j)] = guard_most((r[(KEPT_CHANCE + j)] * r[(KEPT_SHARE + j)]), (UNLIKELY * UNLIKELY));
        }
    } else {
        const double t6 = 0.0;
        const double t7 = 1.0;
        r[(KEPT_TICKS + j)] = t6;
        r[(KEPT_CHANCE + j)] = t7;
    }
    if (((change > 0.0) || (change < 0.0))) {
        turned = (((change * r[(CHANGE_BEFORE + j)]) < 0.0) ? 1.0 : 0.0);
        r[(TURNS + j)] += (step * (turned - r[(TURNS + j)]));
        r[(CHANGE_BEFORE + j)] = change;
    }
}

int guard_is_stuck(double *restrict r, long j)
{
    return ((r[(IGNORED + j)] == 0.0) && (r[(KEPT_TICKS + j)] >= r[FROZEN_JOINT]) && (r[(KEPT_CHANCE + j)] < UNLIKELY));
}

int guard_is_dead(double *restrict r, long j, long at, long slots)
{
    double q;
    long oldest;
    double still;
    long k;
    const double t1 = r[((USED + (at * JOINTS)) + j)];
    const long t2 = (at + 1);
    q = t1;
    oldest = t2;
    still = r[((USED + (modulo((oldest + (long)(r[MOVING])), slots) * JOINTS)) + j)];
    if ((!((q == still) && (fabs((q - r[((USED + (modulo(oldest, slots) * JOINTS)) + j)])) >= r[(LEAST_WAY + j)])))) {
        return 0;
    }
    const long t3 = slots;
    for (k = (long)(r[MOVING]); k < t3; k += 1) {
        if ((r[((USED + (modulo((oldest + k), slots) * JOINTS)) + j)] != q)) {
            return 0;
        }
    }
    return 1;
}

void guard_compare(double *restrict r)
{
    long j;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        const double t2 = r[(FAULTY_IN + j)];
        const double t3 = 0.0;
        const double t4 = 0.0;
        r[(FAULTY + j)] = t2;
        r[(PARTED + j)] = t3;
        r[(WRONG + j)] = t4;
    }
    if ((r[HAS_MOTOR] != 0.0)) {
        guard_compare_encoders(r);
    }
    if ((r[TOLD_COUNT] >= r[LATELY])) {
        guard_compare_torques(r);
    }
    const long t5 = (long)(r[N]);
    for (j = 0; j < t5; j += 1) {
        if ((r[(ISOLATED + j)] != 0.0)) {
            r[(FAULTY + j)] = 0.0;
            r[(PARTED + j)] = 0.0;
            r[(WRONG + j)] = 0.0;
        }
    }
}

void guard_compare_encoders(double *restrict r)
{
    long slots;
    long at;
    long oldest;
    long j;
    double q;
    double motor;
    double way;
    double motor_way;
    int is_opposite;
    int is_apart;
    int stands;
    const long t1 = ((long)(r[SPEED]) + 1);
    const long t2 = modulo(((long)(r[BEFORE_AT]) + 1), ((long)(r[SPEED]) + 1));
    slots = t1;
    at = t2;
    const long t3 = at;
    const double t4 = guard_least((r[BEFORE_COUNT] + 1.0), (double)(slots));
    r[BEFORE_AT] = t3;
    r[BEFORE_COUNT] = t4;
    oldest = ((r[BEFORE_COUNT] == slots) ? modulo((at + 1), slots) : 0);
    const long t5 = (long)(r[N]);
    for (j = 0; j < t5; j += 1) {
        const double t6 = r[(Q_IN + j)];
        const double t7 = r[(Q_MOTOR_IN + j)];
        q = t6;
        motor = t7;
        const double t8 = q;
        const double t9 = motor;
        r[((BEFORE + (at * JOINTS)) + j)] = t8;
        r[((MOTOR_BEFORE + (at * JOINTS)) + j)] = t9;
        if (isnan(r[(FIRST + j)])) {
            r[(FIRST + j)] = (q - motor);
        }
        const double t10 = (q - r[((BEFORE + (oldest * JOINTS)) + j)]);
        const double t11 = (motor - r[((MOTOR_BEFORE + (oldest * JOINTS)) + j)]);
        way = t10;
        motor_way = t11;
        is_opposite = (((way * motor_way) < 0.0) && (guard_least(fabs(way), fabs(motor_way)) > r[LEAST_OPPOSITE]));
        is_apart = (is_opposite || (fabs(((q - motor) - r[(FIRST + j)])) > AGREE_RAD));
        r[(PARTED_TICKS + j)] = (is_apart ? (r[(PARTED_TICKS + j)] + 1.0) : 0.0);
        r[(STILL + j)] = ((q == r[(LAST + j)]) ? (r[(STILL + j)] + 1.0) : 0.0);
        if ((r[(STILL + j)] == 0.0)) {
            r[(MOTOR_THEN + j)] = motor;
        }
        stands = ((r[(STILL + j)] >= r[STILL_MOST]) && (fabs((motor - r[(MOTOR_THEN + j)])) > STILL_WAY_RAD));
        r[(PARTED + j)] = ((stands || (r[(PARTED_TICKS + j)] >= r[IN_A_ROW])) ? 1.0 : 0.0);
        r[(LAST + j)] = q;
    }
}

void guard_compare_torques(double *restrict r)
{
    long newest;
    long j;
    double tau;
    double off;
    double size;
    int is_off;
    int is_wrong;
    newest = (TOLD + ((long)(r[TOLD_AT]) * JOINTS));
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        tau = (r[(GAIN + j)] * ((r[BY_GAIN] != 0.0) ? r[(CURRENT_IN + j)] : r[(TAU_IN + j)]));
        off = (tau - r[(newest + j)]);
        size = fabs(off);
        is_off = ((size > TORQUE_OFF_NM) && (fabs(guard_off_lately(r, j, tau, (long)(r[LATELY]))) > TORQUE_OFF_NM));
        r[(OFF_TICKS + j)] = (is_off ? (r[(OFF_TICKS + j)] + 1.0) : 0.0);
        if ((size > (0.5 * TORQUE_BIAS_NM))) {
            off = guard_off_lately(r, j, tau, (long)(r[SLOWEST]));
        }
        if ((size < INFINITY)) {
            r[(BIAS + j)] += (r[BIAS_SHARE] * (off - r[(BIAS + j)]));
        }
        is_wrong = ((r[(OFF_TICKS + j)] >= r[IN_A_ROW]) || (fabs(r[(BIAS + j)]) > TORQUE_BIAS_NM));
        r[(WRONG + j)] = (is_wrong ? 1.0 : 0.0);
    }
}

double guard_off_lately(double *restrict r, long j, double tau, long ticks)
{
    long slots;
    long at;
    double low;
    double high;
    long k;
    double told;
    const long t1 = (long)(r[SLOWEST]);
    const long t2 = (long)(r[TOLD_AT]);
    slots = t1;
    at = t2;
    low = r[((TOLD + (at * JOINTS)) + j)];
    high = r[((TOLD + (at * JOINTS)) + j)];
    const long t3 = smaller(ticks, (long)(r[TOLD_COUNT]));
    for (k = 1; k < t3; k += 1) {
        told = r[((TOLD + (modulo((at - k), slots) * JOINTS)) + j)];
        const double t4 = guard_least(low, told);
        const double t5 = guard_most(high, told);
        low = t4;
        high = t5;
    }
    return (guard_most((tau - high), 0.0) + guard_least((tau - low), 0.0));
}

void guard_tell(double *restrict r)
{
    long slots;
    long at;
    long j;
    slots = (long)(r[SLOWEST]);
    at = modulo(((long)(r[TOLD_AT]) + 1), slots);
    const long t1 = at;
    const double t2 = guard_least((r[TOLD_COUNT] + 1.0), (double)(slots));
    r[TOLD_AT] = t1;
    r[TOLD_COUNT] = t2;
    const long t3 = (long)(r[N]);
    for (j = 0; j < t3; j += 1) {
        r[((TOLD + (at * JOINTS)) + j)] = r[(TAU + j)];
    }
}

int guard_is_refused(double *restrict r)
{
    int is_long;
    long j;
    double refused;
    int is_much;
    is_long = 0;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        refused = ((r[STOP] == 0.0) ? fabs((r[(HELD + j)] - r[(TAU + j)])) : 0.0);
        is_much = ((refused > REFUSED_NM) && (fabs(r[(V_SEEN + j)]) < SLOW_RAD_S));
        r[(REFUSED_TICKS + j)] = (is_much ? (r[(REFUSED_TICKS + j)] + 1.0) : 0.0);
        is_long = (is_long || (r[(REFUSED_TICKS + j)] > r[REFUSED_MOST]));
    }
    return is_long;
}

void guard_forget_misses(double *restrict r, long at)
{
    long k;
    r[at] = 0.0;
    r[(at + 1)] = 0.0;
    const long t1 = MISSES;
    for (k = 0; k < t1; k += 1) {
        r[((at + 2) + k)] = LONG_AGO;
    }
}

int guard_misses_too_many(double *restrict r, long at, int is_missed)
{
    long newest;
    long in_window;
    long in_second;
    long k;
    double ago;
    r[at] += 1.0;
    if ((!is_missed)) {
        return 0;
    }
    newest = modulo(((long)(r[(at + 1)]) + 1), MISSES);
    r[(at + 1)] = newest;
    r[((at + 2) + newest)] = r[at];
    in_window = 0;
    in_second = 0;
    const long t1 = MISSES;
    for (k = 0; k < t1; k += 1) {
        ago = (r[at] - r[((at + 2) + k)]);
        in_window += ((ago < r[WINDOW]) ? 1 : 0);
        in_second += ((ago < r[SECOND]) ? 1 : 0);
    }
    return ((in_window > r[IN_WINDOW]) || (in_second > IN_SECOND_MAX));
}

void guard_begin(double *restrict r)
{
    long j;
    r[HAS_SPEED] = 0.0;
    r[SPEED_T] = 0.0;
    guard_forget_misses(r, MACHINE_MISSES);
    guard_forget_misses(r, CONTROL_MISSES);
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        r[(HELD + j)] = 0.0;
        r[(V_FILTER + j)] = 0.0;
    }
}

void guard_approach_level(double *restrict r)
{
    int is_free;
    double fall;
    is_free = ((r[STOP] == 0.0) && (r[WORN] != 0.0));
    r[CONSENT] = (is_free ? guard_most(0.0, (r[CONSENT] - r[DT])) : 0.0);
    if (((r[CONSENT] == 0.0) && (guard_most(r[LEVEL], r[LEVEL_WANTED]) > 1.0))) {
        r[LEVEL_WANTED] = ((r[LEVEL_MOVES] != 0.0) ? guard_least(1.0, r[LEVEL_WANTED]) : 1.0);
        const double t1 = (r[DT] / GRAVITY_LEVEL_S);
        const double t2 = ((r[LEVEL] > 1.0) ? 1.0 : r[LEVEL_MOVES]);
        r[LEVEL_STEP] = t1;
        r[LEVEL_MOVES] = t2;
    }
    r[LEVEL_MOVES] = (is_free ? r[LEVEL_MOVES] : 0.0);
    if (((r[LEVEL] > 1.0) && (!(is_free && (r[IN_WALL] == 0.0) && (r[FASTEST] <= r[V_DAMPING]))))) {
        fall = (((GRAVITY_LEVEL_MAX - 1.0) / PUSH_ENDS_S) * r[DT]);
        const double t3 = guard_most(1.0, (r[LEVEL] - fall));
        const double t4 = (is_free ? 1.0 : 0.0);
        r[LEVEL] = t3;
        r[LEVEL_MOVES] = t4;
    } else {
        if (((r[LEVEL_MOVES] != 0.0) && (fabs((r[LEVEL_WANTED] - r[LEVEL])) <= r[LEVEL_STEP]))) {
            const double t5 = r[LEVEL_WANTED];
            const double t6 = 0.0;
            r[LEVEL] = t5;
            r[LEVEL_MOVES] = t6;
        } else {
            if ((r[LEVEL_MOVES] != 0.0)) {
                r[LEVEL] += copysign(r[LEVEL_STEP], (r[LEVEL_WANTED] - r[LEVEL]));
            }
        }
    }
}

void guard_filter_speeds(double *restrict r)
{
    double passed;
    double share;
    long j;
    double before;
    passed = guard_most((r[T_IN] - r[SPEED_T]), (0.5 * r[DT]));
    share = (passed / (SPEED_FILTER_S + passed));
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        before = ((r[HAS_SPEED] != 0.0) ? r[(Q_FILTER + j)] : r[(Q_IN + j)]);
        r[(V_FILTER + j)] += (share * (((r[(Q_IN + j)] - before) / passed) - r[(V_FILTER + j)]));
        r[(Q_FILTER + j)] = r[(Q_IN + j)];
        r[(Q_SEEN + j)] = r[(Q_IN + j)];
        r[(V_SEEN + j)] = r[(V_FILTER + j)];
    }
    const double t2 = r[T_IN];
    const double t3 = 1.0;
    r[SPEED_T] = t2;
    r[HAS_SPEED] = t3;
}

void guard_see(double *restrict r)
{
    long j;
    guard_approach_level(r);
    guard_take_in(r);
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        if (((r[(JUMPED + j)] != 0.0) || (r[(DEAD + j)] != 0.0))) {
            guard_trip(r, ((r[(JUMPED + j)] != 0.0) ? ENCODER_JUMPED : ENCODER_DEAD), 0);
            guard_isolate(r, j, 0);
            guard_forget_misses(r, MACHINE_MISSES);
        }
    }
    if ((r[USABLE] != 0.0)) {
        guard_filter_speeds(r);
        if ((r[COMPARES] != 0.0)) {
            guard_compare(r);
            guard_act_on_comparison(r);
        }
    }
}

void guard_act_on_comparison(double *restrict r)
{
    long n;
    long j;
    n = (long)(r[N]);
    const long t1 = n;
    for (j = 0; j < t1; j += 1) {
        if ((r[(FAULTY + j)] != 0.0)) {
            guard_trip(r, DRIVE_FAULT, 0);
            guard_isolate(r, j, 0);
        }
    }
    const long t2 = n;
    for (j = 0; j < t2; j += 1) {
        if ((r[(PARTED + j)] != 0.0)) {
            guard_trip(r, ENCODERS_PART, 0);
            guard_isolate(r, j, 0);
        }
    }
    const long t3 = n;
    for (j = 0; j < t3; j += 1) {
        if ((r[(WRONG + j)] != 0.0)) {
            guard_trip(r, TORQUE_WRONG, 1);
            guard_isolate(r, j, 1);
        }
    }
}

void guard_decide(double *restrict r, double *restrict w)
{
    long n;
    int is_any_broken;
    long j;
    int is_new;
    const long t1 = (long)(r[N]);
    const int t2 = 0;
    n = t1;
    is_any_broken = t2;
    const long t3 = n;
    for (j = 0; j < t3; j += 1) {
        is_any_broken = (is_any_broken || (r[(BROKEN + j)] != 0.0));
    }
    if (guard_misses_too_many(r, MACHINE_MISSES, (r[USABLE] == 0.0))) {
        guard_trip(r, (is_any_broken ? NO_MEASUREMENT : MACHINE_SILENT), 0);
        const long t4 = n;
        for (j = 0; j < t4; j += 1) {
            if (((r[(BROKEN + j)] != 0.0) || (!is_any_broken))) {
                guard_isolate(r, j, 0);
            }
        }
    }
    is_new = ((r[SPOKE] != 0.0) && (r[ANSWERS] == r[SEQUENCE_IN]) && (r[NOW] <= r[VALID_UNTIL]));
    r[BRIDGES] = (((r[USABLE] != 0.0) && is_new) ? 0.0 : 1.0);
    if (guard_misses_too_many(r, CONTROL_MISSES, (r[BRIDGES] != 0.0))) {
        guard_trip(r, CONTROL_SILENT, 0);
    }
    const long t5 = n;
    for (j = 0; j < t5; j += 1) {
        if ((r[BRIDGES] == 0.0)) {
            r[(HELD + j)] = r[(ANSWER_IN + j)];
        }
        const double t6 = r[(HELD + j)];
        const double t7 = r[(Q_SEEN + j)];
        const double t8 = r[(V_SEEN + j)];
        r[(DESIRED + j)] = t6;
        r[(Q_GIVEN + j)] = t7;
        r[(V_GIVEN + j)] = t8;
    }
    guard_limit(r, w);
    guard_tell(r);
    if (((r[COMPARES] != 0.0) && guard_is_refused(r))) {
        guard_trip(r, NOT_THIS_ARM, 0);
    }
    r[SAFE_STATE] = guard_safe_state(r);
}

double guard_safe_state(double *restrict r)
{
    long j;
    const long t1 = (long)(r[N]);
    for (j = 0; j < t1; j += 1) {
        if ((r[(ISOLATED + j)] != 0.0)) {
            return 3.0;
        }
    }
    if ((r[WITHOUT_MODEL] != 0.0)) {
        return 2.0;
    }
    if ((r[STOP] != 0.0)) {
        return 1.0;
    }
    return ((r[BRIDGES] == 0.0) ? (-1.0) : 0.0);
}

int guard_reset(double *restrict r)
{
    long n;
    int is_some;
    int stands;
    int all_stand;
    long j;
    int is_slow;
    const long t1 = (long)(r[N]);
    const int t2 = 0;
    const int t3 = 1;
    const int t4 = 1;
    n = t1;
    is_some = t2;
    stands = t3;
    all_stand = t4;
    const long t5 = n;
    for (j = 0; j < t5; j += 1) {
        is_slow = (fabs(r[(V_SEEN + j)]) < STANDING_RAD_S);
        all_stand = (all_stand && is_slow);
        if ((r[(ISOLATED + j)] == 0.0)) {
            const int t6 = 1;
            const int t7 = (stands && is_slow);
            is_some = t6;
            stands = t7;
        }
    }
    if (((r[USABLE] == 0.0) || (r[SINCE_STOP] < r[DESCENT_S]) || (!(is_some ? stands : all_stand)))) {
        return 0;
    }
    guard_leave_stop(r);
    guard_begin(r);
    return 1;
}
