// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What pokeysctl says of images that were made up for it: dead writers, names
 * that are no names, numbers that are none. Prints a JSON document with
 * --print, for json_keys.py to read.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tools/print.h"
#include "tools/screen.h"

#define MS UINT64_C(1000000)

static struct view view;
static char *text;
static size_t length;

/* A device that runs, read 1 ms after it was published. */
static struct view_device *fresh(void)
{
	struct view_device *device = &view.device[0];

	memset(&view, 0, sizeof(view));
	view.count = 1;
	strcpy(device->name, "mill");
	device->now_ns = 10000 * MS;
	device->has_diag = true;
	device->state.link = POKEYS_LINK_RUNNING;
	device->state.period_ns = MS;
	device->state.stale_after_ns = 10 * MS;
	device->state.t_publish_ns = device->now_ns - MS;
	device->state.t_digital_ns = device->now_ns - 2 * MS;
	device->state.flags = POKEYS_STATE_REALTIME;
	device->state.identity.serial = 31234;
	strcpy(device->state.identity.type, "PoKeys57CNC");
	return device;
}

static const char *status_of(struct view_device *device)
{
	FILE *to;

	free(text);
	view_judge(device);
	to = open_memstream(&text, &length);
	print_status(device, to);
	fclose(to);
	return text;
}

static void a_dead_daemon_is_noticed_by_our_own_clock(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	device->state.t_publish_ns = device->now_ns - 3200 * MS;
	device->state.t_digital_ns = device->state.t_publish_ns - MS;
	assert_non_null(strstr(status_of(device),
			       "mill: running: stale (daemon not publishing for 3.2 s)\n"));
	assert_non_null(strstr(text, "\n  values      NOT CURRENT, the last ones received\n"));
	assert_int_equal(device->freshness, VIEW_DEAD);
}

static void old_data_of_a_living_daemon_is_stale(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	device->state.t_digital_ns = device->now_ns - 10 * MS;
	assert_null(strstr(status_of(device), "the last ones received"));
	assert_int_equal(device->freshness, VIEW_FRESH);
	device->state.t_digital_ns--;
	view_judge(device);
	assert_int_equal(device->freshness, VIEW_STALE);
	assert_string_equal(device->why, "stale (data is 10 ms old)");
	device->state.t_digital_ns = 0;
	view_judge(device);
	assert_string_equal(device->why, "no data yet");
	device->state.link = POKEYS_LINK_LOST;
	device->state.fault = POKEYS_FAULT_NO_ANSWER;
	view_judge(device);
	assert_int_equal(device->freshness, VIEW_STALE);
	assert_string_equal(device->why, "no answer; check power and cable, then run \"sudo "
					 "pokeysctl discover\"");
}

/* As HAL and the daemon's own flag have it: the older of what every cycle brings. */
static void old_positions_are_stale_beside_inputs_that_are_not(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	device->state.t_motion_ns = device->now_ns - 500 * MS;
	view_judge(device);
	assert_int_equal(device->freshness, VIEW_FRESH); /* it has no engine */
	device->state.capability.pulse_engine = 2;
	assert_non_null(strstr(status_of(device), "stale (data is 500 ms old)"));
	assert_non_null(strstr(text, "500 ms old, cycle"));
	assert_int_equal(device->freshness, VIEW_STALE);
	device->state.t_motion_ns = device->now_ns - 10 * MS;
	view_judge(device);
	assert_int_equal(device->freshness, VIEW_FRESH);
}

static void a_stamp_of_the_future_is_not_fresh(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	assert_true(view_age_ns(5, 7) <= 0);
	assert_true(isinf(view_age_ns(5, 0)));
	assert_true(isinf(view_age_ns(5, 3600000 * MS)));
	device->state.t_digital_ns = device->now_ns + 3600000 * MS;
	view_judge(device);
	assert_int_equal(device->freshness, VIEW_STALE);
	assert_string_equal(device->why,
			    "stale (its time stamps are ahead of this machine's clock)");
	device = fresh();
	device->state.t_publish_ns = device->now_ns + 3600000 * MS;
	assert_null(strstr(status_of(device), "inf"));
	assert_int_equal(device->freshness, VIEW_STALE);
}

/* The reader may pause between the clock and the image, or between the image and the clock. */
static void a_reader_that_is_held_blames_nobody(void **state)
{
	(void)state;
	assert_true(view_moment(1000, 900, 2000) == 1000);
	assert_true(view_moment(1000, 1900, 2000) == 1900);
	assert_true(view_moment(1000, 3600000, 2000) == 2000); /* the future stays ahead */
}

static void terminals_are_numbered_from_one(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	device->state.digital_in[0] = 0x81;
	device->state.digital_in[6] = 0xc0; /* 55 and a bit that is no pin */
	assert_non_null(strstr(status_of(device), "inputs on   1 8 55\n"));
	assert_non_null(strstr(text, "outputs on  none\n"));
}

static void a_device_that_never_answered_has_no_inputs(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	device->state.t_digital_ns = 0;
	device->state.link = POKEYS_LINK_SEARCHING;
	assert_null(strstr(status_of(device), "inputs"));
	assert_non_null(strstr(text, "mill: searching: no data yet"));
}

static void the_phase_is_shown_where_somebody_is_followed(void **state)
{
	struct view_device *device = fresh();

	(void)state;
	assert_non_null(strstr(status_of(device), "phase       off\n"));
	device->state.phase = (struct pokeys_phase){
		.state = POKEYS_PHASE_LOCKED,
		.lead_ns = 124000,
		.error_ns = -3200,
		.jitter_ns = 5000,
	};
	assert_non_null(strstr(status_of(device), "phase       locked, tick 124 us before the "
						  "read, error -3.2 us, jitter 5 us\n"));
}

/* One that answers, one that has stopped to, one that never did. */
static void drivers_are_shown_where_there_are_any(void **state)
{
	struct view_device *device = fresh();
	struct pokeys_postep *driver = device->state.postep;

	(void)state;
	device->state.t_motion_ns = device->now_ns;
	assert_null(strstr(status_of(device), "PoStep"));
	device->state.t_postep_ns = device->now_ns - 5 * MS;
	driver[0] = (struct pokeys_postep){
		.t_update_ns = device->now_ns - 1000 * MS,
		.supply = 97,
		.temperature = 41,
		.state = 2,
	};
	assert_non_null(strstr(status_of(device), "  PoStep 0    24.25 V 41 C active\n"));
	driver[0].mode = 2;
	driver[0].step_mode = 4;
	driver[0].temperature_limit = 85;
	driver[0].faults = 0x41;
	assert_non_null(strstr(status_of(device),
			       "PoStep 0    24.25 V 41 C active, step mode "
			       "1/16, limit 85 C, FAULT: over-temperature, stall\n"));
	driver[0].t_update_ns = device->state.t_postep_ns - 3200 * MS;
	assert_non_null(strstr(status_of(device), "PoStep 0    SILENT for 3.2 s, FAULT: over-"
						  "temperature, stall\n"));
	device->postep_axes = 4;
	assert_non_null(strstr(status_of(device), "  PoStep 2    NOT HEARD OF\n"));
	assert_null(strstr(text, "PoStep 1"));
	driver[0].t_update_ns = device->now_ns; /* the daemon has died long ago */
	device->now_ns += 60000 * MS;
	assert_non_null(strstr(status_of(device), "PoStep 0    24.25 V 41 C active"));
}

static void a_thread_is_shown_and_how_it_ended(void **state)
{
	struct view_device *device = fresh();
	struct pokeys_threading *threading = &device->state.threading;
	struct pokeys_engine *engine = &device->state.engine;

	(void)state;
	device->state.t_motion_ns = device->now_ns;
	assert_null(strstr(status_of(device), "threading"));
	threading->refused = POKEYS_THREADING_OFF;
	assert_non_null(strstr(status_of(device), "  threading   refused: the machine is off\n"));
	threading->refused = POKEYS_THREADING_WELL;
	engine->task = POKEYS_TASK_THREADING;
	engine->task_phase = POKEYS_TASK_STARTING;
	engine->task_axes = 5;
	assert_non_null(strstr(status_of(device), "  threading   beginning, axes 0 2, spindle "
						  "0/min, index 0, 0 slots behind\n"));
	engine->task_phase = POKEYS_TASK_WORKING;
	*threading = (struct pokeys_threading){
		.waiting = 1,
		.spindle_rpm = 500,
		.index_count = 7,
		.behind = 120,
	};
	assert_non_null(strstr(status_of(device),
			       "  threading   waiting for the spindle's index, "
			       "axes 0 2, spindle 500/min, index 7, 120 slots behind\n"));
	engine->task_phase = POKEYS_TASK_STOPPING;
	assert_non_null(strstr(status_of(device), "  threading   being stopped, axes 0 2"));
	engine->task_phase = POKEYS_TASK_IDLE;
	engine->task_result = POKEYS_TASK_STARVED;
	assert_non_null(strstr(status_of(device), "  threading   NOT OURS (waiting for the "
						  "spindle's index), it is being cancelled\n"));
	threading->waiting = 0;
	threading->refused = POKEYS_THREADING_MOVING;
	assert_non_null(strstr(status_of(device),
			       "  threading   the last one: stopped: the motion "
			       "buffer ran dry in the middle of a thread; refused: an axis has not "
			       "come to rest\n"));
}

static void heaters_are_shown_with_what_is_wrong(void **state)
{
	struct view_device *device = fresh();
	struct pokeys_heater *heater = &device->state.heater[1];

	(void)state;
	assert_null(strstr(status_of(device), "heater"));
	*heater = (struct pokeys_heater){
		.state = POKEYS_HEATER_OFF,
		.name = "bed",
		.temperature = 24.3f,
	};
	assert_non_null(strstr(status_of(device), "  heater 1    bed: 24.3 C, off\n"));
	heater->state = POKEYS_HEATER_HEATING;
	heater->target = 60;
	heater->power = 0.344f;
	heater->refused = POKEYS_HEATER_OUT_OF_RANGE;
	assert_non_null(strstr(status_of(device), "  heater 1    bed: 24.3 C, target 60.0 C, power "
						  "34 %, target refused: target out of range\n"));
	heater->refused = 0;
	heater->at_temperature = 1;
	assert_non_null(strstr(status_of(device), "power 34 %, at temperature\n"));
	heater->state = POKEYS_HEATER_FAULT;
	heater->fault = heater->condition = POKEYS_HEATER_OPEN;
	assert_non_null(strstr(status_of(device), "  heater 1    bed: 24.3 C, FAULT: sensor open, "
						  "off until it is reset\n"));
	heater->fault = heater->condition = POKEYS_HEATER_DEVICE;
	heater->obstacle = POKEYS_OBSTACLE_FAILSAFE;
	assert_non_null(strstr(status_of(device), "FAULT: device not ready, off until it is reset "
						  "(the failsafe would leave it on)\n"));
	heater->fault = 0;
	heater->state = POKEYS_HEATER_OFF;
	assert_non_null(strstr(status_of(device), ", off, NOT READY: device not ready (the "
						  "failsafe would leave it on)\n"));
	heater->fault = heater->condition = POKEYS_HEATER_OPEN;
	heater->obstacle = 0;
	heater->state = POKEYS_HEATER_STOPPING;
	assert_non_null(strstr(status_of(device), "off until it is reset, NOT ACKNOWLEDGED: it may "
						  "still heat\n"));
	heater->state = POKEYS_HEATER_OFF;
	heater->fault = 0;
	heater->temperature = NAN;
	assert_non_null(strstr(status_of(device), "  heater 1    bed: temperature unknown, off, "
						  "NOT READY: sensor open\n"));
	heater->condition = 0;
	heater->tuning = POKEYS_HEATER_TUNING_DONE;
	heater->tuned_p = 22.2f;
	heater->tuned_i = 1.08f;
	heater->tuned_d = 114;
	assert_non_null(strstr(status_of(device), "off, gains found: pid-p = 22.2, pid-i = 1.08, "
						  "pid-d = 114\n"));
}

static void durations_have_three_digits_and_a_unit(void **state)
{
	char out[16];

	(void)state;
	assert_string_equal(print_duration(0, out), "0 ns");
	assert_string_equal(print_duration(999, out), "999 ns");
	assert_string_equal(print_duration(999.6, out), "1 us");
	assert_string_equal(print_duration(212345, out), "212 us");
	assert_string_equal(print_duration(999600, out), "1 ms");
	assert_string_equal(print_duration(3.24e9, out), "3.2 s");
	assert_string_equal(print_duration(INFINITY, out), "-");
	assert_string_equal(print_duration(NAN, out), "-");
}

/* Hostile in every field that a device or another writer fills. */
static void spoil(struct view_device *device)
{
	memset(device->state.identity.name, 0xff, sizeof(device->state.identity.name));
	memcpy(device->state.identity.type, "a\"b\\c\n\x1b[2J\x01\x7f", 13);
	device->state.engine.axis[0].max_speed = NAN;
	device->state.engine.axis[1].max_speed = INFINITY;
	device->state.postep[7].t_update_ns = 1;
	device->state.postep[7].supply = 255;
	device->state.postep[7].faults = 255;
	device->state.postep[7].state = 200;
	device->state.t_motion_ns = 1;
	device->state.engine.task = POKEYS_TASK_THREADING;
	device->state.engine.task_phase = 200;
	device->state.engine.task_axes = 255;
	device->state.threading.spindle_rpm = UINT32_MAX;
	device->state.threading.index_count = UINT32_MAX;
	device->state.engine.axes_enabled = 255;
	memset(&device->state.heater[6], 0xff, sizeof(device->state.heater[6]));
	memset(&device->state.servo[5], 0xff, sizeof(device->state.servo[5]));
	device->state.link = 200;
	device->state.fault = 77;
	device->state.cycle = UINT64_MAX;
	device->diag.wakeup.count = 1;
	device->diag.wakeup.max_ns = UINT64_MAX;
	memset(device->diag.transport, 'x', sizeof(device->diag.transport));
}

static void motors_are_shown_and_nothing_is_minus_zero(void **state)
{
	struct view_device *device = fresh();
	struct pokeys_servo *servo = &device->state.servo[2];

	(void)state;
	assert_null(strstr(status_of(device), "servo"));
	*servo = (struct pokeys_servo){
		.state = POKEYS_SERVO_ENABLED,
		.name = "z",
		.position = -0.00001,
		.error = -0.00004f,
		.output = -0.004f,
	};
	assert_non_null(strstr(status_of(device), "  servo 2     z: at 0.0000, enabled, error "
						  "0.0000, output 0 %\n"));
	servo->position = -12.34567;
	servo->error = -0.00006f;
	servo->output = -0.006f;
	assert_non_null(strstr(status_of(device), "  servo 2     z: at -12.3457, enabled, error "
						  "-0.0001, output -1 %\n"));
	servo->state = POKEYS_SERVO_STOPPING;
	assert_non_null(strstr(status_of(device), "z: at -12.3457, off, NOT ACKNOWLEDGED: it may "
						  "still run\n"));
}

static void hostile_images_do_no_harm_to_a_terminal(void **state)
{
	struct view_device *device = fresh();
	struct screen screen;

	(void)state;
	spoil(device);
	assert_null(strpbrk(status_of(device), "\x1b\x01\x7f"));
	for (const char *c = text; *c; c++)
		assert_true(*c == '\n' || (*c >= 0x20 && *c < 0x7f));
	screen = (struct screen){ .rows = 0, .columns = 80 };
	screen_line(&screen, "below the last row");
	assert_int_equal(screen.row, 0);
}

static int print(void)
{
	fresh();
	view.count = 3;
	view.device[1] = view.device[0];
	spoil(&view.device[1]);
	view.device[2].freshness = VIEW_NONE;
	strcpy(view.device[2].name, "away");
	strcpy(view.device[2].why, "a \"reason\"");
	view_judge(&view.device[0]);
	view_judge(&view.device[1]);
	print_json_all(&view, stdout);
	return ferror(stdout) ? 1 : 0;
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_dead_daemon_is_noticed_by_our_own_clock),
		cmocka_unit_test(old_data_of_a_living_daemon_is_stale),
		cmocka_unit_test(old_positions_are_stale_beside_inputs_that_are_not),
		cmocka_unit_test(a_stamp_of_the_future_is_not_fresh),
		cmocka_unit_test(a_reader_that_is_held_blames_nobody),
		cmocka_unit_test(terminals_are_numbered_from_one),
		cmocka_unit_test(a_device_that_never_answered_has_no_inputs),
		cmocka_unit_test(the_phase_is_shown_where_somebody_is_followed),
		cmocka_unit_test(drivers_are_shown_where_there_are_any),
		cmocka_unit_test(a_thread_is_shown_and_how_it_ended),
		cmocka_unit_test(heaters_are_shown_with_what_is_wrong),
		cmocka_unit_test(motors_are_shown_and_nothing_is_minus_zero),
		cmocka_unit_test(durations_have_three_digits_and_a_unit),
		cmocka_unit_test(hostile_images_do_no_harm_to_a_terminal),
	};

	if (argc > 1 && !strcmp(argv[1], "--print"))
		return print();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
