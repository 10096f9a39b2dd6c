/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * When the wish is sent, and what a person is told. Shared memory is made up.
 */
#include "tests/halbridge/rig.h"
#include <errno.h>
#include "halbridge/latency.h"
#include "halbridge/wisher.h"

static struct wisher wisher;
static struct values values;
static struct pokeys_report daemon_report;
static struct pokeys_wish sent;
static unsigned int sendings;
static int attached; /* 0, or what both calls return */
static char line[256];

static pokeys_client *const client = (pokeys_client *)&attached;

int pokeys_client_read_report(pokeys_client *from, struct pokeys_report *out)
{
	assert_ptr_equal(from, client);
	if (!attached)
		*out = daemon_report;
	return attached;
}

int pokeys_client_write_wish(pokeys_client *to, const struct pokeys_wish *wish)
{
	assert_ptr_equal(to, client);
	if (attached)
		return attached;
	sent = *wish;
	sendings++;
	return 0;
}

int pokeys_client_read_diag(pokeys_client *from, struct pokeys_diag *out)
{
	assert_ptr_equal(from, client);
	if (!attached)
		*out = (struct pokeys_diag){
			.cycles_skipped = 5,
			.wakeup = { .sum_ns = 2000, .max_ns = 9000 },
			.round_trip = { .sum_ns = 300000, .max_ns = 900000 },
			.fresh = { .sum_ns = 400000, .max_ns = 800000 },
		};
	return attached;
}

/* Made up, as everything here: which histogram, and which part of it. */
uint64_t pokeys_histogram_percentile(const struct pokeys_histogram *histogram, double p)
{
	assert_true(p == 0.99);
	return histogram->sum_ns;
}

static void refuse(void *argument, const struct wish_item *item, double value)
{
	(void)argument;
	wisher_explain(item, "pokeys.2", value, line, sizeof(line));
}

static void rounds(uint32_t session, unsigned int count)
{
	while (count--)
		wisher_round(&wisher, &values, client, session, refuse, NULL);
}

static int setup(void **state)
{
	(void)state;
	memset(&wisher, 0, sizeof(wisher));
	memset(&values, 0, sizeof(values));
	table_set_parameters(&values);
	daemon_report = (struct pokeys_report){
		.epoch = 5,
		.count = 1,
		.state = POKEYS_CONFIG_APPLIED,
	};
	attached = 0;
	sendings = 0;
	line[0] = '\0';
	return wish_init(&wisher.wish);
}

static void who_sets_nothing_sends_nothing(void **state)
{
	(void)state;
	rounds(7, 5);
	daemon_report.epoch++;
	rounds(8, 5);
	assert_int_equal(sendings, 0);
}

static void a_setting_is_sent_once(void **state)
{
	(void)state;
	rounds(7, 2);
	values.set.pin_function[0] = 4;
	rounds(7, 5);
	assert_int_equal(sendings, 1);
	assert_int_equal(sent.session, 7);
	assert_int_equal(sent.generation, 1);
	assert_int_equal(sent.settings.pin_function[0], 4);
	assert_int_equal(values.diagnostics.config_generation, 1);
}

static void another_daemon_and_another_session_are_told_again(void **state)
{
	(void)state;
	values.set.pin_function[0] = 4;
	rounds(7, 2);
	daemon_report.epoch = 6;
	daemon_report.state = POKEYS_CONFIG_UNKNOWN;
	rounds(7, 3);
	assert_int_equal(sendings, 2);
	rounds(8, 3);
	assert_int_equal(sendings, 3);
	assert_int_equal(sent.session, 8);
	assert_int_equal(sent.settings.pin_set[0], 1);
}

static void it_is_tried_until_it_succeeds(void **state)
{
	(void)state;
	rounds(7, 1);
	attached = -ENOTCONN;
	values.set.pin_function[0] = 4;
	rounds(7, 5);
	attached = 0;
	rounds(7, 5);
	assert_int_equal(sendings, 1);
}

static void what_the_device_refuses_is_shown(void **state)
{
	(void)state;
	daemon_report.refused = POKEYS_SETTING_AXIS;
	daemon_report.refused_index = 3;
	daemon_report.count = 9;
	rounds(7, 1);
	assert_int_equal(values.diagnostics.config_refused, POKEYS_SETTING_AXIS);
	assert_int_equal(values.diagnostics.config_refused_index, 3);
}

static void a_refusal_names_the_parameter_and_its_range(void **state)
{
	(void)state;
	rounds(7, 1);
	values.set.axis[3].homing_speed = 300;
	rounds(7, 1);
	assert_string_equal(line, "pokeys.2.joint.03.homing-speed = 300: must be 0 to 100; "
				  "the old value stays in use");
	values.set.axis[3].homing_speed = -1;
	values.set.encoder[1].sampling = 3;
	rounds(7, 1);
	assert_string_equal(line, "pokeys.2.encoder.01.sampling = 3: must be 0, 1, 2 or 4; "
				  "the old value stays in use");
}

static void the_daemons_lateness_is_shown_and_kept(void **state)
{
	const struct value_diagnostics *value = &values.diagnostics;
	struct pokeys_diag diag;

	(void)state;
	latency_round(&values, client, &diag);
	attached = -ENOTCONN;
	latency_round(&values, client, &diag);
	assert_true(value->wakeup.p99_us == 2 && value->wakeup.max_us == 9);
	assert_true(value->round_trip.p99_us == 300 && value->round_trip.max_us == 900);
	assert_true(value->data.p99_us == 400 && value->data.max_us == 800);
	assert_int_equal(value->cycles_skipped, 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(who_sets_nothing_sends_nothing, setup),
		cmocka_unit_test_setup(a_setting_is_sent_once, setup),
		cmocka_unit_test_setup(another_daemon_and_another_session_are_told_again, setup),
		cmocka_unit_test_setup(it_is_tried_until_it_succeeds, setup),
		cmocka_unit_test_setup(what_the_device_refuses_is_shown, setup),
		cmocka_unit_test_setup(a_refusal_names_the_parameter_and_its_range, setup),
		cmocka_unit_test_setup(the_daemons_lateness_is_shown_and_kept, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
