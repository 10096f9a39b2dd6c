// SPDX-License-Identifier: GPL-2.0-or-later
/* The status line and the metrics file, from made-up images. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/log.h"
#include "daemon/control/metrics.h"

static struct report report;
static struct metrics metrics;
static char folder[64], path[80], content[200000];

static int setup(void **state)
{
	struct report_device *device = &report.device[0];

	(void)state;
	memset(&report, 0, sizeof(report));
	report.now_ns = UINT64_C(5000000000);
	report.devices = 3;
	device->name = "mill";
	device->known = true;
	device->state.link = POKEYS_LINK_RUNNING;
	device->state.cycle = UINT64_C(12345678901234);
	device->state.t_digital_ns = report.now_ns - 1500000;
	device->state.statistics.missed = 21;
	device->state.statistics.late = 4;
	device->state.statistics.lost = 17;
	device->state.statistics.rtt_smoothed_ns = 212999;
	device->diag.round_trip.count = 2;
	device->diag.round_trip.sum_ns = 3000000;
	report.device[1].name = "lathe";
	report.device[1].known = true;
	report.device[1].state.link = POKEYS_LINK_LOST;
	report.device[1].state.fault = POKEYS_FAULT_NO_ANSWER;
	report.device[2].name = "router";
	strcpy(folder, "/tmp/pokeysd-report-XXXXXX");
	if (!mkdtemp(folder))
		return -1;
	snprintf(path, sizeof(path), "%s/metrics.prom", folder);
	metrics_init(&metrics, path, UINT64_C(1000000000), 7);
	log_open(-1, 0);
	return 0;
}

static int teardown(void **state)
{
	char beside[100];

	(void)state;
	snprintf(beside, sizeof(beside), "%s.new", path);
	unlink(path);
	rmdir(path);
	unlink(beside);
	rmdir(beside);
	return rmdir(folder);
}

static const char *read_file(void)
{
	FILE *file = fopen(path, "r");
	size_t length = file ? fread(content, 1, sizeof(content) - 1, file) : 0;

	content[length] = '\0';
	if (file)
		fclose(file);
	return content;
}

static void the_status_line_names_every_device(void **state)
{
	char text[256];

	(void)state;
	report_status(&report, text, sizeof(text));
	assert_string_equal(text, "mill running, 212 us; lathe lost: no answer; router not "
				  "published yet");
	report.device[0].state.flags = POKEYS_STATE_SAFE;
	report.devices = 1;
	report_status(&report, text, sizeof(text));
	assert_string_equal(text, "mill running (safe state), 212 us");
	report.device[0].state.servo[2].state = POKEYS_SERVO_ENABLED;
	report_status(&report, text, sizeof(text));
	assert_string_equal(text, "mill running (safe state), a motor on, 212 us");
	report.device[0].state.servo[2].state = POKEYS_SERVO_OFF;
	report.device[0].state.heater[1].target = 60;
	report_status(&report, text, sizeof(text));
	assert_string_equal(text, "mill running (safe state), a heater on, 212 us");
	report.device[0].state.flags = POKEYS_STATE_MACHINE_ON;
	report_status(&report, text, sizeof(text));
	assert_string_equal(text, "mill running, machine on, 212 us");
	report.device[0].state.heater[1].target = 0;
	report.device[0].state.flags = POKEYS_STATE_SAFE;
}

/* The longest names and faults, and of the last two devices, one is on. */
static void of_too_many_devices_the_status_line_names_the_one_that_is_on(void **state)
{
	static const char last[] = " more";
	char text[REPORT_STATUS_SIZE];
	size_t length;

	(void)state;
	report.devices = TRANSPORT_CHANNELS;
	for (uint32_t i = 0; i < report.devices; i++) {
		report.device[i].name = "a-device-of-the-longest-name-01";
		report.device[i].known = true;
		report.device[i].state.link = POKEYS_LINK_CONFIGURING;
		report.device[i].state.fault = POKEYS_FAULT_WRONG_SERIAL;
	}
	for (uint32_t i = report.devices - 2; i < report.devices; i++)
		report.device[i].state.link = POKEYS_LINK_RUNNING;
	report.device[report.devices - 1].name = "mill";
	report.device[report.devices - 1].state.flags = POKEYS_STATE_MACHINE_ON;
	length = report_status(&report, text, sizeof(text));
	assert_int_equal(length, strlen(text));
	assert_memory_equal(text, "mill running, machine on, ", 26);
	assert_string_equal(text + length - strlen(last), last);
	assert_null(strstr(text, "01 running"));
}

static void the_age_is_that_of_the_older_data(void **state)
{
	struct pokeys_state *mill = &report.device[0].state;

	(void)state;
	mill->capability.pulse_engine = 2;
	mill->t_motion_ns = report.now_ns - 40000000;
	assert_int_equal(metrics_write(&metrics, &report, 7), 0);
	read_file();
	assert_non_null(strstr(content, "pokeysd_data_age_seconds{device=\"mill\"} 0.040000000\n"));
	mill->t_motion_ns = report.now_ns + UINT64_C(3600000000000);
	assert_int_equal(metrics_write(&metrics, &report, 8), 0);
	read_file();
	assert_null(strstr(content, "pokeysd_data_age_seconds{device=\"mill\"}"));
}

/* Names and labels as Prometheus wants them, HELP and TYPE before the samples. */
static void metrics_are_in_prometheus_format(void **state)
{
	char *line, *rest, name[128] = "";
	int samples = 0;

	(void)state;
	assert_int_equal(metrics_write(&metrics, &report, 7), 0);
	read_file();
	assert_non_null(strstr(content, "pokeysd_cycles_total{device=\"mill\"} 12345678901234\n"));
	assert_non_null(strstr(content, "pokeysd_device_link{device=\"lathe\"} 4\n"));
	assert_non_null(strstr(content, "pokeysd_packets_missed_total{device=\"mill\"} 21\n"));
	assert_non_null(strstr(content, "pokeysd_packets_late_total{device=\"mill\"} 4\n"));
	assert_non_null(strstr(content, "pokeysd_packets_lost_total{device=\"mill\"} 17\n"));
	assert_non_null(strstr(content, "pokeysd_data_age_seconds{device=\"mill\"} 0.001500000\n"));
	assert_non_null(strstr(content, "pokeysd_round_trip_seconds_sum{device=\"mill\"} 0.003"));
	assert_null(strstr(content, "router"));
	for (line = strtok_r(content, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
		if (!strncmp(line, "# TYPE ", 7)) {
			assert_int_equal(sscanf(line, "# TYPE %127s", name), 1);
		} else if (*line != '#') {
			assert_int_equal(strncmp(line, name, strlen(name)), 0);
			assert_int_equal(strspn(line, "abcdefghijklmnopqrstuvwxyz_") > 8, 1);
			samples++;
		}
	}
	assert_true(samples > 60);
}

static void a_reader_sees_a_whole_file(void **state)
{
	struct stat before, after;

	(void)state;
	assert_int_equal(metrics_write(&metrics, &report, 7), 0);
	stat(path, &before);
	assert_int_equal(before.st_mode & 0777, 0644);
	assert_int_equal(metrics_write(&metrics, &report, 8), 0);
	stat(path, &after);
	assert_true(before.st_ino != after.st_ino);
}

static void a_failed_write_is_counted_and_leaves_the_old_file(void **state)
{
	char beside[100], old[200000];

	(void)state;
	assert_int_equal(metrics_write(&metrics, &report, 7), 0);
	strcpy(old, read_file());
	snprintf(beside, sizeof(beside), "%s.new", path);
	assert_int_equal(mkdir(beside, 0700), 0);
	assert_int_equal(metrics_write(&metrics, &report, 8), -EISDIR);
	assert_int_equal(metrics.failed, 1);
	assert_string_equal(read_file(), old);
	rmdir(beside);
	/* nobody lets us write through a link that he put there */
	assert_int_equal(symlink("/dev/null", beside), 0);
	assert_int_equal(metrics_write(&metrics, &report, 9), -ELOOP);
	assert_int_equal(metrics.failed, 2);
	assert_int_equal(metrics_write(&metrics, &report, 10), 0);
	assert_int_equal(metrics.last, 0);
}

static void a_full_disk_is_an_error_and_not_half_a_file(void **state)
{
	FILE *full = fopen("/dev/full", "w");

	(void)state;
	assert_non_null(full);
	assert_true(report_metrics(&report, full) < 0);
	fclose(full);
}

static void metrics_are_off_unless_asked_for(void **state)
{
	struct metrics off;

	(void)state;
	metrics_init(&off, "", 1000, 0);
	assert_false(metrics_due(&off, UINT64_MAX));
	assert_true(metrics_due(&metrics, 7));
	metrics_write(&metrics, &report, 7);
	assert_false(metrics_due(&metrics, 1000000006));
	assert_true(metrics_due(&metrics, 1000000007));
}

static void a_fifo_in_the_place_holds_nobody_up(void **state)
{
	char beside[100];
	struct stat status;
	int reader;

	(void)state;
	snprintf(beside, sizeof(beside), "%s.new", path);
	assert_int_equal(mkfifo(beside, 0600), 0);
	alarm(60); /* it did hold up */
	assert_int_equal(metrics_write(&metrics, &report, 1), -ENXIO);
	/* it is put away, and the next time there is a file */
	assert_int_equal(metrics_write(&metrics, &report, 2), 0);
	assert_int_equal(mkfifo(beside, 0600), 0);
	reader = open(beside, O_RDONLY | O_NONBLOCK);
	assert_int_equal(metrics_write(&metrics, &report, 3), -EEXIST);
	alarm(0);
	close(reader);
	assert_int_equal(stat(path, &status), 0);
	assert_true(S_ISREG(status.st_mode) && status.st_size > 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_status_line_names_every_device),
		TEST(of_too_many_devices_the_status_line_names_the_one_that_is_on),
		TEST(the_age_is_that_of_the_older_data),
		TEST(metrics_are_in_prometheus_format),
		TEST(a_reader_sees_a_whole_file),
		TEST(a_failed_write_is_counted_and_leaves_the_old_file),
		TEST(a_full_disk_is_an_error_and_not_half_a_file),
		TEST(metrics_are_off_unless_asked_for),
		TEST(a_fifo_in_the_place_holds_nobody_up),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
