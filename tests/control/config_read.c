// SPDX-License-Identifier: GPL-2.0-or-later
/* Files in the folder beside pokeysd.conf: which are read, in what order, what they may change. */
#include <errno.h>
#include "tests/control/faults.h"

enum { PATH = 128 };

static char folder[] = "/tmp/pokeysd-config-XXXXXX", base[PATH], beside[PATH + 2];

static void put(const char *path, const char *text)
{
	FILE *to = fopen(path, "w");

	assert_non_null(to);
	assert_true(fputs(text, to) >= 0);
	assert_int_equal(fclose(to), 0);
}

static void put_beside(const char *name, const char *text)
{
	char path[2 * PATH];

	snprintf(path, sizeof(path), "%s/%s", beside, name);
	put(path, text);
}

static int set_up(void **state)
{
	(void)state;
	strcpy(strrchr(folder, '-'), "-XXXXXX");
	assert_non_null(mkdtemp(folder));
	snprintf(base, sizeof(base), "%s/mill.conf", folder);
	snprintf(beside, sizeof(beside), "%s.d", base);
	assert_int_equal(mkdir(beside, 0700), 0);
	put(base, "[daemon]\ncpu = 1\npriority = 70\n" GOOD);
	memset(&heard, 0, sizeof(heard));
	return 0;
}

static int tear_down(void **state)
{
	char command[2 * PATH];

	(void)state;
	snprintf(command, sizeof(command), "rm -rf '%s'", folder);
	return system(command);
}

static void assert_read(void)
{
	if (config_read(base, &config, hear, &heard))
		fail_msg("%s", heard.line[0]);
}

/* One fault, which reads so behind the folder's name. */
static void assert_refused(const char *expected)
{
	const int faults = config_read(base, &config, hear, &heard);

	if (faults != 1 || strncmp(heard.line[0], base, strlen(base)) != 0 ||
	    strcmp(heard.line[0] + strlen(base), expected) != 0)
		fail_msg("%d faults, the first: %s", faults, faults ? heard.line[0] : "none");
}

static void the_last_file_counts_for_the_daemon(void **state)
{
	(void)state;
	put_beside("20-cpu.conf", "[daemon]\ncpu = 3\n");
	put_beside("10-cpu.conf", "# first\n[daemon]\ncpu = 2\nduty = 0.5\n");
	assert_read();
	assert_int_equal(config.cpu, 3);
	assert_true(config.loop.duty == 0.5);
	assert_int_equal(config.priority, 70);
}

static void a_file_may_have_a_daemon_section_of_its_own_and_a_device(void **state)
{
	(void)state;
	put(base, GOOD);
	put_beside("a.conf", "[daemon]\ncpu = 2\n[device b]\naddress = 10.0.0.2\n");
	put_beside("b.conf", "[device b]\nport = 5\n[device a]\nport = 6\n");
	assert_read();
	assert_int_equal(config.cpu, 2);
	assert_int_equal(config.devices, 2);
	assert_int_equal(config.device[0].port, 6);
	assert_int_equal(config.device[1].port, 5);
}

static void only_files_that_end_in_conf_are_read(void **state)
{
	(void)state;
	put_beside("a.conf~", "nonsense\n");
	put_beside("a.conf.dpkg-old", "nonsense\n");
	put_beside(".a.conf", "nonsense\n");
	put_beside(".conf", "nonsense\n");
	put_beside("README", "nonsense\n");
	assert_read();
	assert_int_equal(config.cpu, 1);
}

static void without_the_folder_nothing_is_missing(void **state)
{
	(void)state;
	assert_int_equal(rmdir(beside), 0);
	assert_read();
}

static void a_fault_names_its_own_file_and_line(void **state)
{
	(void)state;
	put_beside("a.conf", "[daemon]\n\ncpu = two\n");
	assert_refused(".d/a.conf:3: [daemon]: cpu: \"two\" is not allowed; allowed: any | "
		       "0..1023");
}

/* Of rules that concern several keys, the place of the key that is named. */
static void a_fault_of_several_keys_names_the_place_of_its_key(void **state)
{
	(void)state;
	put_beside("a.conf", "[daemon]\ntransport = xdp\n");
	assert_refused(".d/a.conf:2: [daemon]: transport = xdp belongs to one interface; "
		       "interface is not given");
}

static void a_device_has_each_key_once_in_all_files(void **state)
{
	char expected[4 * PATH];

	(void)state;
	put(base, GOOD "digital-inputs = 1-4\n");
	put_beside("a.conf", "[device a]\ndigital-inputs = 5\n");
	snprintf(expected, sizeof(expected),
		 ".d/a.conf:2: [device a]: digital-inputs was there "
		 "before, at %s:3",
		 base);
	assert_refused(expected);
}

static void a_section_appears_once_in_a_file(void **state)
{
	(void)state;
	put_beside("a.conf", "[daemon]\n[device a]\n[daemon]\n");
	assert_refused(".d/a.conf:3: [daemon] was there before, at line 1");
	memset(&heard, 0, sizeof(heard));
	put_beside("a.conf", "[device a]\nport = 1\n\n[device a]\n");
	assert_refused(".d/a.conf:4: [device a] was there before, at line 1");
}

static void a_shared_terminal_is_reported_with_both_files(void **state)
{
	char *wrong;

	(void)state;
	put(base, GOOD "digital-outputs = 9\n");
	put_beside("a.conf", "[device a]\nencoder.0.pins = 9,10\n");
	assert_int_equal(config_read(base, &config, hear, &heard), 1);
	wrong = heard.line[0] + strlen(base);
	assert_non_null(strstr(wrong, ".d/a.conf:2: [device a]: encoder.0.pins"));
	assert_non_null(strstr(wrong, "digital-outputs (/tmp/pokeysd-config-"));
	assert_non_null(strstr(wrong, "/mill.conf:3)"));
}

static void two_motors_of_an_encoder_are_reported_with_both_files(void **state)
{
	static const char motor[] = "[servo %s]\nencoder = 4\ncounts-per-unit = 400\npwm = 0\n"
				    "direction-pin = 31\nmax-following-error = 1\n";
	char text[512];

	(void)state;
	snprintf(text, sizeof(text), motor, "x");
	put_beside("a.conf", text);
	snprintf(text, sizeof(text), motor, "y");
	put_beside("b.conf", text);
	assert_true(config_read(base, &config, hear, &heard) > 0);
	for (int i = 0; i < heard.count; i++)
		if (strstr(heard.line[i], ".d/b.conf:2: [servo y]: encoder 4 is already that of "
					  "[servo x] (") &&
		    strstr(heard.line[i], ".d/a.conf:2)"))
			return;
	fail_msg("%s", heard.line[0]);
}

static void what_is_no_file_is_refused(void **state)
{
	char path[2 * PATH];

	(void)state;
	snprintf(path, sizeof(path), "%s/a.conf", beside);
	assert_int_equal(mkdir(path, 0700), 0);
	assert_refused(".d/a.conf: cannot be read: Is a directory");
	assert_int_equal(rmdir(path), 0);
	memset(&heard, 0, sizeof(heard));
	assert_int_equal(symlink("/nonexistent", path), 0);
	assert_refused(".d/a.conf: there is no such file; pokeysd.conf(5) says what to write into "
		       "it");
	assert_int_equal(unlink(path), 0);
	assert_int_equal(rmdir(beside), 0);
	put(beside, "");
	memset(&heard, 0, sizeof(heard));
	assert_refused(".d: cannot be read: Not a directory");
}

static void more_files_than_there_are_places_are_refused(void **state)
{
	char name[16];

	(void)state;
	for (int i = 0; i < 32; i++) {
		snprintf(name, sizeof(name), "%d.conf", i);
		put_beside(name, "");
	}
	assert_read();
	put_beside("more.conf", "");
	assert_refused(".d: has too many files, at most 32 are allowed");
}

static void the_runtime_folder_is_that_of_the_last_file(void **state)
{
	(void)state;
	put(base, "[daemon]\nruntime-directory = here\n" GOOD);
	put_beside("a.conf", "[daemon]\nruntime-directory = /run/there\n[device a]\nport = x\n");
	assert_int_equal(config_read_folder(base, &config, hear, &heard), 0);
	assert_string_equal(config.runtime_directory, "/run/there");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_last_file_counts_for_the_daemon),
		TEST(a_file_may_have_a_daemon_section_of_its_own_and_a_device),
		TEST(only_files_that_end_in_conf_are_read),
		TEST(without_the_folder_nothing_is_missing),
		TEST(a_fault_names_its_own_file_and_line),
		TEST(a_fault_of_several_keys_names_the_place_of_its_key),
		TEST(a_device_has_each_key_once_in_all_files),
		TEST(a_section_appears_once_in_a_file),
		TEST(a_shared_terminal_is_reported_with_both_files),
		TEST(two_motors_of_an_encoder_are_reported_with_both_files),
		TEST(what_is_no_file_is_refused),
		TEST(more_files_than_there_are_places_are_refused),
		TEST(the_runtime_folder_is_that_of_the_last_file),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
