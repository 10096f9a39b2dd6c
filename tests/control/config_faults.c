// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What somebody gets to read who made a mistake: file, line, section, key,
 * what was given, what is allowed; every mistake of a file at once; and a
 * configuration that is accepted whole or not at all.
 */
#include "tests/control/faults.h"

static void a_fault_names_line_section_key_and_range(void **state)
{
	(void)state;
	assert_fault("[daemon]\n\nperiod-us = 100\n" GOOD,
		     "f:3: [daemon]: period-us: \"100\" is out of range; allowed: 250..4000 us");
	assert_fault("[daemon]\nmode = fast\n" GOOD,
		     "f:2: [daemon]: mode: \"fast\" is not allowed; allowed: auto | sleep | napi | "
		     "spin");
	assert_fault("[daemon]\ncpu =\n" GOOD,
		     "f:2: [daemon]: cpu has no value; allowed: any | 0..1023");
	assert_fault(GOOD "port = 65536",
		     "f:3: [device a]: port: \"65536\" is out of range; allowed: 1..65535");
	assert_fault("[device a]\naddress = 10.0.0\n",
		     "f:2: [device a]: address: \"10.0.0\" is not an IPv4 address; allowed: an "
		     "IPv4 address such as 192.168.1.20");
	assert_fault("[device a]\naddress = 10.0.0.1:20055\n",
		     "f:2: [device a]: address: \"10.0.0.1:20055\" is not an IPv4 address; a "
		     "port is set with the key port; allowed: an IPv4 address such as "
		     "192.168.1.20");
	assert_fault(GOOD "digital-inputs = 1-4,56\n",
		     "f:3: [device a]: digital-inputs: \"1-4,56\" names a pin that is out of "
		     "range; allowed: pins 1..55 as a list such as 1-3,5");
	assert_fault(GOOD "safe-on = 5, 1-9\n",
		     "f:3: [device a]: safe-on: \"5, 1-9\" names a pin twice; allowed: pins 1..55 "
		     "as a list such as 1-3,5");
	assert_fault("[daemon]\ntransport = xdp\n" GOOD,
		     "f:2: [daemon]: transport = xdp belongs to one interface; interface is not "
		     "given");
	assert_fault("[daemon]\nbusy-poll-us = 0\nmode = napi\n" GOOD,
		     "f:3: [daemon]: mode = napi polls for busy-poll-us, which is 0");
	assert_fault("[daemon]\nduty = 0.95\n" GOOD,
		     "f:2: [daemon]: duty: \"0.95\" is out of range; allowed: 0.1..0.9, or 1");
}

static void an_unknown_key_is_named_with_the_one_meant(void **state)
{
	(void)state;
	assert_fault("[daemon]\nperid-us = 500\n" GOOD,
		     "f:2: [daemon]: there is no key perid-us; did you mean period-us?");
	assert_fault(GOOD "axis.3.max-sped = 500\n",
		     "f:3: [device a]: there is no key axis.3.max-sped; did you mean "
		     "axis.#.max-speed?");
	assert_fault(GOOD "axis.1.acceleration = 500\n",
		     "f:3: [device a]: there is no key axis.1.acceleration; did you mean "
		     "axis.#.max-acceleration or axis.#.backlash-acceleration?");
	assert_fault(GOOD "AXES = 3\n",
		     "f:3: [device a]: there is no key AXES; did you mean axes?");
	assert_fault(GOOD "axis.0.scale = 200\n",
		     "f:3: [device a]: there is no key axis.0.scale; the scale is set in "
		     "LinuxCNC: SCALE in its INI file, pokeys.N.joint.NN.scale in HAL");
	assert_fault(GOOD "colour = blue\n",
		     "f:3: [device a]: there is no key colour; pokeysd --help-config lists all "
		     "keys");
	assert_fault(GOOD "priority = 3\n", "f:3: [device a]: priority belongs in [daemon]");
	assert_fault("[daemon]\nserial = 3\n" GOOD,
		     "f:2: [daemon]: serial belongs in a [device NAME] section");
}

static void sections_are_judged_even_when_empty(void **state)
{
	(void)state;
	assert_fault("[devices]\n" GOOD, "f:1: there is no section [devices]; sections are "
					 "[daemon], [device NAME], [heater NAME] and [servo NAME]");
	assert_fault(GOOD "[device b]\n", "f:3: [device b]: neither address nor serial is given; "
					  "one of them says where the device is");
	assert_fault(GOOD "[device]\n",
		     "f:3: there is no section [device]; sections are [daemon], [device NAME], "
		     "[heater NAME] and [servo NAME]");
	assert_fault(GOOD "[device a b]\nserial=4\n",
		     "f:3: [device a b]: a device's name has 1 to 31 of the characters A-Z a-z 0-9 "
		     "_ -");
	assert_fault(GOOD "[device abcdefghijklmnopqrstuvwxyz012345]\n",
		     "f:3: [device abcdefghijklmnopqrstuvwxyz012345]: a device's name has 1 to 31 "
		     "of the characters A-Z a-z 0-9 _ -");
	assert_fault(GOOD "[device b] x\nserial=4\n",
		     "f:3: \"[device b] x\" is not a section; [daemon], "
		     "[device NAME], [heater NAME] and [servo NAME] are");
	assert_fault(GOOD "[daemon\n", "f:3: \"[daemon\" is not a section; [daemon], "
				       "[device NAME], [heater NAME] and [servo NAME] are");
	assert_fault(GOOD GOOD, "f:3: [device a] was there before, at line 1");
	assert_fault("[daemon]\n" GOOD "[daemon]\n", "f:4: [daemon] was there before, at line 1");
	assert_fault("", "f: there is no [device NAME] section; add one with the line address = "
			 "A.B.C.D or serial = NUMBER (pokeysctl discover --config writes them)");
	assert_fault("port = 3\n" GOOD,
		     "f:1: port stands before any section; [daemon] or [device NAME] comes first");
}

/* Commands for one device would be heard by all, and answered by none that counts. */
static void an_address_of_many_is_no_devices(void **state)
{
	static const char *const many[] = { "255.255.255.255", "224.0.0.1", "239.1.2.3" };
	char text[128], expected[160];

	(void)state;
	for (size_t i = 0; i < sizeof(many) / sizeof(many[0]); i++) {
		snprintf(text, sizeof(text), "[device a]\naddress = %s\n", many[i]);
		snprintf(expected, sizeof(expected),
			 "f:2: [device a]: address: \"%s\" is no "
			 "device's address; allowed: an IPv4 address such as 192.168.1.20",
			 many[i]);
		assert_fault(text, expected);
	}
	assert_int_equal(parse("[daemon]\ndiscovery-address = 255.255.255.255\n"
			       "[device a]\naddress = 223.255.255.255\n"),
			 0);
}

/* Sockets have names of at most 107 characters, and theirs are below it. */
static void a_runtime_folder_too_deep_for_its_sockets_is_a_fault(void **state)
{
	char text[256];

	(void)state;
	snprintf(text, sizeof(text), "[daemon]\nruntime-directory = /%048d\n" GOOD, 0);
	assert_int_equal(parse(text), 0);
	snprintf(text, sizeof(text), "[daemon]\nruntime-directory = /%049d\n" GOOD, 0);
	assert_int_equal(parse(text), 1);
	assert_non_null(strstr(heard.line[0], "is too long; allowed: a path from / of at most 49"));
}

static void lines_that_the_library_would_swallow_are_told(void **state)
{
	char text[512];

	(void)state;
	assert_fault(GOOD "port\n", "f:3: \"port\" is neither [section] nor key = value");
	assert_fault(GOOD "= 5\n", "f:3: there is no key before the \"=\"");
	assert_fault(GOOD "po\x01rt = 5\n", "f:3: there is a control character in the line");
	snprintf(text, sizeof(text), "%sgroup = %0190d\n", GOOD, 1);
	assert_fault(text, "f:3: the line is too long, at most 197 characters are allowed");
	/* the end of an overlong line is not a line of its own */
	snprintf(text, sizeof(text), "%sgroup = %0191dport = 5\n", GOOD, 1);
	assert_fault(text, "f:3: the line is too long, at most 197 characters are allowed");
	/* an indented line does not continue the one above */
	assert_int_equal(parse("[daemon]\n\tperiod-us = 500\n\t  priority = 7\n" GOOD), 0);
	assert_int_equal(config.priority, 7);
	assert_int_equal(config.loop.period_ns, 500000);
}

static void comments_blanks_and_editors_marks_do_no_harm(void **state)
{
	(void)state;
	assert_int_equal(parse("\xef\xbb\xbf# first\r\n; second\r\n[daemon] ; third\r\n\r\n"
			       "  priority\t=  7 # of 98\r\n[device a];x\r\naddress = 10.0.0.1 ; "
			       "here\r\n"
			       "   \t\r\nport=1\r\n#"),
			 1);
	assert_string_equal(heard.line[0], "f:6: \"[device a];x\" is not a section; [daemon], "
					   "[device NAME], [heater NAME] and [servo NAME] are");
	assert_int_equal(parse("\xef\xbb\xbf# first\r\n; second\r\n[daemon] ; third\r\n\r\n"
			       "  priority\t=  7 # of 98\r\n[device a] ;x\r\naddress = 10.0.0.1 ; "
			       "here\r\n"
			       "   \t\r\nport=1\r\n#"),
			 0);
	assert_int_equal(config.priority, 7);
	assert_int_equal(config.device[0].port, 1);
}

static void all_faults_are_told_at_once(void **state)
{
	(void)state;
	assert_int_equal(parse("[daemon]\nmode = x\ncpu = y\n[device a]\nport = 0\nwindow = 0\n"),
			 5);
	assert_non_null(strstr(heard.line[0], "f:2: "));
	assert_non_null(strstr(heard.line[1], "f:3: "));
	assert_non_null(strstr(heard.line[2], "f:5: "));
	assert_non_null(strstr(heard.line[3], "f:6: "));
	assert_non_null(strstr(heard.line[4], "neither address nor serial"));
}

static void a_file_of_faults_is_cut_short(void **state)
{
	char text[4096] = "[daemon]\n";

	(void)state;
	for (int i = 0; i < 200; i++)
		strcat(text, "what is this\n");
	assert_true(parse(text) >= 200);
	assert_int_equal(heard.count, CONFIG_FAULTS_MAX + 1);
	assert_non_null(strstr(heard.line[CONFIG_FAULTS_MAX], "too many faults"));
}

static void values_that_are_wrong_together_are_a_fault(void **state)
{
	(void)state;
	assert_fault("[daemon]\nperiod-us = 4000\n" GOOD "fast-divider = 3\n",
		     "f:3: [device a]: stale-after-ms = 8 has to be longer than the time between "
		     "two samples, which is 12 ms (period-us times fast-divider)");
	assert_fault(GOOD "lost-after-ms = 8\n",
		     "f:3: [device a]: lost-after-ms = 8 has to be longer than stale-after-ms, "
		     "which is 8");
	assert_fault(GOOD "slow = together\nwindow = 8\n",
		     "f:4: [device a]: window = 8 is too small for slow = together, which needs 20 "
		     "or more");
	assert_fault(GOOD "deadline-floor-us = 60000\n",
		     "f:1: [device a]: deadline-ceiling-ms = 50 must not be shorter than "
		     "deadline-floor-us, which is 60000 us");
	assert_fault(GOOD "axis.1.backlash-width = 13\nbacklash = on\n",
		     "f:3: [device a]: axis.1.backlash-width: \"13\" is between two steps; "
		     "allowed: leave | 0..131070 pulses");
	assert_fault(GOOD "axis.1.backlash-acceleration = 256000000\n",
		     "f:3: [device a]: axis.1.backlash-acceleration: \"256000000\" is out of "
		     "range; allowed: leave | 0..255000000 pulses/s^2");
	assert_fault(GOOD "axis.1.backlash-width = 12\n",
		     "f:3: [device a]: axis.1.backlash-width needs backlash = on (or off, if that "
		     "is meant)");
	assert_fault(GOOD "axis.7.postep-microsteps = 16\n",
		     "f:3: [device a]: axis.7.postep-microsteps needs postep = on (or off, if that "
		     "is meant)");
	assert_fault(GOOD "postep = on\naxis.7.postep-microsteps = 12\n",
		     "f:4: [device a]: axis.7.postep-microsteps: \"12\" is not allowed; allowed: "
		     "leave | 1 | 2 | 4 | 8 | 16 | 32 | 64 | 128 | 256");
	assert_fault(GOOD "synced-pwm-channel = 6\n",
		     "f:3: [device a]: synced-pwm-channel: \"6\" is out of range; allowed: leave | "
		     "0..5");
	assert_fault(GOOD "synced-pwm = on\nsynced-pwm-axis = 2\naxis.2.mode = position\n",
		     "f:4: [device a]: synced-pwm-axis = 2: axis.2.mode has to be buffered");
	assert_fault(GOOD "synced-outputs-pins = 1,0,56\n",
		     "f:3: [device a]: synced-outputs-pins: 56 is neither a terminal (1-55) nor an "
		     "external output (92-99)");
	assert_fault(GOOD "threading-mode = turns\n",
		     "f:3: [device a]: threading-mode: \"turns\" is not allowed; allowed: leave | "
		     "index | encoder | fast-index | fast-encoder");
	assert_fault(GOOD "threading-mode = index\nthreading-rpm = 600\nthreading-speed-gain = 5\n",
		     "f:5: [device a]: threading-speed-gain needs threading-position-gain as well");
	assert_fault(GOOD "threading-mode = encoder\nthreading-rpm = 600\nthreading-speed-gain = "
			  "5\n"
			  "threading-position-gain = 6\n",
		     "f:6: [device a]: threading-position-gain needs threading-ticks as well");
	assert_fault(GOOD "threading-ignore-axes = 4\n",
		     "f:3: [device a]: threading-ignore-axes needs threading-mode as well");
	assert_fault(GOOD "axis.1.soft-limits = on\naxis.1.soft-minimum = 4\n",
		     "f:3: [device a]: axis.1.soft-limits = on needs axis.1.soft-minimum and "
		     "axis.1.soft-maximum");
	assert_fault(GOOD "axis.1.soft-limits = on\naxis.1.soft-minimum = "
			  "4\naxis.1.soft-maximum=4\n",
		     "f:5: [device a]: axis.1.soft-maximum has to be above axis.1.soft-minimum");
}

static void the_internal_generator_has_three_slow_axes(void **state)
{
	(void)state;
	assert_fault(GOOD "generator = internal\naxes = 4\n",
		     "f:4: [device a]: axes = 4: generator = internal has 3");
	assert_fault(GOOD "axis.2.max-speed = 25001\ngenerator = internal\n",
		     "f:3: [device a]: axis.2.max-speed = 25001 is above the 25000 pulses/s of "
		     "generator = internal");
	assert_int_equal(parse(GOOD "axes = 3\naxis.2.max-speed = 25000\n"
				    "generator = internal\n"),
			 0);
	assert_int_equal(parse(GOOD "axes = 8\naxis.7.max-speed = 125000\n"
				    "generator = external\n"),
			 0);
}

static void two_sections_for_one_device_are_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "[device b]\naddress = 10.0.0.1\n",
		     "f:4: [device b]: address: [device a] has the same one, and the same port");
	assert_fault("[device a]\nserial = 5\n[device b]\nserial = 5\n",
		     "f:4: [device b]: serial: [device a] has the same one");
	assert_int_equal(parse(GOOD "[device b]\naddress = 10.0.0.1\nport = 5\n"), 0);
}

static void sixty_four_devices_are_allowed_and_no_more(void **state)
{
	char text[4096] = "";

	(void)state;
	for (int i = 0; i < TRANSPORT_CHANNELS; i++)
		sprintf(text + strlen(text), "[device d%d]\nserial = %d\n", i, i + 1);
	assert_int_equal(parse(text), 0);
	assert_int_equal(config.devices, TRANSPORT_CHANNELS);
	for (uint8_t i = 0; i < TRANSPORT_CHANNELS; i++)
		assert_int_equal(config.device[i].index, i);
	strcat(text, "[device more]\nserial = 99\n");
	assert_fault(text, "f:129: [device more]: too many devices, at most 64 are allowed");
}

static void nothing_is_accepted_from_a_file_with_a_fault(void **state)
{
	(void)state;
	memset(&config, 0xa5, sizeof(config));
	assert_int_equal(parse("[daemon]\npriority = 3\nperiod-us = 1\n" GOOD), 1);
	for (size_t i = 0; i < sizeof(config); i++)
		assert_int_equal(((unsigned char *)&config)[i], 0xa5);
}

static void an_axis_that_is_not_driven_is_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "axes = 3\naxis.5.max-speed = 100\n",
		     "f:4: [device a]: axis.5.max-speed: there is no axis 5 with axes = 3 (they "
		     "are numbered from 0)");
	assert_int_equal(parse(GOOD "axes = 3\naxis.2.max-speed = 100\n"), 0);
	assert_int_equal(parse(GOOD "axis.5.max-speed = 100\n"), 0);
}

static void a_safe_value_of_what_is_no_output_is_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "digital-outputs = 31-37\nsafe-on = 38\n",
		     "f:4: [device a]: safe-on: pin 38 is not in digital-outputs");
	assert_fault(GOOD "digital-outputs = 31-37\nsafe-hold = 31,38\n",
		     "f:4: [device a]: safe-hold: pin 38 is not in digital-outputs");
	assert_fault(GOOD "digital-outputs = 31-37\nresume-outputs = 38, pwm\n",
		     "f:4: [device a]: resume-outputs: pin 38 is not in digital-outputs");
	/* the device's own outputs, which this file does not list */
	assert_int_equal(parse(GOOD "safe-on = 38\n"), 0);
}

static void one_mistake_is_told_once(void **state)
{
	(void)state;
	assert_fault("[device a]\nserial = 12x\n",
		     "f:2: [device a]: serial: \"12x\" is not allowed; allowed: any | "
		     "1..4294967295");
	assert_fault("[device a]\nserial = any\n",
		     "f:1: [device a]: neither address nor serial is given; one of them says where "
		     "the device is");
}

/* A file that is good elsewhere; the faults that it has on this machine. */
static int check_here(const char *text)
{
	char path[] = "/tmp/pokeysd-config-XXXXXX";
	int fd = mkstemp(path), faults;

	assert_int_equal(write(fd, text, strlen(text)), strlen(text));
	close(fd);
	memset(&heard, 0, sizeof(heard));
	assert_int_equal(config_read(path, &config, hear, &heard), 0);
	faults = config_check(path, &config, hear, &heard);
	unlink(path);
	return faults;
}

static void check_tells_what_is_not_on_this_machine_with_its_line(void **state)
{
	(void)state;
	assert_int_equal(check_here("[daemon]\ngroup = no-such-group\ninterface = nosuch0\n"
				    "cpu = 1023\n" GOOD),
			 3);
	assert_non_null(strstr(heard.line[0], ":2: [daemon]: group: there is no group"));
	assert_non_null(strstr(heard.line[1], ":3: [daemon]: interface: there is no network"));
	assert_non_null(strstr(heard.line[2], ":4: [daemon]: cpu: \"1023\" is not on this"));
}

static void check_notes_a_switch_that_is_not_used(void **state)
{
	(void)state;
	assert_int_equal(check_here(GOOD "axis.0.home-pin = 5\naxis.0.home-invert = on\n"
					 "axis.1.limit-plus-filter = 3\n"),
			 0);
	assert_int_equal(heard.count, 2);
	assert_non_null(strstr(heard.line[0],
			       ":3: [device a]: axis.0.home-pin: the switch is used "
			       "only with axis.0.home = on, which is not given (off, if that is "
			       "meant)"));
	assert_non_null(strstr(heard.line[1], ":5: [device a]: axis.1.limit-plus-filter: the "));
	assert_int_equal(check_here(GOOD "axis.0.home-pin = 5\naxis.0.home = off\n"
					 "axis.1.limit-plus-pin = 3\naxis.1.limit-plus = on\n"),
			 0);
	assert_int_equal(heard.count, 0);
}

/* The daemon would take none of these. */
static void check_tells_of_a_number_that_is_no_groups(void **state)
{
	(void)state;
	assert_int_equal(check_here("[daemon]\ngroup = 12345\n" GOOD), 0);
	assert_int_equal(check_here("[daemon]\ngroup = 4294967295\n" GOOD), 1);
	assert_int_equal(check_here("[daemon]\ngroup = 4294967296\n" GOOD), 1);
	assert_int_equal(check_here("[daemon]\ngroup = 99999999999999999999\n" GOOD), 1);
}

static void a_file_that_cannot_be_read_is_one_clear_line(void **state)
{
	char path[] = "/tmp/pokeysd-config-XXXXXX", expected[128];
	static char large[300000];
	FILE *file;
	int fd;

	(void)state;
	memset(&heard, 0, sizeof(heard));
	assert_int_equal(config_read("/nonexistent/pokeysd.conf", &config, hear, &heard), 1);
	assert_string_equal(heard.line[0], "/nonexistent/pokeysd.conf: there is no such file; "
					   "pokeysd.conf(5) says what to write into it");
	memset(&heard, 0, sizeof(heard));
	assert_int_equal(config_read("/", &config, hear, &heard), 1);
	assert_string_equal(heard.line[0], "/: cannot be read: Is a directory");
	fd = mkstemp(path);
	assert_true(fd >= 0);
	file = fdopen(fd, "w");
	memset(large, '\n', sizeof(large));
	fwrite(large, 1, sizeof(large), file);
	fclose(file);
	memset(&heard, 0, sizeof(heard));
	assert_int_equal(config_read(path, &config, hear, &heard), 1);
	snprintf(expected, sizeof(expected), "%s: is too large, at most 262143 bytes are allowed",
		 path);
	assert_string_equal(heard.line[0], expected);
	unlink(path);
}

static void a_fifo_is_refused_without_waiting(void **state)
{
	char path[] = "/tmp/pokeysd-config-XXXXXX";
	int fd = mkstemp(path);

	(void)state;
	close(fd);
	unlink(path);
	assert_int_equal(mkfifo(path, 0600), 0);
	memset(&heard, 0, sizeof(heard));
	alarm(60); /* it did wait */
	assert_int_equal(config_read(path, &config, hear, &heard), 1);
	alarm(0);
	unlink(path);
	assert_non_null(strstr(heard.line[0], ": is not a file;"));
}

static void a_complaint_is_safe_on_a_terminal(void **state)
{
	(void)state;
	parse(GOOD "group\xff\x9b[2J = 3\n[device \xc3\xa4]\n");
	assert_true(heard.count >= 2);
	for (int i = 0; i < heard.count; i++)
		for (const char *c = heard.line[i]; *c; c++)
			assert_in_range(*c, 0x20, 0x7e);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_fault_names_line_section_key_and_range),
		cmocka_unit_test(an_unknown_key_is_named_with_the_one_meant),
		cmocka_unit_test(sections_are_judged_even_when_empty),
		cmocka_unit_test(an_address_of_many_is_no_devices),
		cmocka_unit_test(a_runtime_folder_too_deep_for_its_sockets_is_a_fault),
		cmocka_unit_test(lines_that_the_library_would_swallow_are_told),
		cmocka_unit_test(comments_blanks_and_editors_marks_do_no_harm),
		cmocka_unit_test(all_faults_are_told_at_once),
		cmocka_unit_test(a_file_of_faults_is_cut_short),
		cmocka_unit_test(values_that_are_wrong_together_are_a_fault),
		cmocka_unit_test(the_internal_generator_has_three_slow_axes),
		cmocka_unit_test(two_sections_for_one_device_are_a_fault),
		cmocka_unit_test(sixty_four_devices_are_allowed_and_no_more),
		cmocka_unit_test(nothing_is_accepted_from_a_file_with_a_fault),
		cmocka_unit_test(an_axis_that_is_not_driven_is_a_fault),
		cmocka_unit_test(a_safe_value_of_what_is_no_output_is_a_fault),
		cmocka_unit_test(one_mistake_is_told_once),
		cmocka_unit_test(check_tells_what_is_not_on_this_machine_with_its_line),
		cmocka_unit_test(check_notes_a_switch_that_is_not_used),
		cmocka_unit_test(check_tells_of_a_number_that_is_no_groups),
		cmocka_unit_test(a_file_that_cannot_be_read_is_one_clear_line),
		cmocka_unit_test(a_fifo_is_refused_without_waiting),
		cmocka_unit_test(a_complaint_is_safe_on_a_terminal),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
