/* SPDX-License-Identifier: MIT */
/*
 * The manifest: a small text file in each root that says which layouts the
 * daemon speaks and which devices it has.
 *
 * Two programs of different versions must part with words that a person can
 * act on, and that can only be said by reading something both understand. So
 * this file is text, one "key values" per line; unknown keys are passed over,
 * and that is how it may grow. Whoever reads it believes nothing: not a
 * regular file, too long, a device name that cannot be, a missing layout are
 * all -EPROTO. It is written under another name and renamed, so that it is
 * there whole or not at all.
 */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "shm/manifest.h"
#include "shm/say.h"
#include "shm/segments.h"

enum {
	MANIFEST_MAX = 256 * 1024, /* 64 devices with 19 files each need 120 kB */
	MANIFEST_PATH_MAX = SHM_PATH_MAX + sizeof(SHM_MANIFEST) + 2,
};

#define BOOT_UNKNOWN "unknown"	/* no /proc, as in many a chroot */

static void read_boot(char boot[static 40])
{
	FILE *file = fopen("/proc/sys/kernel/random/boot_id", "re");

	if (!file || fscanf(file, "%39s", boot) != 1)
		strcpy(boot, BOOT_UNKNOWN);
	if (file)
		fclose(file);
}

#define LAYOUT(NAME, name) \
	{ #name, { POKEYS_##NAME##_VERSION, POKEYS_##NAME##_HASH, sizeof(struct pokeys_##name) } }

static const struct {
	const char *name;
	struct manifest_layout layout;
} images[POKEYS_SHM_IMAGES] = {
	[POKEYS_SHM_STATE] = LAYOUT(STATE, state),
	[POKEYS_SHM_DIAG] = LAYOUT(DIAG, diag),
	[POKEYS_SHM_COMMAND] = LAYOUT(COMMAND, command),
	[POKEYS_SHM_REPORT] = LAYOUT(REPORT, report),
	[POKEYS_SHM_WISH] = LAYOUT(WISH, wish),
};

void manifest_init(struct manifest *manifest)
{
	*manifest = (struct manifest){ .pid = getpid(), .iceoryx2 = "0.10.0" };
	for (size_t i = 0; i < POKEYS_SHM_IMAGES; i++)
		manifest->layout[i] = images[i].layout;
	read_boot(manifest->boot);
}

static void print_layout(FILE *file, const char *name, const struct manifest_layout *layout)
{
	fprintf(file, "%s %u %016" PRIx64 " %" PRIu64 "\n", name, layout->version, layout->hash,
		layout->size);
}

static int print_manifest(FILE *file, const char *root, const struct manifest *manifest)
{
	fprintf(file, "pokeysd %ld\nboot %s\nepoch %" PRIx64 "\niceoryx2 %s\n", manifest->pid,
		manifest->boot, manifest->epoch, manifest->iceoryx2);
	for (size_t i = 0; i < POKEYS_SHM_IMAGES; i++)
		print_layout(file, images[i].name, &manifest->layout[i]);
	for (size_t i = 0; i < manifest->devices; i++)
		fprintf(file, "device %s\n", manifest->device[i]);
	return segments_print(root, file);
}

int manifest_write(const char *root, const struct manifest *manifest)
{
	char temporary[MANIFEST_PATH_MAX];
	char path[MANIFEST_PATH_MAX];
	struct stat status;
	FILE *file;
	int fd;
	int r;

	snprintf(temporary, sizeof(temporary), "%s/." SHM_MANIFEST, root);
	snprintf(path, sizeof(path), "%s/" SHM_MANIFEST, root);
	fd = open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0640);
	if (fd < 0)
		return -errno;
	file = fdopen(fd, "w");
	if (!file) {
		close(fd);
		return -ENOMEM;
	}
	fchmod(fd, 0640); /* whatever the umask says, the root's group reads it */
	if (!stat(root, &status) && fchown(fd, (uid_t)-1, status.st_gid) && errno != EPERM) {
		r = -errno;
		fclose(file);
		return r;
	}
	r = print_manifest(file, root, manifest);
	if (fclose(file) && !r)
		r = -errno;
	if (!r && rename(temporary, path))
		r = -errno;
	return r;
}

/* A FIFO or a device in its place must not hold us up: O_NONBLOCK, then look. */
static int open_manifest(const char *root, size_t *bytes)
{
	char path[MANIFEST_PATH_MAX];
	struct stat status;
	int fd;

	snprintf(path, sizeof(path), "%s/" SHM_MANIFEST, root);
	fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	if (fd < 0)
		return errno == ELOOP || errno == ENXIO ? -EPROTO : -errno;
	if (fstat(fd, &status) || !S_ISREG(status.st_mode) || status.st_size <= 0 ||
	    status.st_size > MANIFEST_MAX) {
		close(fd);
		return -EPROTO;
	}
	*bytes = (size_t)status.st_size;
	return fd;
}

/* The whole text, NUL terminated; freed by the caller. */
static int slurp(const char *root, char **out)
{
	size_t bytes = 0;
	ssize_t length;
	char *text;
	int fd = open_manifest(root, &bytes);

	if (fd < 0)
		return fd;
	text = malloc(bytes + 1);
	length = text ? read(fd, text, bytes) : -1;
	close(fd);
	if (length < 0 || memchr(text, 0, (size_t)length)) {
		free(text);
		return text ? -EPROTO : -ENOMEM;
	}
	text[length] = '\0';
	*out = text;
	return 0;
}

static int parse_layout(const char *line, const char *name, struct manifest_layout *layout)
{
	size_t length = strlen(name);

	if (strncmp(line, name, length) || line[length] != ' ')
		return 0;
	if (sscanf(line + length, " %u %" SCNx64 " %" SCNu64, &layout->version, &layout->hash,
		   &layout->size) != 3)
		return -EPROTO;
	return 1;
}

static int parse_device(struct manifest *manifest, const char *name)
{
	if (!runtime_device_name_ok(name) || manifest->devices == SHM_DEVICES_MAX)
		return -EPROTO;
	snprintf(manifest->device[manifest->devices++], POKEYS_SHM_NAME_MAX, "%s", name);
	return 1;
}

static int parse_line(struct manifest *manifest, const char *line)
{
	int r = 0;

	if (!strncmp(line, "device ", 7))
		return parse_device(manifest, line + 7);
	if (sscanf(line, "pokeysd %ld", &manifest->pid) == 1 ||
	    sscanf(line, "boot %39s", manifest->boot) == 1 ||
	    sscanf(line, "epoch %" SCNx64, &manifest->epoch) == 1 ||
	    sscanf(line, "iceoryx2 %15s", manifest->iceoryx2) == 1)
		return 0;
	for (size_t i = 0; !r && i < POKEYS_SHM_IMAGES; i++)
		r = parse_layout(line, images[i].name, &manifest->layout[i]);
	return r;
}

static int parse(struct manifest *manifest, char *text)
{
	char *line;

	memset(manifest, 0, sizeof(*manifest));
	while ((line = strsep(&text, "\n"))) {
		if (parse_line(manifest, line) < 0)
			return -EPROTO;
	}
	/* an image that it does not name, it does not have: manifest_check says so */
	return manifest->layout[POKEYS_SHM_STATE].size && manifest->iceoryx2[0] ? 0 : -EPROTO;
}

int manifest_read(const char *root, struct manifest *out)
{
	char *text;
	int r = slurp(root, &text);

	if (r)
		return r;
	r = parse(out, text);
	free(text);
	return r;
}

int manifest_check_segments(const char *root, char *why, size_t size)
{
	char name[256];
	uint64_t bytes;
	char *text, *rest, *line;
	int r = slurp(root, &text);

	if (r)
		return r;
	rest = text;
	while (!r && (line = strsep(&rest, "\n"))) {
		if (sscanf(line, "segment %255s %" SCNu64, name, &bytes) == 2)
			r = segment_check(root, name, bytes, why, size);
	}
	free(text);
	return r;
}

bool manifest_gone(const char *root)
{
	char path[MANIFEST_PATH_MAX];

	snprintf(path, sizeof(path), "%s/" SHM_MANIFEST, root);
	return access(path, F_OK) && errno == ENOENT;
}

static int check_layout(const char *name, const struct manifest_layout *theirs,
			const struct manifest_layout *ours, char *why, size_t size)
{
	if (theirs->version != ours->version)
		return say(why, size, -EPROTONOSUPPORT,
			   "the daemon speaks %s layout %u, this program %u; "
			   "install daemon and program of one version",
			   name, theirs->version, ours->version);
	if (theirs->hash != ours->hash || theirs->size != ours->size)
		return say(why, size, -EPROTONOSUPPORT,
			   "the daemon speaks %s layout %u.%08x, this program %u.%08x; "
			   "install daemon and program of one build",
			   name, theirs->version, (unsigned int)(theirs->hash >> 32), ours->version,
			   (unsigned int)(ours->hash >> 32));
	return 0;
}

int manifest_check(const struct manifest *manifest, char *why, size_t size)
{
	struct manifest ours;
	int r = 0;

	manifest_init(&ours);
	if (strcmp(manifest->boot, ours.boot) && strcmp(manifest->boot, BOOT_UNKNOWN) &&
	    strcmp(ours.boot, BOOT_UNKNOWN))
		return say(why, size, -ENOENT,
			   "the last daemon ran before this machine was started; "
			   "is pokeysd running?");
	if (strcmp(manifest->iceoryx2, ours.iceoryx2))
		return say(why, size, -EPROTONOSUPPORT,
			   "the daemon uses iceoryx2 %s, this program %s; "
			   "install daemon and program of one version",
			   manifest->iceoryx2, ours.iceoryx2);
	for (size_t i = 0; !r && i < POKEYS_SHM_IMAGES; i++)
		r = check_layout(images[i].name, &manifest->layout[i], &ours.layout[i], why, size);
	return r;
}

bool manifest_has_device(const struct manifest *manifest, const char *name)
{
	for (size_t i = 0; i < manifest->devices; i++) {
		if (!strcmp(manifest->device[i], name))
			return true;
	}
	return false;
}
