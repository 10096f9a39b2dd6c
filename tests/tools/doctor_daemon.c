// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What doctor makes of a daemon's images, and of lists and lines as the kernel
 * writes them: parts that a made-up tree of files cannot reach. An image may
 * come from a foreign writer, so its texts are hostile here.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>
#include "tools/doctor.h"

static struct doctor doctor;
static struct doctor_report report;

static struct view_device *good(void)
{
	struct view_device *seen = &doctor.view.device[0];

	memset(&doctor, 0, sizeof(doctor));
	doctor.root = "/nowhere";
	doctor.cpu = -1;
	doctor.view.count = 1;
	strcpy(seen->name, "mill");
	seen->freshness = VIEW_FRESH;
	seen->has_diag = true;
	seen->state.flags = POKEYS_STATE_REALTIME;
	seen->diag.cycle = 100000;
	strcpy(seen->diag.transport, "io_uring");
	return seen;
}

static const struct doctor_finding *find(const char *check)
{
	doctor_judge(&doctor, &report);
	for (size_t i = 0; i < report.count; i++)
		if (!strcmp(report.finding[i].check, check))
			return &report.finding[i];
	fail_msg("no finding %s", check);
	return NULL;
}

static void expect(const char *check, enum doctor_verdict verdict)
{
	assert_string_equal(doctor_verdict_name(find(check)->verdict),
			    doctor_verdict_name(verdict));
	assert_true(*find(check)->why);
}

static void a_good_daemon_is_in_order(void **state)
{
	(void)state;
	good();
	expect("daemon", DOCTOR_OK);
	expect("daemon-realtime", DOCTOR_OK);
	expect("daemon-transport", DOCTOR_OK);
	expect("daemon-faults", DOCTOR_OK);
	expect("daemon-cycles", DOCTOR_OK);
	assert_string_equal(find("daemon")->subject, "mill");
}

static void what_the_daemon_lacks_is_said(void **state)
{
	struct view_device *seen = good();

	(void)state;
	seen->state.flags = POKEYS_STATE_FALLBACK;
	expect("daemon-realtime", DOCTOR_PROBLEM);
	expect("daemon-transport", DOCTOR_ADVICE);
	seen->diag.minor_faults = 1;
	expect("daemon-faults", DOCTOR_ADVICE);
	seen->diag.major_faults = 1;
	expect("daemon-faults", DOCTOR_PROBLEM);
	seen->freshness = VIEW_DEAD;
	strcpy(seen->why, "gone");
	expect("daemon", DOCTOR_PROBLEM);
}

static void one_cycle_in_ten_thousand_is_too_many(void **state)
{
	struct view_device *seen = good();

	(void)state;
	seen->diag.cycles_skipped = 10;
	expect("daemon-cycles", DOCTOR_ADVICE);
	seen->diag.cycles_skipped = 11;
	expect("daemon-cycles", DOCTOR_PROBLEM);
	seen->diag.cycle = 0;
	seen->diag.cycles_skipped = UINT64_MAX;
	expect("daemon-cycles", DOCTOR_PROBLEM);
}

static void an_image_that_was_not_read_is_unknown(void **state)
{
	struct view_device *seen = good();

	(void)state;
	seen->has_diag = false;
	expect("daemon-cycles", DOCTOR_UNKNOWN);
	seen->freshness = VIEW_NONE;
	strcpy(seen->why, "no right");
	expect("daemon-realtime", DOCTOR_UNKNOWN);
	doctor.view.count = 0;
	expect("daemon", DOCTOR_UNKNOWN);
}

static void a_hostile_transport_is_printed_clean(void **state)
{
	struct view_device *seen = good();

	(void)state;
	memset(seen->diag.transport, 0x1b, sizeof(seen->diag.transport));
	assert_null(strchr(find("daemon-transport")->why, 0x1b));
}

static void more_devices_than_room_for_findings_are_no_harm(void **state)
{
	(void)state;
	good();
	doctor.view.count = VIEW_DEVICES;
	doctor.devices = DOCTOR_DEVICES;
	for (size_t i = 0; i < DOCTOR_DEVICES; i++) {
		doctor.device[i].address = 1;
		snprintf(doctor.device[i].nic, sizeof(doctor.device[i].nic), "n%zu", i);
	}
	doctor_judge(&doctor, &report);
	assert_true(report.count <= DOCTOR_FINDINGS);
	assert_true(report.count > 200);
}

static void lists_of_cores_are_understood(void **state)
{
	(void)state;
	assert_true(probe_list_has("0-2,5", 0) && probe_list_has("0-2,5", 2));
	assert_true(probe_list_has("0-2,5", 5));
	assert_false(probe_list_has("0-2,5", 3));
	assert_false(probe_list_has("", 0) || probe_list_has("(null)", 0));
	assert_false(probe_list_has("-", 0));
	assert_int_equal(probe_list_other("3", 3), -1);
	assert_int_equal(probe_list_other("3-4", 3), 4);
	assert_int_equal(probe_list_other("3,9", 3), 9);
	assert_int_equal(probe_list_other("0-3", 3), 0);
}

static void a_line_is_found_by_its_beginning_only(void **state)
{
	char value[16];

	(void)state;
	assert_true(probe_line("a b: 1\nb: 2\nc", "b", value, sizeof(value)));
	assert_string_equal(value, "2");
	assert_false(probe_line("a b: 1", "b", value, sizeof(value)));
	assert_false(probe_line("", "b", value, sizeof(value)));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_good_daemon_is_in_order),
		cmocka_unit_test(what_the_daemon_lacks_is_said),
		cmocka_unit_test(one_cycle_in_ten_thousand_is_too_many),
		cmocka_unit_test(an_image_that_was_not_read_is_unknown),
		cmocka_unit_test(a_hostile_transport_is_printed_clean),
		cmocka_unit_test(more_devices_than_room_for_findings_are_no_harm),
		cmocka_unit_test(lists_of_cores_are_understood),
		cmocka_unit_test(a_line_is_found_by_its_beginning_only),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
