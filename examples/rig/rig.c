/* Copyright 2026 The mlmem_ros authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * A rig in C99: the protocol of docs/reference/rig.md for a serial line, as a microcontroller needs it.
 * Nothing is allocated. On a board, replace the element (first part) by actuator and sensors, and
 * the board (last part) by its serial port and its clock; what is between them stays.
 *
 *     cc -std=c99 -O2 -o rig rig.c -lm
 *     ./rig PORT SECONDS        serves a serial port, with SECONDS per time unit of the element
 */
#define _POSIX_C_SOURCE 200809L /* for the board */

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DT 0.25       /* time units from sample to sample */
#define TICK 80u      /* samples of a tick */
#define STEPS 2u      /* set-points, and steps of the element, in a sample: its `nodes` */
#define BUFFER 4096u  /* samples of set-points that it holds; the driver sends half at once */
#define KEPT 64u      /* ticks of samples that it keeps, to send them again: more than BUFFER */
#define QUIET 1.0     /* s of its ticks without a byte after which the driver has gone */

/* --- the element: Case II of the paper over a rigid substrate, by velocity Verlet ------------- */

#define N 225

/* What the sensors read at displacement 0, left and right. */
static const double zero[2] = {3.0, -2.0};

static double v[N], velocity[N], force[N], height[N], shape[N];

static void element_begin(void)
{
    double sum = 0.0;
    for (int j = 1; j <= N; j++) {
        height[j - 1] = 0.0380 * (1.0 - 4e-4 / 3.0 * j) * (j % 25 ? 1.0 : 0.95);
        shape[j - 1] = sum;
        sum += 1.0 / (1000.0 + 2000.0 * fabs((j + 50 - 17 - 25) % 50 - 25.0) / 25.0);
        v[j - 1] = -0.99790; /* every cell in the inactive phase: blank */
    }
    for (int j = 0; j < N; j++)
        shape[j] /= shape[N - 1];
}

/* Pass a step. The substrate's end is at V_N; the end at `site` (1, N; 0: none) is held. */
static void element_pass(double V_N, uint32_t site, double place, double speed)
{
    const double dt = DT / STEPS;
    for (int j = 0; j < N; j++) {
        velocity[j] += 0.5 * dt * (force[j] - velocity[j] / 250.0);
        v[j] += dt * velocity[j];
    }
    if (site)
        v[site - 1] = place - zero[site > 1];
    for (int j = 0; j < N; j++) {
        double y = v[j] - V_N * shape[j] + 7.4489;
        double theta = y * (0.2582 + 0.0172 * y * y), slope = 0.2582 + 3.0 * 0.0172 * y * y;
        force[j] = -height[j] * sin(theta) * slope;
        force[j] += (j ? v[j - 1] - v[j] : 0.0) + (j < N - 1 ? v[j + 1] - v[j] : 0.0);
        velocity[j] = (velocity[j] + 0.5 * dt * force[j]) / (1.0 + 0.5 * dt / 250.0);
    }
    if (site)
        velocity[site - 1] = speed;
}

/* --- the board: bytes and time; see the end of this file --------------------------------------- */

static void board_send(const uint8_t *bytes, size_t count);
static double board_seconds(void);

/* --- frames ------------------------------------------------------------------------------------ */

enum { HELLO = 1, PLAY, SAMPLES, AGAIN, FAULT };
enum { HEAD = 17, PLAY_HEAD = 20, SAMPLES_HEAD = 24, MOST = PLAY_HEAD + 12 * STEPS * BUFFER / 2 };

static uint8_t in[HEAD + MOST + 4], out[HEAD + 1024];
static size_t have; /* bytes in `in` */

static uint32_t crc32(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xFFFFFFFFu;
    while (count--) {
        crc ^= *bytes++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
    }
    return ~crc;
}

static void put(uint8_t *at, uint64_t value, int bytes) /* little-endian on any machine */
{
    for (int i = 0; i < bytes; i++)
        at[i] = (uint8_t)(value >> 8 * i);
}

static uint64_t get(const uint8_t *at, int bytes)
{
    uint64_t value = 0;
    for (int i = 0; i < bytes; i++)
        value |= (uint64_t)at[i] << 8 * i;
    return value;
}

static void put_float(uint8_t *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    put(at, bits, 4);
}

static float get_float(const uint8_t *at)
{
    uint32_t bits = (uint32_t)get(at, 4);
    float value;
    memcpy(&value, &bits, 4);
    return value;
}

/* Send a frame whose payload is already in `out`, behind the head. */
static void send_frame(int kind, uint64_t number, size_t length)
{
    out[0] = 'm', out[1] = 'R', out[2] = (uint8_t)kind;
    put(out + 3, number, 8);
    put(out + 11, length, 4);
    put(out + 15, crc32(out, 15) & 0xFFFFu, 2);
    put(out + HEAD + length, crc32(out, HEAD + length), 4);
    board_send(out, HEAD + length + 4);
}

/* --- the rig ----------------------------------------------------------------------------------- */

struct set_point {
    float V_N, place, speed;
    uint32_t site;
};

struct tick {
    uint32_t missed;
    float ends[2 * TICK];
};

static struct set_point queue[STEPS * BUFFER], last; /* samples `played` ... `stored` are in the queue */
static struct tick kept[KEPT];               /* of the last ticks played */
static uint64_t expected, stored, played;    /* number of the next frame; numbers of samples */
static double ahead, waited, unit;           /* s; s; s per time unit */
static uint32_t missed;
static int playing, faulty;

static void send_hello(void)
{
    int length = snprintf(
        (char *)out + HEAD, sizeof out - HEAD,
        "{\"protocol\": 1, \"name\": \"C99\", \"dt\": %.9g, \"seconds\": %.9g, \"samples\": %u, "
        "\"length\": 0.01, \"zero\": [%.9g, %.9g], \"nodes\": [0.5, 1.0], \"numbers\": \"<f4\", "
        "\"buffer\": %u, \"can\": [\"strain\", \"left\", \"right\"]}",
        DT, DT * unit, TICK, zero[0], zero[1], BUFFER);
    send_frame(HELLO, 0, (size_t)length);
}

/* Send the samples of a tick: its frame has the number of the tick + 1, for the hello is 0. */
static void send_samples(uint64_t tick)
{
    const struct tick *its = &kept[tick % KEPT];
    uint8_t *at = out + HEAD;
    put(at, tick * TICK, 8);
    put(at + 8, TICK, 4);
    put(at + 12, its->missed, 4);
    put(at + 16, 0x7FF8000000000000u, 8); /* NaN: it measures no force */
    for (uint32_t i = 0; i < 2 * TICK; i++)
        put_float(at + SAMPLES_HEAD + 4 * i, its->ends[i]);
    send_frame(SAMPLES, tick + 1, SAMPLES_HEAD + 8 * TICK);
}

static void send_fault(const char *why)
{
    memcpy(out + HEAD, why, strlen(why));
    send_frame(FAULT, played / TICK + 1, strlen(why));
    faulty = 1; /* until the next hello */
}

/* Release the ends, bring the strain slowly to zero, and wait until nothing moves. */
static void let_go(void)
{
    double V_N = last.V_N;
    for (int k = 0; V_N != 0.0 && k < 20800; k++)
        element_pass(k < 4800 ? V_N * (1.0 - k / 4800.0) : 0.0, 0, 0.0, 0.0);
    last = (struct set_point){0};
}

static void begin(const char *hello)
{
    const char *said = strstr(hello, "\"ahead\":");
    ahead = said ? strtod(said + 8, NULL) : 0.0;
    expected = 1, stored = played = 0;
    missed = 0, waited = 0.0, playing = faulty = 0;
    send_hello();
}

static void store(const uint8_t *payload, size_t length)
{
    uint64_t first = get(payload, 8);
    uint32_t samples = (uint32_t)get(payload + 8, 4), held = (uint32_t)get(payload + 16, 4);
    uint32_t points = STEPS * samples;
    const uint8_t *V_N = payload + PLAY_HEAD, *place = V_N + 4 * points, *speed = place + 4 * held;
    if (first != stored || samples > BUFFER - (stored - played) || held > points
        || length != PLAY_HEAD + 4 * (points + 2 * held)) {
        send_fault("these are not the set-points that are due");
        return;
    }
    for (uint32_t k = 0; k < points; k++) {
        struct set_point *next = &queue[(STEPS * stored + k) % (STEPS * BUFFER)];
        *next = (struct set_point){get_float(V_N + 4 * k), 0.0f, 0.0f, 0};
        if (k < held) {
            next->site = (uint32_t)get(payload + 12, 4);
            next->place = get_float(place + 4 * k);
            next->speed = get_float(speed + 4 * k);
        }
    }
    stored += samples;
}

/* Act on a frame. What came before is dropped; what is missing is asked for. */
static void act(int kind, uint64_t number, uint8_t *payload, size_t length)
{
    if (kind == HELLO) {
        payload[length] = '\0'; /* over the CRC, which has been checked */
        let_go();
        begin((const char *)payload);
    } else if (kind == AGAIN) {
        uint64_t sent = played / TICK;
        if (number == 0)
            send_hello();
        for (uint64_t tick = number ? number - 1 : 0; tick < sent; tick++)
            if (sent - tick <= KEPT)
                send_samples(tick);
    } else if (number > expected) {
        send_frame(AGAIN, expected, 0);
    } else if (number == expected && !faulty) {
        expected++;
        if (kind == PLAY && length >= PLAY_HEAD)
            store(payload, length);
        else
            send_fault("a frame of unknown kind");
    }
}

/* Take bytes, and act on every whole frame; skip what is none. */
static void take(const uint8_t *bytes, size_t count)
{
    while (count--) {
        in[have++] = *bytes++;
        while (have >= HEAD) {
            size_t length = (size_t)get(in + 11, 4), whole = HEAD + length + 4, skip = 1;
            if (in[0] == 'm' && in[1] == 'R' && length <= MOST
                && get(in + 15, 2) == (crc32(in, 15) & 0xFFFFu)) {
                if (have < whole)
                    break;
                if (get(in + whole - 4, 4) == crc32(in, whole - 4)) {
                    act(in[2], get(in + 3, 8), in + HEAD, length);
                    skip = whole;
                }
            }
            have -= skip;
            memmove(in, in + skip, have);
        }
    }
}

/* Pass a tick: play set-points and send their samples, or hold the last ones. */
static void tick(void)
{
    struct tick *its = &kept[played / TICK % KEPT];
    double seconds = DT * unit, left = (double)(stored - played);
    waited = left > 0.0 ? waited + TICK * seconds : 0.0;
    playing = left > 0.0 && !faulty && (playing || left * seconds >= ahead || waited >= ahead);
    for (uint32_t k = 0; k < STEPS * TICK; k++) {
        if (playing)
            last = queue[(STEPS * played + k) % (STEPS * BUFFER)];
        element_pass(last.V_N, last.site, last.place, last.speed);
        if (playing && k % STEPS == STEPS - 1) {
            its->ends[k / STEPS] = (float)(v[0] + zero[0]);
            its->ends[TICK + k / STEPS] = (float)(v[N - 1] + zero[1]);
        }
    }
    if (playing) {
        its->missed = missed, missed = 0;
        played += TICK;
        send_samples(played / TICK - 1);
    } else
        missed += TICK;
}

/* --- the board: a serial port of POSIX -------------------------------------------------------- */

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static int port;

static void board_send(const uint8_t *bytes, size_t count)
{
    while (count) {
        ssize_t sent = write(port, bytes, count);
        if (sent <= 0)
            exit(1);
        bytes += sent, count -= (size_t)sent;
    }
}

static double board_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int main(int count, char **given)
{
    uint8_t bytes[4096];
    struct termios raw;
    if (count != 3 || (port = open(given[1], O_RDWR | O_NOCTTY)) < 0)
        return fprintf(stderr, "usage: %s PORT SECONDS\n", given[0]), 2;
    tcgetattr(port, &raw);
    raw.c_iflag = raw.c_oflag = raw.c_lflag = 0;
    tcsetattr(port, TCSANOW, &raw);
    unit = strtod(given[2], NULL);
    element_begin();
    double due = board_seconds(), quiet = 0.0; /* since the last byte, in time that was played */
    for (;;) {
        double now = board_seconds(), wait = due > now ? due - now : 0.0;
        struct pollfd waiting = {port, POLLIN, 0};
        if (poll(&waiting, 1, (int)ceil(1e3 * wait)) > 0) {
            ssize_t come = read(port, bytes, sizeof bytes);
            if (come <= 0)
                return 0;
            take(bytes, (size_t)come);
            quiet = 0.0;
        } else if (quiet > QUIET && last.V_N != 0.0f) {
            let_go();
            send_fault("no byte came for a second: the strain is zero");
        }
        if ((now = board_seconds()) >= due) {
            tick();
            quiet += TICK * DT * unit;
            due += TICK * DT * unit;
            if (due < now)
                due = now; /* a simulated element waits for a slow machine */
        }
    }
}
