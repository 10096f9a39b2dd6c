/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device as text for a person and as JSON for a script. */
#ifndef TOOLS_PRINT_H
#define TOOLS_PRINT_H

#include <stdio.h>
#include "tools/json.h"
#include "tools/view.h"

/* "212 us", "1.20 ms", "3.4 s", "-" for infinity: at most 9 characters. */
const char *print_duration(double ns, char text[16]);

/* A text of an image, which need not end and may hold anything, as printable ASCII. */
const char *print_clean(const char *bytes, size_t size, char text[32]);

/* Terminals (1-based) of the bits that are set, "none" if none is. */
void print_pins(const uint8_t bits[POKEYS_PIN_BYTES], char *text, size_t size);

/* How the daemon's cycle lies to the commander's reads. */
const char *print_phase(const struct pokeys_phase *phase, char text[80]);

/*
 * Words of `text` in lines of at most `columns`, the first one behind `first`, the others behind
 * `next`, with a newline at the end. A longer word has a line of its own.
 */
void print_wrapped(const char *first, const char *next, int columns, const char *text, FILE *to);

bool print_bit(const uint8_t *bits, unsigned int index);

/* The pulse engine with all that hangs on it, a line each; nothing without one. */
void print_engine(const struct view_device *device, FILE *to);

/* There is a PoStep driver at this axis. */
bool print_has_postep(const struct view_device *device, unsigned int axis);

/* "24 V 41 C active", "SILENT for 3.2 s", "NOT HEARD OF". */
const char *print_postep(const struct pokeys_state *state, unsigned int axis, char text[40]);

/* "over-temperature, stall"; empty without a fault. */
const char *print_postep_faults(const struct pokeys_postep *driver, char text[128]);

/* How threading by the device stands, or ended; empty where it was never asked for. */
const char *print_threading(const struct pokeys_state *state, char text[200]);

/* A heater that pokeysd.conf has; what it does, and why it does not heat. */
enum { PRINT_HEATER_MAX = 400 };
bool print_has_heater(const struct pokeys_state *state, unsigned int heater);
const char *print_heater(const struct pokeys_heater *heater, char text[PRINT_HEATER_MAX]);

/* A line for each heater; nothing without one. */
void print_heaters(const struct pokeys_state *state, FILE *to);

/* Why a heater or motor is not ready, " (in parentheses)", or "". Returns it. */
enum { PRINT_OBSTACLE_MAX = 64 };
const char *print_obstacle(uint8_t obstacle, char text[PRINT_OBSTACLE_MAX]);

/* The same of a servo motor. */
enum { PRINT_SERVO_MAX = 400 };
bool print_has_servo(const struct pokeys_state *state, unsigned int servo);
const char *print_servo(const struct pokeys_servo *servo, char text[PRINT_SERVO_MAX]);
const char *print_moves(const struct pokeys_moves *moves, char text[PRINT_SERVO_MAX]);
void print_servos(const struct pokeys_state *state, FILE *to);
/* A number as it is printed with so many digits, but 0 for "-0". */
double print_rounded(double value, unsigned int digits);

/* Everything worth knowing of a device, in a dozen lines. */
void print_status(const struct view_device *device, FILE *to);

/* One JSON document of all devices on one line; its keys are those of pokeysctl(1). */
void print_json_all(const struct view *view, FILE *to);

/* Its parts with the keys "engine", "heaters" and "servos". */
void print_json_engine(struct json *json, const struct pokeys_state *state);
void print_json_heaters(struct json *json, const struct pokeys_state *state);
void print_json_servos(struct json *json, const struct pokeys_state *state);

/* The histograms of the diagnostic image, in the order they are shown. */
struct print_histogram {
	const char *key, *title;
	size_t offset;
	bool in_top; /* top has 24 lines */
};
extern const struct print_histogram print_histograms[];
extern const size_t print_histogram_count;
const struct pokeys_histogram *print_histogram_of(const struct pokeys_diag *diag, size_t index);

#endif
