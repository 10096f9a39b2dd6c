/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Two versions meet, and a foreign writer: refused in words, and nothing of
 * what was found reaches the caller. Here a commander's; a reader's in mirror.c.
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/host_private.h"
#include "shm/iox.h"
#include "tests/shm/folder.h"

static void manifest_path(const struct folder *folder, char path[64])
{
	snprintf(path, 64, "%s/current/manifest", folder->path);
}

/* The running daemon's manifest with one word put for another. */
static void rewrite_manifest(const struct folder *folder, const char *from, const char *to)
{
	static char text[65536], changed[65536];
	char path[64];
	char *at;
	FILE *file;
	size_t length;

	manifest_path(folder, path);
	file = fopen(path, "r+");
	assert_non_null(file);
	length = fread(text, 1, sizeof(text) - 1, file);
	text[length] = '\0';
	at = strstr(text, from);
	assert_non_null(at);
	length = (size_t)snprintf(changed, sizeof(changed), "%.*s%s%s", (int)(at - text), text, to,
				  at + strlen(from));
	rewind(file);
	assert_int_equal(fwrite(changed, 1, length, file), length);
	fclose(file);
	assert_int_equal(truncate(path, (off_t)length), 0);
}

static void assert_refused(struct folder *folder, const char *from, const char *to,
			   const char *words)
{
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_state image;

	rewrite_manifest(folder, from, to);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	if (!strstr(folder_status(folder, client), words))
		fail_msg("it said: %s", folder->why);
	assert_int_equal(pokeys_client_read(client, &image), -ENOTCONN);
	rewrite_manifest(folder, to, from);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* "\nstate 2 " and what is said of another number there. */
static void assert_version_refused(struct folder *folder, const char *image, unsigned int ours,
				   unsigned int theirs)
{
	char from[32], to[32], words[96];

	snprintf(from, sizeof(from), "\n%s %u ", image, ours);
	snprintf(to, sizeof(to), "\n%s %u ", image, theirs);
	snprintf(words, sizeof(words), "the daemon speaks %s layout %u, this program %u", image,
		 theirs, ours);
	assert_refused(folder, from, to, words);
}

static void another_version_of_any_image_is_refused_with_both_numbers(void **state)
{
	assert_version_refused(*state, "state", POKEYS_STATE_VERSION, POKEYS_STATE_VERSION + 1);
	assert_version_refused(*state, "diag", POKEYS_DIAG_VERSION, 77);
	assert_version_refused(*state, "command", POKEYS_COMMAND_VERSION, 0);
	assert_version_refused(*state, "report", POKEYS_REPORT_VERSION, 7);
	assert_version_refused(*state, "wish", POKEYS_WISH_VERSION, 7);
}

/* As one is that was made before there were wishes. */
static void daemon_without_an_image_is_refused_as_version_0(void **state)
{
	assert_refused(*state, "\nwish ", "\nwash ",
		       "the daemon speaks wish layout 0, this program");
}

static void another_layout_of_the_same_version_is_refused(void **state)
{
	char from[40], words[96];

	snprintf(from, sizeof(from), "%016llx", (unsigned long long)POKEYS_STATE_HASH);
	snprintf(words, sizeof(words),
		 "the daemon speaks state layout %u.01234567, this program %u.",
		 POKEYS_STATE_VERSION, POKEYS_STATE_VERSION);
	assert_refused(*state, from, "0123456789abcdef", words);
}

static void another_iceoryx2_is_refused_with_both_versions(void **state)
{
	assert_refused(*state, "iceoryx2 0.10.0", "iceoryx2 0.11.3",
		       "the daemon uses iceoryx2 0.11.3, this program 0.10.0");
}

/* A folder on a disk outlives the machine; its time stamps do not. */
static void daemon_of_an_earlier_boot_is_gone(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);

	rewrite_manifest(folder, "\nboot ", "\nboot 0");
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	assert_non_null(strstr(folder_status(folder, client), "before this machine was started"));
	pokeys_client_close(client);
	shm_host_close(host);
}

static void manifest_of_a_later_daemon_may_say_more(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);

	rewrite_manifest(folder, "device mill\n", "device mill\ncolour blue 7\n");
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* The second line of defence, where there is no manifest: the services' type. */
static char found_type[128];

static int look_for_type(const char *path, const struct stat *status, int type, struct FTW *at)
{
	static char bytes[65536];
	size_t length;
	FILE *file;
	char *hit;

	(void)status;
	(void)at;
	if (type != FTW_F || !strstr(path, ".blackboard_mgmt"))
		return 0;
	file = fopen(path, "r");
	length = fread(bytes, 1, sizeof(bytes), file);
	fclose(file);
	hit = memmem(bytes, length, "pokeys.state.", 13);
	if (hit)
		snprintf(found_type, sizeof(found_type), "%s", hit);
	return 0;
}

static void type_of_the_service_names_version_and_hash(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char type[64];

	found_type[0] = '\0';
	nftw(folder->path, look_for_type, 8, FTW_PHYS);
	snprintf(type, sizeof(type), "pokeys.state.v%d.0x%016llx", POKEYS_STATE_VERSION,
		 (unsigned long long)POKEYS_STATE_HASH);
	assert_string_equal(found_type, type);
	shm_host_close(host);
}

static void service_of_another_type_cannot_be_opened(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct iox_diag_reader *reader = NULL;
	struct iox_error error = { "" };

	/* a diag reader on the state's service: other type, other size */
	assert_int_equal(iox_diag_reader_open(host->node, "pokeys/mill/state", &reader, &error),
			 -EPROTO);
	assert_string_equal(error.text, "a value of another size");
	shm_host_close(host);
}

/* ---- a foreign writer: right service, wrong image ---- */

static void spoil(struct pokeys_state *image, int how)
{
	switch (how) {
	case 0:
		image->magic ^= 1;
		break;
	case 1:
		image->version++;
		break;
	case 2:
		image->size_units--;
		break;
	case 3:
		image->hash ^= UINT64_C(1) << 63;
		break;
	case 4:
		memset(image, 0xa5, sizeof(*image));
		break;
	default:
		memset(image, 0, sizeof(*image));
		break;
	}
}

static void foreign_state_is_refused_and_out_untouched(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_state good, out, before;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_read(client, &good), 0);
	memset(&before, 0x5a, sizeof(before));
	for (int how = 0; how < 6; how++) {
		struct pokeys_state *cell = iox_state_loan(mill->state);

		memcpy(cell, &good, sizeof(good));
		spoil(cell, how);
		iox_state_commit(mill->state);
		out = before;
		assert_int_equal(pokeys_client_read(client, &out), -EPROTO);
		assert_memory_equal(&out, &before, sizeof(out));
	}
	shm_device_write(mill, &good);
	assert_int_equal(pokeys_client_read(client, &out), 0);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void foreign_command_is_refused_and_out_untouched(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct iox_command_writer *writer;
	struct pokeys_command out, before;

	assert_int_equal(iox_command_writer_open(host->node, "pokeys/mill/command", &writer, NULL),
			 0);
	memset(&before, 0x5a, sizeof(before));
	for (int how = 0; how < 4; how++) {
		struct pokeys_command *cell = iox_command_loan(writer);

		memset(cell, how, sizeof(*cell));
		cell->magic = how == 1 ? 0 : POKEYS_COMMAND_MAGIC;
		cell->version = how == 2 ? 9 : POKEYS_COMMAND_VERSION;
		cell->size_units = sizeof(*cell) / 8;
		cell->hash = how == 3 ? 1 : how == 0 ? 0 : POKEYS_COMMAND_HASH;
		iox_command_commit(writer);
		out = before;
		assert_int_equal(shm_device_read_command(mill, &out), -EPROTO);
		assert_memory_equal(&out, &before, sizeof(out));
	}
	iox_command_writer_close(writer);
	shm_host_close(host);
}

static void panic_upstream_ends_at_the_border(void **state)
{
	struct iox_error error = { "" };

	(void)state;
	assert_int_equal(iox_test_panic(&error), -ENOTRECOVERABLE);
	assert_string_equal(error.text, "panic: test");
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(another_version_of_any_image_is_refused_with_both_numbers),
		BOTH(daemon_without_an_image_is_refused_as_version_0),
		BOTH(another_layout_of_the_same_version_is_refused),
		BOTH(another_iceoryx2_is_refused_with_both_versions),
		BOTH(daemon_of_an_earlier_boot_is_gone),
		BOTH(manifest_of_a_later_daemon_may_say_more),
		BOTH(type_of_the_service_names_version_and_hash),
		BOTH(service_of_another_type_cannot_be_opened),
		BOTH(foreign_state_is_refused_and_out_untouched),
		BOTH(foreign_command_is_refused_and_out_untouched),
		cmocka_unit_test(panic_upstream_ends_at_the_border),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
