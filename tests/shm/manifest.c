/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The manifest: what is written comes back, and no text at all makes the
 * reader stumble (POKEYS_SEED, POKEYS_MUTATIONS).
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/manifest.h"
#include "tests/shm/folder.h"

static void make_root(const struct folder *folder, struct manifest *manifest)
{
	char path[64];

	assert_int_equal(mkdir(folder->path, 0700), 0);
	snprintf(path, sizeof(path), "%s/services", folder->path);
	assert_int_equal(mkdir(path, 0700), 0);
	manifest_init(manifest);
	manifest->epoch = 0xabcdef;
	for (int i = 0; i < 3; i++)
		snprintf(manifest->device[manifest->devices++], POKEYS_SHM_NAME_MAX, "device-%d",
			 i);
	assert_int_equal(manifest_write(folder->path, manifest), 0);
}

static void remove_root(const struct folder *folder)
{
	char path[64];

	snprintf(path, sizeof(path), "%s/manifest", folder->path);
	unlink(path);
	snprintf(path, sizeof(path), "%s/services", folder->path);
	rmdir(path);
}

static void what_is_written_comes_back(void **state)
{
	struct manifest in, out;

	make_root(*state, &in);
	assert_int_equal(manifest_read(((struct folder *)*state)->path, &out), 0);
	assert_memory_equal(&in, &out, sizeof(in));
	assert_int_equal(manifest_check(&out, NULL, 0), 0);
	assert_true(manifest_has_device(&out, "device-2"));
	assert_false(manifest_has_device(&out, "device-3"));
	assert_false(manifest_has_device(&out, "device"));
	remove_root(*state);
}

static void segments_are_listed_with_their_sizes(void **state)
{
	struct folder *folder = *state;
	struct manifest manifest;
	char path[64], why[256];

	make_root(folder, &manifest);
	snprintf(path, sizeof(path), "%s/p1.data", folder->path);
	fclose(fopen(path, "w"));
	assert_int_equal(truncate(path, 5000), 0);
	assert_int_equal(manifest_write(folder->path, &manifest), 0);
	assert_int_equal(manifest_check_segments(folder->path, why, sizeof(why)), 0);
	assert_int_equal(truncate(path, 4999), 0);
	assert_int_equal(manifest_check_segments(folder->path, why, sizeof(why)), -EBADMSG);
	assert_non_null(strstr(why, "p1.data has 4999 bytes, pokeysd made it 5000 long"));
	unlink(path);
	assert_int_equal(manifest_check_segments(folder->path, why, sizeof(why)), -ENOENT);
	remove_root(folder);
}

static void segment_outside_the_root_is_not_looked_at(void **state)
{
	struct folder *folder = *state;
	struct manifest manifest;
	char path[64];
	FILE *file;

	make_root(folder, &manifest);
	snprintf(path, sizeof(path), "%s/manifest", folder->path);
	file = fopen(path, "a");
	fprintf(file, "segment ../../../../etc/passwd 1\n");
	fclose(file);
	assert_int_equal(manifest_check_segments(folder->path, NULL, 0), -EPROTO);
	remove_root(folder);
}

static void mutate(char *text, size_t *length, size_t room)
{
	static const char *const splinters[] = {
		"\n",     " ", "device ", "segment ", "-1", "%s", "99999999999999999999999",
		"state ", "\t"
	};
	size_t at = (size_t)rand() % (*length + 1);
	const char *splinter = splinters[(size_t)rand() % (sizeof(splinters) / sizeof(char *))];
	size_t size = strlen(splinter);

	switch (rand() % 4) {
	case 0:
		if (at < *length)
			text[at] = (char)rand();
		break;
	case 1:
		*length = at;
		break;
	case 2:
		if (*length + size < room) {
			memmove(text + at + size, text + at, *length - at);
			memcpy(text + at, splinter, size);
			*length += size;
		}
		break;
	default:
		if (at < *length)
			memmove(text + at, text + at + 1, --*length - at);
		break;
	}
}

static void no_text_makes_it_stumble(void **state)
{
	unsigned int mutations = folder_count("POKEYS_MUTATIONS", 3000);
	struct folder *folder = *state;
	static char good[8192], text[8192];
	struct manifest manifest;
	size_t size, length;
	char path[64], why[256];
	FILE *file;

	srand(folder_seed());
	make_root(folder, &manifest);
	snprintf(path, sizeof(path), "%s/manifest", folder->path);
	file = fopen(path, "r");
	size = fread(good, 1, sizeof(good), file);
	fclose(file);
	for (unsigned int i = 0; i < mutations; i++) {
		memcpy(text, good, length = size);
		for (int j = rand() % 8; j >= 0; j--)
			mutate(text, &length, sizeof(text));
		file = fopen(path, "w");
		fwrite(text, 1, length, file);
		fclose(file);
		manifest_check_segments(folder->path, why, sizeof(why));
		if (manifest_read(folder->path, &manifest))
			continue;
		manifest_check(&manifest, why, sizeof(why));
		assert_true(manifest.devices <= SHM_DEVICES_MAX);
		for (size_t k = 0; k < manifest.devices; k++)
			assert_true(runtime_device_name_ok(manifest.device[k]));
	}
	remove_root(folder);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(what_is_written_comes_back),
		BOTH(segments_are_listed_with_their_sizes),
		BOTH(segment_outside_the_root_is_not_looked_at),
		BOTH(no_text_makes_it_stumble),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
