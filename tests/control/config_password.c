// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The file with a device's password: taken only if nobody else could have read or
 * written it, and nothing of what is in it is ever said.
 */
#include "tests/control/faults.h"

/* A file of this mode and content; its path. */
static const char *password_file(const char *content, size_t length, mode_t mode)
{
	static char path[] = "/tmp/pokeysd-password-XXXXXX";
	int fd;

	memcpy(path + sizeof(path) - 7, "XXXXXX", 6);
	fd = mkstemp(path);
	assert_true(fd >= 0);
	assert_int_equal(write(fd, content, length), (ssize_t)length);
	assert_int_equal(fchmod(fd, mode), 0);
	close(fd);
	return path;
}

static void assert_password(const char *content, size_t length, mode_t mode, const char *expected)
{
	const char *path = password_file(content, length, mode);
	char text[256];
	int faults;

	snprintf(text, sizeof(text), GOOD "password-file = %s\n", path);
	faults = parse(text);
	unlink(path);
	if (!expected) {
		assert_int_equal(faults, 0);
		return;
	}
	assert_int_equal(faults, 1);
	if (!strstr(heard.line[0], expected) || strncmp(heard.line[0], "f:3: [device a]: ", 17))
		fail_msg("it said: %s", heard.line[0]);
	/* and nothing of what is in it */
	assert_null(strstr(heard.line[0], "secret"));
}

/* The guard runs without the right to the daemon's files. */
static void a_public_reader_leaves_password_files_alone(void **state)
{
	char text[300], path[] = "/tmp/pokeysd-conf-XXXXXX";
	int fd = mkstemp(path);

	(void)state;
	snprintf(text, sizeof(text), GOOD "password-file = /nonexistent/x\n");
	assert_int_equal(write(fd, text, strlen(text)), (ssize_t)strlen(text));
	close(fd);
	assert_int_equal(config_read_public(path, &config, hear, &heard), 0);
	assert_string_equal(config.device[0].password, "");
	assert_int_equal(config_read(path, &config, hear, &heard), 1);
	unlink(path);
}

static void a_password_is_taken_from_a_file_that_nobody_else_reads(void **state)
{
	(void)state;
	assert_password("secret\n", 7, 0600, NULL);
	assert_string_equal(config.device[0].password, "secret");
	assert_true(config.device[0].have_password);
	assert_password("secret", 6, 0400, NULL);
	assert_password("0123456789abcdef0123456789abcdef\n", 33, 0600, NULL);
	assert_int_equal(strlen(config.device[0].password), 32);
	assert_password("secret\n", 7, 0640, "may be read by others");
	assert_password("secret\n", 7, 0604, "may be read by others");
	assert_password("", 0, 0600, "one line of 1 to 32 characters");
	assert_password("\n", 1, 0600, "one line of 1 to 32 characters");
	assert_password("secret\nsecret\n", 14, 0600, "one line of 1 to 32 characters");
	assert_password("secret\0x\n", 9, 0600, "one line of 1 to 32 characters");
	assert_password("secretsecretsecretsecretsecretsec\n", 34, 0600,
			"one line of 1 to 32 characters");
	assert_int_equal(parse(GOOD), 0);
	assert_false(config.device[0].have_password);
}

static void a_password_file_that_is_no_file_is_refused(void **state)
{
	char other[] = "/tmp/pokeysd-link-XXXXXX", text[256];
	const char *target;
	int fd = mkstemp(other);

	(void)state;
	close(fd);
	unlink(other);
	assert_int_equal(parse(GOOD "password-file = /nonexistent/x\n"), 1);
	assert_non_null(strstr(heard.line[0], "password-file: /nonexistent/x is not there"));
	assert_int_equal(parse(GOOD "password-file = /dev/null\n"), 1);
	assert_non_null(strstr(heard.line[0], "is not a file"));
	target = password_file("secret\n", 7, 0600);
	assert_int_equal(symlink(target, other), 0);
	snprintf(text, sizeof(text), GOOD "password-file = %s\n", other);
	assert_int_equal(parse(text), 1);
	assert_non_null(strstr(heard.line[0], "is a link, not a file"));
	unlink(other);
	assert_int_equal(mkfifo(other, 0600), 0);
	assert_int_equal(parse(text), 1);
	assert_non_null(strstr(heard.line[0], "is not a file"));
	unlink(other);
	if (!geteuid()) { /* the service is not root, and root's file is not for it */
		snprintf(text, sizeof(text), GOOD "password-file = %s\n", target);
		assert_int_equal(seteuid(12345), 0);
		assert_int_equal(parse(text), 1);
		assert_int_equal(seteuid(0), 0);
		assert_non_null(strstr(heard.line[0], "cannot be opened by this user; make it the "
						      "daemon's (chown pokeys)"));
	}
	if (!geteuid() && !chown(target, 12345, 12345)) {
		snprintf(text, sizeof(text), GOOD "password-file = %s\n", target);
		assert_int_equal(parse(text), 1);
		assert_non_null(strstr(heard.line[0], "belongs neither to root nor"));
	}
	unlink(target);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_public_reader_leaves_password_files_alone),
		cmocka_unit_test(a_password_is_taken_from_a_file_that_nobody_else_reads),
		cmocka_unit_test(a_password_file_that_is_no_file_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
